// label: cli
// What a machine can do to a running program: full disks, limits, signals, closed streams, files that change.
#include <gtest/gtest.h>

#include <string>

#include "tools/cli.h"

namespace nacre::testing_support {
namespace {

// Takes long enough for anything to happen meanwhile.
const std::string kLong = "$N render s.xml --cache c.nacre --spp 4096 -o a.exr --quiet";
const std::string kShort = "$N render s.xml --cache c.nacre --spp 1 --single-samples 0 --quiet";

class Faults : public testing::Test {
 protected:
  void SetUp() override {
    folder_.write("s.xml", kSmallScene);
    ASSERT_EQ(run_nacre(folder_, "bake s.xml --irradiance-samples 1 -o c.nacre --quiet").exit_code, 0);
  }
  // Runs lines of bash, in which $N is the program.
  ProgramResult run(const std::string& script) const {
    const TemporaryFolder other;
    return run_shell(folder_, "bash '" + other.write("script.sh", "N='" NACRE_PROGRAM "'\n" + script) + "'");
  }
  // One line of error, exit code 1, and no file that was not there.
  void expect_error(const std::string& script, const std::string& message) const {
    const std::size_t before = folder_.count();
    const ProgramResult result = run(script);
    EXPECT_EQ(result.exit_code, 1) << script << "\n" << result.output;
    EXPECT_EQ(result.output.rfind("nacre: error: ", 0), 0u) << script << "\n" << result.output;
    EXPECT_NE(result.output.find(message), std::string::npos) << script << "\n" << result.output;
    EXPECT_EQ(result.lines(), 1) << script << "\n" << result.output;
    EXPECT_EQ(folder_.count(), before) << script;
  }
  bool same(const std::string& a, const std::string& b) const {
    return read_file(folder_.file(a)) == read_file(folder_.file(b));
  }
  // In a namespace of mounts of its own; false where the machine allows none.
  bool can_mount() const { return run("unshare -rm mount -t tmpfs none . 2>/dev/null").exit_code == 0; }
  static std::string with_mounts(const std::string& script) {
    return "unshare -rm bash -ec 'N=\"" NACRE_PROGRAM "\"; " + script + "'";
  }
  TemporaryFolder folder_;
};

TEST_F(Faults, ALimitOnTheSizeOfFiles) {
  for (const std::string& command :
       {kShort + " --aov all -o a.exr", kShort + " --exitance a.exitance -o /dev/null",
        std::string("$N bake s.xml --points 1000 --irradiance-samples 1 -o a.nacre --quiet"),
        std::string("$N export c.nacre a.ply --quiet")})
    expect_error("ulimit -f 8\n" + command, "File too large");
}

TEST_F(Faults, AFullDisk) {
  expect_error(kShort + " -o /dev/full", "/dev/full: cannot write: No space left on device");
  if (!can_mount()) GTEST_SKIP() << "this machine lets nobody mount";
  std::filesystem::create_directory(folder_.file("disk"));
  const std::string mount = "mount -t tmpfs -o size=64k none disk; ";
  for (const std::string& command :
       {std::string("$N bake s.xml --points 2000 --irradiance-samples 1 -o disk/a.nacre --quiet"),
        kShort + " --aov all -o disk/a.exr"})
    expect_error(with_mounts(mount + "set +e; " + command + "; code=$?; ls -A disk; exit $code"),
                 "No space left on device");
  expect_error(with_mounts("mount -t tmpfs -o ro none disk; " + kShort + " -o disk/a.exr"),
               "disk/a.exr: cannot write: Read-only file system");
}

// What had been there stays as it was.
TEST_F(Faults, AFailedWriteLeavesTheOldFile) {
  ASSERT_EQ(run(kShort + " -o a.exr").exit_code, 0);
  const std::string before = read_file(folder_.file("a.exr"));
  expect_error("ulimit -f 8\n" + kShort + " --aov all -o a.exr", "a.exr: cannot write: File too large");
  EXPECT_TRUE(read_file(folder_.file("a.exr")) == before);
}

// A system that has no files without a name.
TEST_F(Faults, WithoutProc) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "the sanitizer lives by /proc";
#endif
  if (!can_mount()) GTEST_SKIP() << "this machine lets nobody mount";
  ASSERT_EQ(run(kShort + " -o a.exr; mv a.exr b.exr").exit_code, 0);
  const std::size_t before = folder_.count();
  const ProgramResult result = run(with_mounts("mount -t tmpfs none /proc; " + kShort + " -o a.exr"));
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_EQ(folder_.count(), before + 1);
  EXPECT_TRUE(same("a.exr", "b.exr"));
}

TEST_F(Faults, StandardStreamsThatCannotBeWritten) {
  for (const char* const command : {"info c.nacre", "info c.nacre --check", "materials", "--help"}) {
    expect_error(std::string("$N ") + command + " > /dev/full",
                 "standard output: cannot write: No space left");
    expect_error(std::string("$N ") + command + " >&-", "standard output: cannot write: Bad file descriptor");
    expect_error(std::string("set -o pipefail; { sleep 1; $N ") + command + "; } | true",
                 "standard output: cannot write: Broken pipe");
  }
  // Nothing that is written takes the place of a stream.
  ASSERT_EQ(run(kShort + " -o a.exr; mv a.exr b.exr").exit_code, 0);
  for (const char* const closed : {"<&- 2>&-", "2> /dev/full", "<&-"}) {
    const ProgramResult result = run(kShort + " -o a.exr " + closed + " > /dev/null");
    EXPECT_EQ(result.exit_code, 0) << closed << result.output;
    EXPECT_TRUE(same("a.exr", "b.exr")) << closed;
  }
  EXPECT_EQ(run("$N info none 2>&-").exit_code, 1);
}

TEST_F(Faults, SignalsEndInOneLineAndLeaveNothing) {
  const std::size_t before = folder_.count();
  for (const auto& [name, number] : {std::pair{"INT", 2}, std::pair{"TERM", 15}, std::pair{"HUP", 1}}) {
    // A shell has SIGINT ignored by what it starts in the background. SigCgt: signals that are caught by now.
    const ProgramResult result =
        run("env --default-signal " + kLong +
            " & for i in {1..1000}; do (( 0x$(awk '/SigCgt/ {print $2}' /proc/$!/status) & 1 )) && break; "
            "sleep 0.02; done; sleep 1; kill -" +
            name + " $!; wait $! 2>/dev/null; exit $?");
    EXPECT_EQ(result.exit_code, 128 + number) << result.output;
    EXPECT_NE(result.output.find(std::string("nacre: interrupted by SIG") + name), std::string::npos)
        << result.output;
    EXPECT_EQ(folder_.count(), before);
  }
  EXPECT_EQ(run(kLong + " & sleep 1; kill -KILL $!; wait $! 2>/dev/null; exit $?").exit_code, 137);
  EXPECT_EQ(folder_.count(), before);
}

TEST_F(Faults, ACacheThatChangesWhileItIsRead) {
  const std::string whole = read_file(folder_.file("c.nacre"));
  const auto render = [](const std::string& change) {
    return "$N render s.xml --cache c.nacre --spp 64 -o a.exr --quiet & "
           "for i in {1..500}; do grep -q c.nacre /proc/$!/maps && break; sleep 0.02; done; " +
           change + "; wait $!";
  };
  expect_error(render(": > c.nacre"), "c.nacre: was ");
  folder_.write("c.nacre", whole);
  expect_error(render("echo >> c.nacre"), "c.nacre: was written to while it was read");
  folder_.write("c.nacre", whole);
  // Removed or replaced by renaming, it stays what it was for those who read it.
  EXPECT_EQ(run(render("rm c.nacre")).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists(folder_.file("a.exr")));
}

TEST_F(Faults, TooLittleMemory) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers need all addresses";
#endif
  int failed = 0;
  for (int megabytes = 80; megabytes <= 400; megabytes += 80)
    for (const std::string& command :
         {std::string("$N bake s.xml --points 100000 --irradiance-samples 1 --quiet -o a.nacre"),
          kShort + " --size 4000x4000 -o a.exr"}) {
      const ProgramResult result = run("ulimit -v " + std::to_string(megabytes * 1000) + "\n" + command);
      failed += result.exit_code == 1;
      EXPECT_TRUE(result.exit_code == 0 || result.exit_code == 1) << result.exit_code << result.output;
      EXPECT_EQ(result.lines(), result.exit_code) << megabytes << result.output;
      EXPECT_EQ(folder_.count(), 2u + std::filesystem::exists(folder_.file("a.nacre")));
    }
  EXPECT_GT(failed, 5);
}

TEST_F(Faults, TooLittleStack) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers need more";
#endif
  expect_error("ulimit -s 256\n" + kShort + " -o a.exr", "stacks are limited to 256 kB; nacre wants 1024");
  EXPECT_EQ(run("ulimit -s 1024\n" + kShort + " -o a.exr").exit_code, 0);
}

// Whoever is last wins, whole.
TEST_F(Faults, SeveralProcessesThatWriteOneFile) {
  const auto render = [](int seed, const std::string& name) {
    return "$N render s.xml --cache c.nacre --spp 1 --quiet --seed " + std::to_string(seed) + " -o " + name;
  };
  std::string together;
  for (int seed = 0; seed < 4; ++seed) {
    const std::string alone = "alone" + std::to_string(seed) + ".exr";
    ASSERT_EQ(run(render(seed, "a.exr") + "; mv a.exr " + alone).exit_code, 0);
    together += render(seed, "a.exr") + " &\n";
  }
  const std::size_t before = folder_.count();
  for (int attempt = 0; attempt < 5; ++attempt) {
    ASSERT_EQ(run(together + "wait").output, "");
    bool is_one = false;
    for (int seed = 0; seed < 4; ++seed)
      is_one = is_one || same("a.exr", "alone" + std::to_string(seed) + ".exr");
    EXPECT_TRUE(is_one);
    EXPECT_EQ(folder_.count(), before + 1);
  }
}

}  // namespace
}  // namespace nacre::testing_support
