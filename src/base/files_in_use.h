// Files that are being written or read in place: what a signal handler has to know of them.
#pragma once

#include <cstddef>
#include <string>

namespace nacre {

/// Enters a file into a list without locks or memory of its own, so that signal handlers can read it; leaves
/// it when it goes. Where the list is full or the name longer than 4,095 bytes, the file goes without.
class FileInUse {
 public:
  /// A temporary file, to be removed should a signal end the program.
  static FileInUse temporary(const std::string& path) { return {path, nullptr, 0}; }
  /// A mapping of `size` bytes, whose pages go away should the file be cut short.
  static FileInUse mapping(const std::string& path, const void* data, std::size_t size) {
    return {path, data, size};
  }
  FileInUse() = default;
  FileInUse(FileInUse&& other) noexcept;
  FileInUse& operator=(FileInUse&& other) noexcept;
  ~FileInUse();

 private:
  FileInUse(const std::string& path, const void* data, std::size_t size);

  int slot_ = -1;
};

/// Removes all temporary files. For signal handlers.
void remove_temporaries() noexcept;
/// The name of the file that is mapped at an address, or nullptr. For signal handlers.
const char* mapped_at(const void* address) noexcept;

}  // namespace nacre
