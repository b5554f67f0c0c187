// label: cli
// What `cmake --install` puts down is complete: the program runs, and a project of its own builds on it.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <cstdio>
#include <filesystem>

#include "nacre/base/version.h"

namespace {

class Install : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "nacre_install_XXXXXX";
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string folder_;
};

// Runs a shell command and returns what it printed; fails the test unless it exits with 0.
std::string run(const std::string& command) {
  FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  if (!pipe) {
    ADD_FAILURE() << "cannot run " << command;
    return "";
  }
  std::string output;
  char buffer[4096];
  while (const std::size_t got = std::fread(buffer, 1, sizeof buffer, pipe)) output.append(buffer, got);
  EXPECT_EQ(::pclose(pipe), 0) << command << "\n" << output;
  return output;
}

// One word of a shell command.
std::string word(const std::string& path) { return "'" + path + "'"; }

TEST_F(Install, AConsumerBuildsAndRuns) {
  const std::string cmake = word(NACRE_CMAKE), prefix = folder_ + "/prefix", build = folder_ + "/build";
  run(cmake + " --install " + word(NACRE_BINARY_DIR) + " --prefix " + word(prefix));
  EXPECT_EQ(run(word(prefix + "/bin/nacre") + " --version"), std::string("nacre ") + nacre::kVersion + "\n");

  run(cmake + " -G Ninja -S " + word(NACRE_SOURCE_DIR "/tests/tools/consumer") + " -B " + word(build) +
      " -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_FLAGS=" + word(NACRE_CXX_FLAGS) +
      " -DCMAKE_PREFIX_PATH=" + word(prefix));
  run(cmake + " --build " + word(build));
  EXPECT_EQ(run(word(build + "/consumer") + " " + word(folder_ + "/one.exr")),
            std::string("nacre ") + nacre::kVersion + ", marble 1.50\n");
}

// An installed package that points into its build breaks as soon as that is gone.
TEST_F(Install, NoInstalledFileNamesTheBuild) {
  run(word(NACRE_CMAKE) + " --install " + word(NACRE_BINARY_DIR) + " --prefix " + word(folder_));
  EXPECT_EQ(
      run("grep -rIlF -e " + word(NACRE_SOURCE_DIR "/include") + " -e " + word(NACRE_SOURCE_DIR "/src") +
          " -e " + word(NACRE_BINARY_DIR "/") + " " + word(folder_) + " || true"),
      "");
}

}  // namespace
