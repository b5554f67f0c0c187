// Files that are there whole or not at all.
#pragma once

#include <string>

#include "nacre/base/error.h"

namespace nacre {

/// A file being written under a temporary name beside its final one. commit() syncs and renames it; without
/// commit() the destructor removes it, so that an error or an exception leaves nothing behind. A symbolic
/// link stays one: what it points to is replaced. A device such as /dev/null is written to as it is.
class AtomicFile {
 public:
  /// Creates `path`.tmp-<pid>-<n>. Throws Error(kIo, path) if the folder is missing or not writable, or
  /// `path` is a folder, a pipe or a socket.
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Empty for a device.
  const std::string& temporary_path() const noexcept { return temporary_; }
  int descriptor() const noexcept { return descriptor_; }
  /// Writes all bytes. Throws Error(kIo, path) with the system's reason (disk full, ...).
  void write(const void* data, std::size_t bytes);
  /// Syncs, closes, renames over `path` and syncs the folder. Throws Error(kIo, path).
  void commit();

 private:
  std::string path_, target_, temporary_;
  int descriptor_ = -1;
};

/// The whole content of a file. Throws Error(kNotFound | kIo, path); kLimit if it is larger than `max_bytes`.
std::string read_text_file(const std::string& path, std::size_t max_bytes = std::size_t{1} << 30);

}  // namespace nacre
