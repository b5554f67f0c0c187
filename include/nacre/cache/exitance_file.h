// Exitance that was evaluated for one picture, kept for the next command. Format: src/cache/FORMAT.md.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "nacre/cache/cache.h"

namespace nacre {

inline constexpr std::uint32_t kExitanceVersion = 1;

/// The nodes of one medium's ExitanceField. `key` names what the values depend on; an empty one stands for a
/// medium of which nothing is kept.
struct KeptExitance {
  KeyValues key;
  std::vector<std::uint8_t> filled;  // by block: 1 if its nodes are evaluated
  std::vector<Rgb> values;           // M_o by node, 0 where it is not
  bool operator==(const KeptExitance&) const = default;
};

/// Reads and checks a file, one entry for each medium. Throws Error like load_cache.
std::vector<KeptExitance> load_exitance(const std::string& path);

/// Adds to a file, or makes it: values that others have put there since it was read are kept, by reading it
/// again under a lock. `block_of` gives the block of a node of a medium. It appears under its name only when
/// complete. Throws Error(kIo | kMismatch, path) and what load_exitance throws.
void extend_exitance(const std::string& path, std::vector<KeptExitance> exitance,
                     const std::vector<std::vector<std::uint32_t>>& block_of);

/// Throws Error(kMismatch, path) saying what differs if a file was made for other keys.
void check_exitance_keys(const std::string& path, const std::vector<KeptExitance>& file,
                         const std::vector<KeptExitance>& own);

bool is_exitance_file(const std::string& path);

}  // namespace nacre
