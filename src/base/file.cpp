// Nameless file, sync, name, rename.
#include "nacre/base/file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <map>
#include <mutex>
#include <string_view>
#include <utility>
#include <vector>

#include "base/files_in_use.h"

namespace nacre {
namespace {

[[noreturn]] void fail_io(const std::string& path, const char* action) {
  const int error = errno;
  fail(ErrorCode::kIo, path, "cannot {}: {}", action, std::strerror(error));
}

// Where a chain of symbolic links leads, so that renaming replaces the file and not the link to it.
std::string follow_links(const std::string& path) {
  std::filesystem::path at = path;
  std::error_code error;
  for (int link = 0; link < 40; ++link) {
    const auto target = std::filesystem::read_symlink(at, error);
    if (error) return at.string();
    at = at.parent_path() / target;
  }
  errno = ELOOP;
  fail_io(path, "write");
}

std::string folder_of(const std::string& path) {
  const auto folder = std::filesystem::path(path).parent_path();
  return folder.empty() ? "." : folder.string();
}

std::string link_to(int descriptor) { return fmt::format("/proc/self/fd/{}", descriptor); }

constexpr const char* kTemporary = ".tmp-";     // between a target's name and a number
constexpr std::size_t kLongestName = 255 - 32;  // so that both have room

// A target's name, as its temporary files begin.
std::string temporary_stem(const std::string& target) {
  return std::filesystem::path(target).filename().string().substr(0, kLongestName);
}

// What follows the target's name in one: ".tmp-", a process and a number of its own.
bool is_temporary_ending(std::string_view ending) {
  const std::string_view start(kTemporary);
  if (!ending.starts_with(start)) return false;
  ending.remove_prefix(start.size());
  const std::size_t dash = ending.find('-');
  const auto is_number = [](std::string_view text) {
    return !text.empty() && text.find_first_not_of("0123456789") == std::string_view::npos;
  };
  return dash != std::string_view::npos && is_number(ending.substr(0, dash)) &&
         is_number(ending.substr(dash + 1));
}

constexpr std::time_t kSurelyLocked = 60;  // seconds after which a file that is written to has its lock

// Temporary files that are in a folder when this process first writes there: one of thousands of pictures is
// not searched for each of them.
const std::vector<std::filesystem::path>& temporaries_in(const std::string& folder) {
  static std::mutex mutex;
  static std::map<std::string, std::vector<std::filesystem::path>> found;
  const std::lock_guard lock(mutex);
  const auto [place, is_new] = found.try_emplace(folder);
  std::error_code ignored;
  if (is_new)
    for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
      if (entry.path().filename().string().find(kTemporary) != std::string::npos)
        place->second.push_back(entry.path());
  return place->second;
}

// Removes what processes that were killed have left beside a target: who still writes holds a lock.
void remove_leftovers(const std::string& target) {
  const std::string own = temporary_stem(target);
  for (const std::filesystem::path& path : temporaries_in(folder_of(target))) {
    const std::string name = path.filename().string();
    if (!name.starts_with(own) || !is_temporary_ending(std::string_view(name).substr(own.size()))) continue;
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (descriptor < 0) continue;
    struct stat status;
    if (::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) &&
        status.st_mtime + kSurelyLocked < std::time(nullptr) && ::flock(descriptor, LOCK_EX | LOCK_NB) == 0)
      ::unlink(path.c_str());
    ::close(descriptor);
  }
}

}  // namespace

struct AtomicFile::Temporary {
  explicit Temporary(const std::string& target) : path(next_name(target)) {}
  static std::string next_name(const std::string& target) {
    static std::atomic<unsigned> serial{0};
    return fmt::format("{}/{}{}{}-{}", folder_of(target), temporary_stem(target), kTemporary, ::getpid(),
                       serial++);
  }
  std::string path;
  FileInUse in_use = FileInUse::temporary(path);
};

// Calls make(path), which gives a descriptor or 0, or -1 and errno, until the name is free: another machine,
// or a process that was killed, may have left one of the same number.
template <class Make>
int AtomicFile::make_temporary(const Make& make) {
  int result = 0;
  do {
    temporary_ = std::make_unique<Temporary>(target_);
    result = make(temporary_->path.c_str());
  } while (result < 0 && errno == EEXIST);
  if (result >= 0) return result;
  const int error = errno;
  temporary_.reset();  // it is somebody else's, if anybody's
  errno = error;
  fail_io(path_, "write");
}

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)), target_(follow_links(path_)) {
  struct stat status;
  if (::stat(target_.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) {
      errno = EISDIR;
      fail_io(path_, "write");
    }
    device_ = S_ISCHR(status.st_mode);
    if (!device_ && !S_ISREG(status.st_mode))
      fail(ErrorCode::kIo, path_, "cannot write: it is not a regular file; give the name of one");
  }
  if (device_) {
    descriptor_ = ::open(target_.c_str(), O_RDWR | O_CLOEXEC | O_NOCTTY);
    if (descriptor_ < 0) fail_io(path_, "write");
    return;
  }
  remove_leftovers(target_);
  descriptor_ = ::open(folder_of(target_).c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666);
  if (descriptor_ >= 0 && ::access(link_to(descriptor_).c_str(), F_OK) != 0) {
    ::close(descriptor_);  // no /proc: it could never get a name
    descriptor_ = -1;
  }
  if (descriptor_ < 0)
    descriptor_ = make_temporary(
        [](const char* name) { return ::open(name, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666); });
  ::flock(descriptor_, LOCK_EX | LOCK_NB);  // where files can be locked
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (temporary_) ::unlink(temporary_->path.c_str());
}

void AtomicFile::write(const void* data, std::size_t bytes) {
  const char* at = static_cast<const char*>(data);
  while (bytes > 0) {
    const ssize_t written = ::write(descriptor_, at, bytes);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail_io(path_, "write");
    at += written;
    bytes -= static_cast<std::size_t>(written);
  }
}

void AtomicFile::seek(std::uint64_t position) {
  if (::lseek(descriptor_, static_cast<off_t>(position), SEEK_SET) < 0) fail_io(path_, "write");
}

void AtomicFile::commit() {
  MappedFile::check_unchanged();
  if (!device_) {
    if (::fsync(descriptor_) != 0) fail_io(path_, "write");
    // A file cannot be linked over another one, only renamed.
    if (!temporary_)
      make_temporary([&](const char* name) {
        return ::linkat(AT_FDCWD, link_to(descriptor_).c_str(), AT_FDCWD, name, AT_SYMLINK_FOLLOW);
      });
  }
  const int descriptor = descriptor_;
  descriptor_ = -1;
  const int lock = ::fcntl(descriptor, F_DUPFD_CLOEXEC, 0);  // until it has its name
  const bool closed = ::close(descriptor) == 0;
  const bool renamed = closed && (device_ || ::rename(temporary_->path.c_str(), target_.c_str()) == 0);
  const int error = errno;
  if (lock >= 0) ::close(lock);
  errno = error;
  if (!renamed) fail_io(path_, "write");
  if (device_) return;
  temporary_.reset();
  // The rename itself has to reach the disk too; a file system that cannot sync a folder is no reason to
  // fail.
  const int folder = ::open(folder_of(target_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder >= 0) {
    ::fsync(folder);
    ::close(folder);
  }
}

std::string read_text_file(const std::string& path, std::size_t max_bytes) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    const int error = errno;
    fail(error == ENOENT || error == ENOTDIR ? ErrorCode::kNotFound : ErrorCode::kIo, path, "cannot read: {}",
         std::strerror(error));
  }
  struct stat status;
  if (::fstat(descriptor, &status) == 0 && (S_ISBLK(status.st_mode) || S_ISCHR(status.st_mode)) &&
      ::isatty(descriptor) == 0) {
    ::close(descriptor);
    fail(ErrorCode::kIo, path, "cannot read: a device, and no file");
  }
  std::string content;
  char buffer[1 << 16];
  for (;;) {
    const ssize_t got = ::read(descriptor, buffer, sizeof buffer);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) {
      const int error = errno;
      ::close(descriptor);
      fail(ErrorCode::kIo, path, "cannot read: {}", std::strerror(error));
    }
    if (got == 0) break;
    content.append(buffer, static_cast<std::size_t>(got));
    if (content.size() > max_bytes) {
      ::close(descriptor);
      fail(ErrorCode::kLimit, path, "larger than {} bytes", max_bytes);
    }
  }
  ::close(descriptor);
  return content;
}

}  // namespace nacre
