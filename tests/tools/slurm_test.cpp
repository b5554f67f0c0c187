// label: cli
// Sweeps as jobs of a real Slurm, whose nodes and jobs fail.
#include <gtest/gtest.h>

#include <algorithm>
#include <future>
#include <nlohmann/json.hpp>

#include "tools/slurm_cluster.h"

namespace nacre {
namespace {

using testing_support::ProgramResult;
using testing_support::read_command;
using testing_support::run_nacre;
using testing_support::SlurmCluster;
using testing_support::TemporaryFolder;
using testing_support::wait_until;

class Slurm : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (SlurmCluster::installed()) cluster_ = std::make_unique<SlurmCluster>();
  }
  static void TearDownTestSuite() { cluster_.reset(); }
  void SetUp() override {
    if (!cluster_) GTEST_SKIP() << "needs slurmctld, slurmd, slurm-client and munge (tools/setup.sh --tests)";
    ASSERT_TRUE(cluster_->up()) << cluster_->log();
    folder_.write("s p.xml", testing_support::kSmallScene);
    run("bake 's p.xml' -o c.nacre --quiet --points 4000");
  }
  std::string run(const std::string& arguments, int expected = 0) {
    const ProgramResult result = run_nacre(folder_, arguments);
    EXPECT_EQ(result.exit_code, expected) << arguments << "\n" << result.output;
    return result.output;
  }
  std::future<ProgramResult> start(const std::string& arguments) {
    return std::async(std::launch::async, [this, arguments] { return run_nacre(folder_, arguments); });
  }
  std::string bytes(const std::string& name) { return testing_support::read_file(folder_.file(name)); }
  // All but the times.
  nlohmann::json manifest(const std::string& folder) {
    nlohmann::json json = nlohmann::json::parse(bytes(folder + "/manifest.json"));
    for (nlohmann::json& picture : json["pictures"]) picture.erase("seconds");
    return json;
  }
  void expect_same_sweep(const std::string& a, const std::string& b, int count) {
    for (int i = 1; i <= count; ++i)
      for (const char* const ending : {".exr", ".png"}) {
        const std::string name = "/000" + std::to_string(i) + ending;
        ASSERT_FALSE(bytes(a + name).empty()) << a + name;
        EXPECT_EQ(bytes(a + name), bytes(b + name)) << name;
      }
    for (const char* const name : {"/contact_sheet.png", "/index.html"})
      EXPECT_EQ(bytes(a + name), bytes(b + name)) << name;
    EXPECT_EQ(manifest(a), manifest(b));
  }
  bool exists(const std::string& name) { return std::filesystem::exists(folder_.file(name)); }

  static std::unique_ptr<SlurmCluster> cluster_;
  TemporaryFolder folder_;
};
std::unique_ptr<SlurmCluster> Slurm::cluster_;

constexpr const char* kSweep = "sweep 's p.xml' --cache c.nacre --vary sigma_a=0.01:9:4:log ";
constexpr const char* kSlow = "--spp 200 ";  // seconds a picture

TEST_F(Slurm, GivesWhatALocalRunGives) {
  run(kSweep +
      std::string("-o 'd%a'\\''s' --simd scalar --engine slurm --shards 3 --slurm-option partition=all "
                  "--slurm-option=--comment='two words'"));
  run(kSweep + std::string("-o e --quiet --simd scalar"));
  expect_same_sweep("d%a's", "e", 4);
  EXPECT_TRUE(exists("d%a's/slurm/merge.log"));
  EXPECT_NE(run(kSweep + std::string("-o 'd%a'\\''s' --simd scalar --engine slurm"))
                .find("0 of 4 pictures to render"),
            std::string::npos);
}

TEST_F(Slurm, SubmitsWhatFailedAgain) {
  auto sweep = start(kSweep + std::string(kSlow) + "-o d --engine slurm --shards 2");
  std::vector<pid_t> jobs;
  EXPECT_TRUE(wait_until([&] { return !(jobs = cluster_->job_processes("n1")).empty(); }, 20));
  for (const pid_t pid : jobs) ::kill(pid, SIGKILL);
  const ProgramResult result = sweep.get();
  EXPECT_EQ(result.exit_code, 0) << result.output;
  EXPECT_NE(result.output.find("submitting them again"), std::string::npos) << result.output;
  run(kSweep + std::string(kSlow) + "-o e --quiet");
  expect_same_sweep("d", "e", 4);
}

TEST_F(Slurm, NamesWhatFailsForGood) {
  std::filesystem::create_directories(folder_.file("d/0003.exr/in the way"));
  std::filesystem::create_directories(folder_.file("d/points"));
  const std::string output =
      run(kSweep + std::string("-o d --engine slurm --shards 4 --retries 1 --quiet"), 1);
  EXPECT_NE(output.find("nacre: error: d: 1 of 4 pictures failed in 2 attempts: 0003; why is in "
                        "d/slurm/shard-3.log\n"),
            std::string::npos)
      << output;
  EXPECT_NE(bytes("d/slurm/shard-3.log").find("0003.exr: cannot write"), std::string::npos);
  EXPECT_FALSE(exists("d/manifest.json"));
  std::filesystem::remove_all(folder_.file("d/0003.exr"));
  EXPECT_NE(run(kSweep + std::string("-o d --engine slurm --shards 4")).find("1 of 4 pictures to render"),
            std::string::npos);
  EXPECT_TRUE(exists("d/manifest.json"));
}

TEST_F(Slurm, CancelsItsJobs) {
  auto sweep = std::async(std::launch::async, [&] {
    return read_command("cd '" + folder_.path().string() + "' && echo $$ > pid && exec '" NACRE_PROGRAM "' " +
                        kSweep + "--spp 65536 -o d --engine slurm --shards 2");
  });
  EXPECT_TRUE(wait_until([] { return cluster_->job_processes("n1").size() == 1; }, 20));
  ::kill(std::atoi(bytes("pid").c_str()), SIGINT);
  const std::string output = sweep.get();
  EXPECT_NE(output.find("nacre: warning: interrupted; Slurm jobs"), std::string::npos) << output;
  EXPECT_NE(output.find("are cancelled"), std::string::npos) << output;
  EXPECT_TRUE(wait_until([] { return read_command("squeue -h").empty(); }, 20)) << read_command("squeue");
}

TEST_F(Slurm, SaysWhatSlurmRefuses) {
  const auto expect_refusal = [&](const std::string& options, int code, const std::string& text) {
    const std::string output = run(kSweep + std::string("-o d ") + options, code);
    EXPECT_NE(output.find(text), std::string::npos) << output;
    EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 1) << output;
  };
  expect_refusal("--engine slurm --quiet --slurm-option partition=gold", 1, "invalid partition");
  for (const char* const option : {"array=1-3", "arr=1-3", "-a1-3", "-o/elsewhere", "dep=1"})
    expect_refusal(std::string("--engine slurm --slurm-option=") + option, 2, "nacre's to set");
  expect_refusal("--engine slurm --shard 1/2", 2, "--shard");
  expect_refusal("--shards 2", 2, "--engine slurm");
  EXPECT_TRUE(read_command("squeue -h").empty());
}

// The last test: a node is gone after it.
TEST_F(Slurm, OutlivesANode) {
  auto sweep = start(kSweep + std::string(kSlow) + "-o d --engine slurm --shards 4");
  EXPECT_TRUE(wait_until([] { return !cluster_->job_processes("n2").empty(); }, 20));
  cluster_->kill_node("n2");
  const ProgramResult result = sweep.get();
  EXPECT_EQ(result.exit_code, 0) << result.output << cluster_->log();
  run(kSweep + std::string(kSlow) + "-o e --quiet");
  expect_same_sweep("d", "e", 4);
}

}  // namespace
}  // namespace nacre
