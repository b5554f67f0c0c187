// Temporary file, sync, rename.
#include "nacre/base/file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>

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

}  // namespace

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)), target_(follow_links(path_)) {
  static std::atomic<unsigned> serial{0};
  struct stat status;
  if (::stat(target_.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) {
      errno = EISDIR;
      fail_io(path_, "write");
    }
    if (S_ISCHR(status.st_mode)) {
      descriptor_ = ::open(target_.c_str(), O_RDWR | O_CLOEXEC | O_NOCTTY);
      if (descriptor_ < 0) fail_io(path_, "write");
      return;
    }
    if (!S_ISREG(status.st_mode))
      fail(ErrorCode::kIo, path_, "cannot write: it is not a regular file; give the name of one");
  }
  // Another machine, or a process that was killed, may have left one of the same number.
  do {
    temporary_ = fmt::format("{}.tmp-{}-{}", target_, ::getpid(), serial++);
    descriptor_ = ::open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  } while (descriptor_ < 0 && errno == EEXIST);
  if (descriptor_ < 0) fail_io(path_, "write");
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
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

void AtomicFile::commit() {
  const bool device = temporary_.empty();
  if (!device && ::fsync(descriptor_) != 0) fail_io(path_, "write");
  const int descriptor = descriptor_;
  descriptor_ = -1;
  if (::close(descriptor) != 0) fail_io(path_, "write");
  if (device) return;
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail_io(path_, "write");
  temporary_.clear();
  // The rename itself has to reach the disk too; a file system that cannot sync a folder is no reason to
  // fail.
  const auto folder = std::filesystem::path(target_).parent_path();
  const int folder_descriptor =
      ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder_descriptor >= 0) {
    ::fsync(folder_descriptor);
    ::close(folder_descriptor);
  }
}

std::string read_text_file(const std::string& path, std::size_t max_bytes) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) {
    const int error = errno;
    fail(error == ENOENT || error == ENOTDIR ? ErrorCode::kNotFound : ErrorCode::kIo, path, "cannot read: {}",
         std::strerror(error));
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
