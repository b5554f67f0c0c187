// What a folder of a sweep proves to be complete.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sweep_plan.h"

namespace nacre::tools {

/// A picture of a sweep that is there whole.
struct SweepRecord {
  std::string key;     // of all that the picture depends on
  std::string digest;  // of its OpenEXR file
  double seconds = 0;  // what it took, its share of what was rendered with it
};

/// Files of point `index` (from 0) of a sweep in a folder.
std::string picture_name(std::size_t index);  // "0001"
std::string record_path(const std::string& folder, std::size_t index);

void save_record(const std::string& folder, std::size_t index, const std::vector<Setting>& settings,
                 const SweepRecord& record);
/// While it lives, the folder takes no pictures but those of one sweep, from as many processes as like.
class FolderClaim {
 public:
  /// `sweep` is the same for shards of one, and for no other. Throws Error(kMismatch, folder) if another
  /// sweep is writing there, Error(kIo) if the folder cannot be written to.
  FolderClaim(const std::string& folder, const std::string& sweep);
  ~FolderClaim();
  FolderClaim(const FolderClaim&) = delete;
  FolderClaim& operator=(const FolderClaim&) = delete;

 private:
  int descriptor_;
};

/// The record, if the picture that it speaks of is there, has that key and is byte for byte what was written.
std::optional<SweepRecord> find_complete(const std::string& folder, std::size_t index,
                                         const std::string& key);

}  // namespace nacre::tools
