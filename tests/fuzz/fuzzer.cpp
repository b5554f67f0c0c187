// One target for libFuzzer. Readers take paths, so each input becomes a file in memory.
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "fuzz/targets.h"
#include "nacre/base/error.h"

namespace {

const nacre::testing_support::FuzzTarget& own_target() {
  for (const auto& target : nacre::testing_support::fuzz_targets())
    if (std::string(target.name) == NACRE_FUZZ_TARGET) return target;
  std::abort();
}

// A folder of its own: nothing beside it that a scene could name.
const std::string& input_path() {
  static const std::string path = [] {
    const std::string folder = "/dev/shm/nacre-fuzz-" + std::to_string(getpid());
    std::filesystem::create_directories(folder);
    std::atexit([] { std::filesystem::remove_all("/dev/shm/nacre-fuzz-" + std::to_string(getpid())); });
    return folder + "/input" + own_target().extension;
  }();
  return path;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const auto& target = own_target();
  std::ofstream(input_path(), std::ios::binary)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    target.read(input_path());
  } catch (const nacre::Error& error) {
    // One line that says where and what.
    const std::string text = error.what();
    if (text.find('\n') != std::string::npos || error.reason().empty()) {
      std::fprintf(stderr, "not one line: %s\n", text.c_str());
      std::abort();
    }
  }
  return 0;
}
