// Files that are there whole or not at all, and files that are read where they lie.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "nacre/base/error.h"

namespace nacre {

/// A file being written that has no name, or a temporary one beside its final one, until commit() syncs and
/// renames it; without commit() it goes away, so that an error or an exception leaves nothing behind. A
/// symbolic link stays one: what it points to is replaced. A device such as /dev/null is written to as it is.
class AtomicFile {
 public:
  /// Opens a file without a name in the folder of `path`, which not even SIGKILL leaves behind, or
  /// `path`.tmp-<pid>-<n> where the file system has none such; removes such files that a killed process has
  /// left, which hold no lock. Throws Error(kIo, path) if the folder is missing or not writable, or `path` is
  /// a folder, a pipe or a socket.
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Writes all bytes. Throws Error(kIo, path) with the system's reason (disk full, ...).
  void write(const void* data, std::size_t bytes);
  /// Writing goes on `position` bytes from the beginning. Throws Error(kIo, path).
  void seek(std::uint64_t position);
  /// Syncs, closes, renames over `path` and syncs the folder. Throws Error(kIo, path); Error(kMismatch) if a
  /// MappedFile has changed since it was opened, as then nobody knows what was computed from it.
  void commit();

 private:
  struct Temporary;
  template <class Make>
  int make_temporary(const Make& make);

  std::string path_, target_;
  std::unique_ptr<Temporary> temporary_;  // none: a device, or without a name
  bool device_ = false;
  int descriptor_ = -1;
};

/// A file mapped for reading. Whoever replaces such a file should do so by renaming, as AtomicFile does: who
/// holds it keeps the old one then.
class MappedFile {
 public:
  /// `name` says what it is in messages. Throws Error(kNotFound | kIo, path); kNotACache if it is no regular
  /// file.
  MappedFile(const std::string& path, const char* name);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::span<const unsigned char> bytes() const noexcept { return bytes_; }
  /// Throws Error(kMismatch, path) if any file that is mapped now was written to since it was opened.
  static void check_unchanged();

 private:
  struct State;

  std::unique_ptr<State> state_;
  std::span<const unsigned char> bytes_;
};

/// The whole content of a file. Throws Error(kNotFound | kIo, path); kLimit if it is larger than `max_bytes`.
std::string read_text_file(const std::string& path, std::size_t max_bytes = std::size_t{1} << 30);

}  // namespace nacre
