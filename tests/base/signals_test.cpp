// label: unit
// Signals end a program in an orderly way.
#include "nacre/base/signals.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "base/files_in_use.h"
#include "nacre/base/file.h"

namespace nacre {
namespace {

namespace fs = std::filesystem;

class Signals : public testing::Test {
 protected:
  void SetUp() override {
    testing::FLAGS_gtest_death_test_style = "threadsafe";
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  // The same in the process that dies.
  fs::path folder_ = fs::temp_directory_path() / "nacre-signals-test";
  std::string file(const char* name) const { return (folder_ / name).string(); }
};

TEST_F(Signals, TemporaryFilesGo) {
  std::ofstream(file("kept")) << "x";
  for (const int signal : {SIGINT, SIGTERM, SIGHUP})
    EXPECT_EXIT(
        {
          handle_signals();
          const FileInUse first = FileInUse::temporary(file("a"));
          const FileInUse second = FileInUse::temporary(file("b"));
          std::ofstream(file("a")) << "half";
          std::ofstream(file("b")) << "half";
          { const FileInUse done = FileInUse::temporary(file("kept")); }
          ::raise(signal);
        },
        testing::KilledBySignal(signal), "nacre: interrupted by SIG");
  EXPECT_FALSE(fs::exists(file("a")));
  EXPECT_FALSE(fs::exists(file("b")));
  EXPECT_TRUE(fs::exists(file("kept")));
}

TEST_F(Signals, IgnoredOnesStayIgnored) {
  EXPECT_EXIT(
      {
        ::signal(SIGHUP, SIG_IGN);
        handle_signals();
        ::raise(SIGHUP);
        std::_Exit(7);
      },
      testing::ExitedWithCode(7), "");
}

TEST_F(Signals, AMappedFileThatIsCutIsNamed) {
  std::ofstream(file("cut")) << std::string(1 << 16, 'x');
  EXPECT_EXIT(
      {
        handle_signals();
        const MappedFile mapped(file("cut"), "file");
        fs::resize_file(file("cut"), 1);
        volatile const unsigned char* const bytes = mapped.bytes().data();
        std::_Exit(bytes[1 << 15]);
      },
      testing::ExitedWithCode(1), "nacre: error: .*cut: was cut short");
}

TEST_F(Signals, MoreFilesThanTheListHolds) {
  std::vector<FileInUse> files;
  for (int i = 0; i < 1000; ++i) files.push_back(FileInUse::temporary(file("none")));
  files.clear();
  const char byte = 0;
  const FileInUse one = FileInUse::mapping(file("mapped"), &byte, 1);
  EXPECT_STREQ(mapped_at(&byte), file("mapped").c_str());
  EXPECT_EQ(mapped_at(&byte + 1), nullptr);
}

}  // namespace
}  // namespace nacre
