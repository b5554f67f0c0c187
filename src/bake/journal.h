// What a bake has computed so far, kept in a file so that an interrupted one goes on where it was.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "nacre/base/report.h"

namespace nacre {

/// An append-only file of checksummed records for one bake, known by a key. Whatever stops a bake, the
/// records that reached the file are there for the next one of that key; a record that is cut off or damaged
/// ends what is read. Safe to use from several threads.
class Journal {
 public:
  /// Opens `path` if it is there; a file of another key is emptied when the first record is written. New
  /// files are made, and records written, once `after` seconds have gone by: a short bake leaves no trace. An
  /// empty path keeps nothing. Throws Error(kIo, path) if another process has it open, Error(kValue, path) if
  /// it is no journal.
  Journal(std::string path, const std::string& key, double after);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Which numbers: the pass of the bake and the first sample.
  struct Place {
    std::uint64_t pass, begin;
    auto operator<=>(const Place&) const = default;
  };
  /// Whether the file that was found is of another key.
  bool found_other() const noexcept { return found_other_; }
  /// Number of records that were found.
  std::size_t found() const noexcept { return records_.size(); }
  /// Copies a record into `parts`, one after the other; false if there is none of that size.
  bool restore(const Place& place, std::span<const std::span<std::byte>> parts) const;
  /// Appends a record. Once the disk is full or fails, nothing more is written.
  void keep(const Place& place, std::span<const std::span<const std::byte>> parts);

 private:
  struct Record {
    std::uint64_t offset, bytes;
  };
  void open_existing();
  bool create();
  std::uint64_t read_records();
  bool append(std::span<const std::byte> bytes) noexcept;

  std::string path_, key_;
  double after_;
  Stopwatch watch_;
  std::mutex mutex_;
  int descriptor_ = -1;
  bool found_other_ = false;
  bool ready_ = false, failed_ = false;  // whether the file's head is this bake's; whether writing has failed
  std::map<Place, Record> records_;
};

}  // namespace nacre
