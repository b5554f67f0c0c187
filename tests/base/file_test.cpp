// label: unit
// Files that are there whole or not at all, and what is not a file.
#include "nacre/base/file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace nacre {
namespace {

namespace fs = std::filesystem;

class AtomicFileTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::path(testing::TempDir()) / "nacre-file-XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }
  static void save(const std::string& to, const std::string& text) {
    AtomicFile file(to);
    file.write(text.data(), text.size());
    file.commit();
  }
  fs::path folder_;
};

TEST_F(AtomicFileTest, AppearsWhenCommitted) {
  {
    AtomicFile file(path("a"));
    file.write("half", 4);
    EXPECT_FALSE(fs::exists(path("a")));
  }
  EXPECT_EQ(entries(), 0u);
  save(path("a"), "first");
  save(path("a"), "second");
  EXPECT_EQ(read_text_file(path("a")), "second");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFileTest, PassesOverWhatIsLeftOfOthers) {
  const auto left = [&](int serial) { return fmt::format("{}.tmp-{}-{}", path("a"), ::getpid(), serial); };
  for (int i = 0; i < 100; ++i) std::ofstream(left(i)) << "left";
  save(path("a"), "new");
  EXPECT_EQ(read_text_file(path("a")), "new");
  for (int i = 0; i < 100; ++i) EXPECT_EQ(read_text_file(left(i)), "left");
  EXPECT_EQ(entries(), 101u);
}

// What is old and locked by nobody is of a process that was killed.
TEST_F(AtomicFileTest, RemovesWhatTheKilledHaveLeft) {
  const std::string left = path("a") + ".tmp-7-0", young = path("a") + ".tmp-7-1",
                    locked = path("a") + ".tmp-7-2", other = path("ab") + ".tmp-7-0",
                    notes = path("a") + ".tmp-notes.txt";
  for (const std::string& name : {left, young, locked, other, notes}) {
    std::ofstream(name) << "left";
    if (name != young) fs::last_write_time(name, fs::file_time_type::clock::now() - std::chrono::hours(1));
  }
  const int descriptor = ::open(locked.c_str(), O_RDWR);
  ASSERT_EQ(::flock(descriptor, LOCK_EX), 0);
  save(path("a"), "new");
  EXPECT_FALSE(fs::exists(left));
  for (const std::string& name : {young, locked, other, notes}) EXPECT_TRUE(fs::exists(name)) << name;
  ::close(descriptor);
  save(path("a"), "newer");
  EXPECT_FALSE(fs::exists(locked));
}

TEST_F(AtomicFileTest, NamesAsLongAsFilesCanHave) {
  const std::string longest = path(std::string(255, 'a')), left = path(std::string(223, 'a')) + ".tmp-7-0";
  std::ofstream(left) << "left";
  fs::last_write_time(left, fs::file_time_type::clock::now() - std::chrono::hours(1));
  save(longest, "first");
  save(longest, "second");
  EXPECT_EQ(read_text_file(longest), "second");
  EXPECT_EQ(entries(), 1u);
}

TEST_F(AtomicFileTest, HasTheModeThatTheUserWants) {
  const mode_t before = ::umask(027);
  save(path("a"), "x");
  ::umask(before);
  EXPECT_EQ(fs::status(path("a")).permissions(), fs::perms{0640});
}

// A file that is replaced by renaming is another one; a file that is written to is not what was computed
// from.
TEST_F(AtomicFileTest, NothingIsMadeOfWhatChanges) {
  save(path("in"), "first");
  {
    const MappedFile in(path("in"), "file");
    save(path("in"), "other");
    EXPECT_NO_THROW(save(path("out"), "made"));
    EXPECT_EQ(in.bytes()[0], 'f');
  }
  {
    const MappedFile in(path("in"), "file");
    std::ofstream(path("in"), std::ios::app) << "more";
    EXPECT_THROW(save(path("out"), "of both"), Error);
  }
  EXPECT_EQ(read_text_file(path("out")), "made");
  EXPECT_NO_THROW(save(path("out"), "made again"));
  EXPECT_EQ(entries(), 2u);
}

TEST_F(AtomicFileTest, SymbolicLinksStay) {
  fs::create_directory(path("real"));
  save(path("real/a"), "old");
  fs::create_symlink("real/a", path("relative"));
  fs::create_symlink(path("relative"), path("chain"));
  fs::create_symlink("real/new", path("dangling"));
  save(path("chain"), "new");
  save(path("dangling"), "made");
  EXPECT_EQ(read_text_file(path("real/a")), "new");
  EXPECT_EQ(read_text_file(path("real/new")), "made");
  for (const char* link : {"relative", "chain", "dangling"}) EXPECT_TRUE(fs::is_symlink(path(link))) << link;
}

TEST_F(AtomicFileTest, LinksInACircleAreRefused) {
  fs::create_symlink("b", path("a"));
  fs::create_symlink("a", path("b"));
  EXPECT_THROW(save(path("a"), "x"), Error);
  EXPECT_TRUE(fs::is_symlink(path("a")));
}

TEST_F(AtomicFileTest, DevicesAreWrittenTo) {
  struct stat before, after;
  ASSERT_EQ(::stat("/dev/null", &before), 0);
  fs::create_symlink("/dev/null", path("null"));
  save(path("null"), "into nothing");
  EXPECT_TRUE(fs::is_symlink(path("null")));
  ASSERT_EQ(::stat("/dev/null", &after), 0);
  EXPECT_TRUE(S_ISCHR(after.st_mode));
  EXPECT_EQ(before.st_ino, after.st_ino);
  fs::create_symlink("/dev/full", path("full"));
  EXPECT_THROW(save(path("full"), "no room"), Error);
  EXPECT_TRUE(fs::is_symlink(path("full")));
}

TEST_F(AtomicFileTest, PipesAndFoldersAreRefused) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_THROW(save(path("pipe"), "x"), Error);
  EXPECT_TRUE(fs::is_fifo(path("pipe")));
  EXPECT_THROW(save(folder_.string(), "x"), Error);
}

}  // namespace
}  // namespace nacre
