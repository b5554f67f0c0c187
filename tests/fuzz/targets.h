// What is fuzzed: every reader of files that come from elsewhere.
#pragma once

#include <span>
#include <string>

namespace nacre::testing_support {

struct FuzzTarget {
  const char* name;       // also that of its folder of seeds
  const char* extension;  // of its files, where readers go by that
  /// Reads a file, which it may change. What is wrong with it has to come as Error and nothing else.
  void (*read)(const std::string& path);
};

std::span<const FuzzTarget> fuzz_targets();

}  // namespace nacre::testing_support
