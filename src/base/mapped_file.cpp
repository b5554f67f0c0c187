// Mappings, and whether what they show is still what was opened.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <mutex>
#include <set>

#include "base/files_in_use.h"
#include "nacre/base/file.h"

namespace nacre {
namespace {

std::mutex mappings_mutex;

}  // namespace

struct MappedFile::State {
  std::string path;
  int descriptor;
  struct stat opened {};
  FileInUse in_use{};

  State(const std::string& name, int open_descriptor) : path(name), descriptor(open_descriptor) {}
  ~State() { ::close(descriptor); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  static std::set<const State*>& all() {
    static std::set<const State*> states;
    return states;
  }
  bool is_changed() const noexcept {
    struct stat now;
    return ::fstat(descriptor, &now) != 0 || now.st_size != opened.st_size ||
           now.st_mtim.tv_sec != opened.st_mtim.tv_sec || now.st_mtim.tv_nsec != opened.st_mtim.tv_nsec;
  }
};

MappedFile::MappedFile(const std::string& path, const char* name) {
  // Not blocking: a pipe has to be refused, not waited for.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) {
    const int error = errno;
    fail(error == ENOENT || error == ENOTDIR ? ErrorCode::kNotFound : ErrorCode::kIo, path,
         "cannot read the {}: {}", name, std::strerror(error));
  }
  state_ = std::make_unique<State>(path, descriptor);
  if (::fstat(descriptor, &state_->opened) != 0 || !S_ISREG(state_->opened.st_mode))
    fail(ErrorCode::kNotACache, path, "is not a regular file");
  if (const auto size = static_cast<std::size_t>(state_->opened.st_size); size > 0) {
    void* const address = ::mmap(nullptr, size, PROT_READ, MAP_PRIVATE, descriptor, 0);
    if (address == MAP_FAILED)
      fail(ErrorCode::kIo, path, "cannot map the {}: {}", name, std::strerror(errno));
    bytes_ = {static_cast<const unsigned char*>(address), size};
    state_->in_use = FileInUse::mapping(path, address, size);
  }
  const std::lock_guard lock(mappings_mutex);
  State::all().insert(state_.get());
}

MappedFile::~MappedFile() {
  {
    const std::lock_guard lock(mappings_mutex);
    State::all().erase(state_.get());
  }
  state_->in_use = {};
  if (!bytes_.empty()) ::munmap(const_cast<unsigned char*>(bytes_.data()), bytes_.size());
}

void MappedFile::check_unchanged() {
  const std::lock_guard lock(mappings_mutex);
  for (const State* const state : State::all())
    if (state->is_changed())
      fail(ErrorCode::kMismatch, state->path,
           "was written to while it was read; give the command again, and replace files that are in use by "
           "renaming");
}

}  // namespace nacre
