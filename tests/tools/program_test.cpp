// label: cli
// The program as a user runs it: bake, render, compare; invariants between runs.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "nacre/base/simd.h"
#include "nacre/render/image_file.h"
#include "tools/cli.h"

namespace nacre {
namespace {

using testing_support::kSmallScene;
using testing_support::read_file;
using testing_support::run_nacre;
using testing_support::TemporaryFolder;

class Program : public testing::Test {
 protected:
  void SetUp() override { folder_.write("s.xml", kSmallScene); }
  std::string run(const std::string& arguments, int expected = 0) {
    const auto result = run_nacre(folder_, arguments);
    EXPECT_EQ(result.exit_code, expected) << arguments << "\n" << result.output;
    return result.output;
  }
  Image image(const std::string& name) { return load_exr(folder_.file(name)); }
  // Light layers of two pictures are bit-identical.
  void expect_identical(const std::string& a, const std::string& b) {
    const std::string output = run("diff " + a + " " + b + " --fail-above 0");
    EXPECT_EQ(output.find("RMSE"), std::string::npos) << output;
    EXPECT_NE(output.find("diffusion  identical"), std::string::npos) << output;
    EXPECT_NE(output.find("surface    identical"), std::string::npos) << output;
  }
  TemporaryFolder folder_;
};

TEST_F(Program, SaysItsVersion) { EXPECT_EQ(run("--version").rfind("nacre ", 0), 0u); }

TEST_F(Program, BakesAndRenders) {
  run("bake s.xml -o c.nacre --report bake.json");
  run("render s.xml --cache c.nacre -o a.exr --png --report render.json");
  const Image a = image("a.exr");
  EXPECT_EQ(a.width, 64);
  EXPECT_EQ(a.height, 48);
  const Channel* diffusion = find_channel(a, "diffusion.R");
  ASSERT_NE(diffusion, nullptr);
  double sum = 0;
  for (const float v : diffusion->values) sum += v;
  EXPECT_GT(sum, 0);
  EXPECT_EQ(a.metadata.at("nacre:seed"), "0");
  EXPECT_EQ(a.metadata.at("nacre:fingerprint").size(), 32u);
  EXPECT_TRUE(std::filesystem::exists(folder_.file("a.png")));

  const auto bake = nlohmann::json::parse(read_file(folder_.file("bake.json")));
  const auto render = nlohmann::json::parse(read_file(folder_.file("render.json")));
  EXPECT_GT(bake["counts"]["points"].get<int>(), 500);
  EXPECT_EQ(render["counts"]["pixels"].get<int>(), 64 * 48);
  for (const auto& report : {bake, render}) {
    double stages = 0;
    for (const auto& [name, seconds] : report["seconds"].items())
      if (name != "total") stages += seconds.get<double>();
    const double total = report["seconds"]["total"].get<double>();
    EXPECT_NEAR(stages, total, 0.05 * total + 0.01);
  }
}

TEST_F(Program, BeautyIsTheSumOfItsLayers) {
  run("render s.xml -o a.exr");
  const Image a = image("a.exr");
  for (const std::string k : {"R", "G", "B"}) {
    const auto& beauty = find_channel(a, k)->values;
    for (std::size_t i = 0; i < beauty.size(); ++i) {
      const float sum =
          find_channel(a, "diffusion." + k)->values[i] + find_channel(a, "single." + k)->values[i] +
          find_channel(a, "specular." + k)->values[i] + find_channel(a, "surface." + k)->values[i];
      ASSERT_EQ(beauty[i], sum) << k << i;
    }
  }
}

TEST_F(Program, SingleScatteringAndMethodsHaveTheirOptions) {
  run("bake s.xml -o s.cache");
  run("render s.xml --cache s.cache --single-samples 0 -o none.exr");
  run("render s.xml --cache s.cache --single-samples 1 -o one.exr");
  run("render s.xml --cache s.cache --single-samples 64 -o many.exr");
  const auto sum = [&](const std::string& file, const std::string& layer) {
    const Image a = image(file);
    double total = 0;
    for (const char* k : {"R", "G", "B"})
      for (const float v : find_channel(a, layer + k)->values) total += static_cast<double>(v);
    return total;
  };
  EXPECT_EQ(sum("none.exr", "single."), 0);
  EXPECT_GT(sum("many.exr", "single."), 0);
  EXPECT_NEAR(sum("one.exr", "single.") / sum("many.exr", "single."), 1, 0.05);
  EXPECT_EQ(sum("none.exr", "diffusion."), sum("many.exr", "diffusion."));

  run("render s.xml --method montecarlo --mc-samples 64 -o mc.exr");
  run("render s.xml --method montecarlo --mc-samples 64 --mc-sampling uniform -o area.exr");
  run("render s.xml --method lambert -o lambert.exr");
  EXPECT_NEAR(sum("mc.exr", "diffusion.") / sum("none.exr", "diffusion."), 1, 0.03);
  EXPECT_NEAR(sum("area.exr", "diffusion.") / sum("none.exr", "diffusion."), 1, 0.05);
  EXPECT_EQ(sum("lambert.exr", "single."), 0);
  EXPECT_GT(sum("lambert.exr", "diffusion."), 0);
}

TEST_F(Program, OptionsWithNothingToActOnAreRefused) {
  run("bake s.xml -o s.cache");
  for (const char* options :
       {"--method montecarlo --cache s.cache", "--method lambert --spacing 1", "--mc-samples 4",
        "--mc-sampling uniform", "--method exact --tolerance 0.1", "--method exact --verify 9",
        "--method exact --certified", "--method lambert --exitance e", "--certified --exitance e",
        "--simd mmx", "--method montecarlo --interreflect", "--method lambert --single-samples 2",
        "--cache s.cache --interreflect"})
    EXPECT_EQ(run_nacre(folder_, std::string("render s.xml -o x.exr ") + options).exit_code, 2) << options;
  EXPECT_FALSE(std::filesystem::exists(folder_.file("x.exr")));
}

// What one command has evaluated is there for the next, for another camera, too; the pictures are the same.
TEST_F(Program, ExitanceIsKept) {
  run("bake s.xml -o s.cache");
  run("render s.xml --cache s.cache -o plain.exr --size 24x24");
  run("render s.xml --cache s.cache -o part.exr --size 24x24 --crop 0,0,12x24 --exitance e.exitance");
  run("render s.xml --cache s.cache -o first.exr --size 24x24 --exitance e.exitance");
  const std::string kept = read_file(folder_.file("e.exitance"));
  run("render s.xml --cache s.cache -o second.exr --size 24x24 --exitance e.exitance --report r.json");
  EXPECT_EQ(read_file(folder_.file("e.exitance")), kept);
  EXPECT_EQ(nlohmann::json::parse(read_file(folder_.file("r.json")))["counts"]["kernel_evaluations"], 0);
  expect_identical("plain.exr", "first.exr");
  expect_identical("plain.exr", "second.exr");
  // Another camera starts from it, and adds what it needs.
  run("render s.xml --cache s.cache -o other.exr --camera other");
  run("render s.xml --cache s.cache -o kept.exr --camera other --exitance e.exitance");
  expect_identical("other.exr", "kept.exr");
  EXPECT_NE(run("render s.xml --cache s.cache -o x.exr --exitance plain.exr", 1).find("plain.exr"),
            std::string::npos);
  EXPECT_NE(run("render s.xml --cache s.cache -o new.exr --exitance ./new.exr", 2).find("new.exr"),
            std::string::npos);
  EXPECT_NE(run("render s.xml --cache s.cache -o x.exr --exitance e.exitance --tolerance 0", 2)
                .find("--tolerance 0"),
            std::string::npos);
  const auto refused =
      run_nacre(folder_, "render s.xml --cache s.cache -o x.exr --exitance e.exitance -D sigma_a=0.2");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.output.find("sigma_a"), std::string::npos) << refused.output;
  // Other instructions round in other ways: no mixture of both.
  const std::string other =
      run("render s.xml --cache s.cache -o x.exr --exitance e.exitance --simd scalar", 1);
  EXPECT_NE(other.find("--simd"), std::string::npos) << other;
  const auto info = run_nacre(folder_, "info e.exitance");
  EXPECT_EQ(info.exit_code, 0) << info.output;
}

TEST_F(Program, CertifiedPicturesAreNearerThanTheToleranceEverywhere) {
  run("bake s.xml -o s.cache");
  run("render s.xml --cache s.cache -o exact.exr --method exact --single-samples 0");
  run("render s.xml --cache s.cache -o bound.exr --certified --tolerance 0.05 --single-samples 0");
  const Image exact = image("exact.exr"), bound = image("bound.exr");
  for (const char* k : {"diffusion.R", "diffusion.G", "diffusion.B"}) {
    const auto &a = find_channel(exact, k)->values, &b = find_channel(bound, k)->values;
    for (std::size_t i = 0; i < a.size(); ++i) ASSERT_LE(std::abs(a[i] - b[i]), 0.05f * a[i]) << k << i;
  }
}

// Without shadows the cache and the picture have to agree about that.
TEST_F(Program, ShadowsAreOneChoiceForBakeAndRender) {
  run("bake s.xml --no-shadows -o s.cache");
  const auto refused = run_nacre(folder_, "render s.xml --cache s.cache -o x.exr");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.output.find("shadows"), std::string::npos) << refused.output;
  run("render s.xml --cache s.cache --no-shadows -o x.exr");
}

// The coefficients count in a cache that holds light between translucent objects, and in no other.
TEST_F(Program, InterreflectionBindsTheCacheToItsMaterials) {
  run("bake s.xml -o free.cache");
  run("bake s.xml --interreflect -o bound.cache");
  run("render s.xml --cache free.cache -D sigma_a=0.2 -o a.exr");
  run("render s.xml --cache bound.cache -o b.exr");
  const auto refused = run_nacre(folder_, "render s.xml --cache bound.cache -D sigma_a=0.2 -o x.exr");
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_NE(refused.output.find("coefficients"), std::string::npos) << refused.output;
}

TEST_F(Program, BakedInMemoryOrBeforeIsTheSame) {
  run("render s.xml -o a.exr --seed 3");
  run("bake s.xml -o c.nacre --seed 3");
  run("render s.xml --cache c.nacre -o b.exr --seed 3");
  expect_identical("a.exr", "b.exr");
}

TEST_F(Program, ThreadsDoNotMatter) {
  run("bake s.xml -o c1.nacre --threads 1");
  run("bake s.xml -o c2.nacre --threads 2");
  EXPECT_EQ(read_file(folder_.file("c1.nacre")), read_file(folder_.file("c2.nacre")));
  run("render s.xml --cache c1.nacre -o a.exr --threads 1");
  run("render s.xml --cache c2.nacre -o b.exr --threads 2");
  expect_identical("a.exr", "b.exr");
}

// Sums are rounded differently by instructions that multiply and add at once, and a node more or less may be
// taken as one; nothing else is.
TEST_F(Program, VectorInstructionsMatterToRoundingAlone) {
  run("bake s.xml -o c.nacre --irradiance-samples 2 --simd scalar");
  run("render s.xml --cache c.nacre -o scalar.exr --spp 1 --simd scalar");
  for (const std::string& target : simd_targets()) {
    run("bake s.xml -o other.nacre --irradiance-samples 2 --simd " + target);
    EXPECT_TRUE(read_file(folder_.file("c.nacre")) == read_file(folder_.file("other.nacre"))) << target;
    run("render s.xml --cache c.nacre -o other.exr --spp 1 --simd " + target);
    for (const char* const layer : {"single", "specular", "surface"})
      EXPECT_NE(run(std::string("diff other.exr scalar.exr --layer ") + layer).find("identical"),
                std::string::npos)
          << target << " " << layer;
    run("diff other.exr scalar.exr --layer diffusion --fail-above 0.00005");
  }
}

TEST_F(Program, ACropIsAPartOfTheWhole) {
  run("bake s.xml -o c.nacre");
  run("render s.xml --cache c.nacre -o whole.exr");
  run("render s.xml --cache c.nacre -o crop.exr --crop 20,11,25x17");
  const Image whole = image("whole.exr"), crop = image("crop.exr");
  EXPECT_EQ(crop.x, 20);
  EXPECT_EQ(crop.full_width, 64);
  for (const Channel& channel : crop.channels) {
    const Channel* full = find_channel(whole, channel.name);
    ASSERT_NE(full, nullptr);
    for (int y = 0; y < 17; ++y)
      for (int x = 0; x < 25; ++x)
        ASSERT_EQ(channel.values[static_cast<std::size_t>(y * 25 + x)],
                  full->values[static_cast<std::size_t>((y + 11) * 64 + x + 20)])
            << channel.name;
  }
}

TEST_F(Program, SeedsMatter) {
  run("render s.xml -o a.exr --seed 1");
  run("render s.xml -o b.exr --seed 2");
  run("diff a.exr b.exr --fail-above 0", 1);
}

TEST_F(Program, ANewMaterialUsesTheOldCache) {
  run("bake s.xml -o c.nacre");
  run("render s.xml --cache c.nacre -o a.exr");
  run("render s.xml --cache c.nacre -o b.exr -D sigma_a=0.3");
  run("diff a.exr b.exr --layer diffusion --fail-above 0.01", 1);
}

TEST_F(Program, AMovedLightIsRefusedByName) {
  run("bake s.xml -o c.nacre");
  const std::string output = run("render s.xml --cache c.nacre -o b.exr -D light_x=21", 1);
  EXPECT_NE(output.find("light spark/position was 20 30 10 and is 21 30 10"), std::string::npos) << output;
  EXPECT_FALSE(std::filesystem::exists(folder_.file("b.exr")));
}

TEST_F(Program, ShadowsArePartOfTheCache) {
  run("bake s.xml -o c.nacre --no-shadows");
  EXPECT_NE(run("render s.xml --cache c.nacre -o a.exr", 1).find("shadows was no and is yes"),
            std::string::npos);
  run("render s.xml --cache c.nacre -o a.exr --no-shadows");
}

TEST_F(Program, HierarchicalMeetsItsTolerance) {
  run("bake s.xml -o c.nacre");
  run("render s.xml --cache c.nacre -o exact.exr --method exact");
  run("render s.xml --cache c.nacre -o fast.exr");
  run("render s.xml --cache c.nacre -o zero.exr --tolerance 0");
  run("diff fast.exr exact.exr --layer diffusion --fail-above 0.01");
  expect_identical("zero.exr", "exact.exr");
}

TEST_F(Program, VerifyMeasuresTheErrorOfThePicture) {
  const auto measured = [&](const std::string& options) {
    const std::string output = run("render s.xml -o v.exr --single-samples 0 --verify 500 " + options);
    int points = 0;
    double rmse = -1, largest = -1;
    EXPECT_EQ(std::sscanf(output.substr(output.find("diffusion at ")).c_str(),
                          "diffusion at %d points: relative RMSE %lf %%, largest error %lf %%", &points,
                          &rmse, &largest),
              3)
        << output;
    EXPECT_EQ(points, 500);
    EXPECT_LE(rmse, largest);
    return rmse;
  };
  const double loose = measured("--tolerance 0.1");
  EXPECT_GT(loose, 0);
  EXPECT_LE(loose, 10);
  EXPECT_LE(measured("--tolerance 0.001"), 0.1);
  EXPECT_EQ(measured("--tolerance 0"), 0);
  // One line for each camera, and none where nothing was measured.
  const std::string both = run("render s.xml -o v.exr --camera main,other --verify 20");
  EXPECT_NE(both.find("main: diffusion at 20 points"), std::string::npos) << both;
  EXPECT_NE(both.find("other: diffusion at 20 points"), std::string::npos) << both;
  const std::string none = run("render s.xml -o v.exr --crop 0,0,1x1 --verify 20 --report v.json");
  EXPECT_NE(none.find("--verify: no pixel"), std::string::npos) << none;
  EXPECT_NE(read_file(folder_.file("v.json")).find("\"verified\": \"0 points: no pixel"), std::string::npos);
}

// What was evaluated for one picture serves the next, and changes nothing in it.
TEST_F(Program, CamerasTogetherAreAsAlone) {
  run("bake s.xml -o c.nacre");
  run("render s.xml --cache c.nacre -o alone.exr --camera other");
  run("render s.xml --cache c.nacre -o many.exr --camera main,other");
  expect_identical("many.other.exr", "alone.exr");
}

TEST_F(Program, OtherCamerasAndSizes) {
  run("render s.xml -o a.exr --camera other");
  EXPECT_EQ(image("a.exr").width, 32);
  run("render s.xml -o b.exr --size 40x20 --spp 1 --aov none");
  EXPECT_EQ(image("b.exr").width, 40);
  EXPECT_EQ(image("b.exr").channels.size(), 4u);
  EXPECT_NE(run("render s.xml -o c.exr --camera third", 1).find("other"), std::string::npos);
}

// One run for several cameras gives what one run each would, and its stages still add up.
TEST_F(Program, SeveralCamerasAtOnce) {
  run("bake s.xml -o c.nacre");
  run("render s.xml --cache c.nacre -o a.exr --camera main,other --png --report r.json");
  EXPECT_FALSE(std::filesystem::exists(folder_.file("a.exr")));
  EXPECT_TRUE(std::filesystem::exists(folder_.file("a.main.png")));
  EXPECT_TRUE(std::filesystem::exists(folder_.file("a.other.png")));
  run("render s.xml --cache c.nacre -o b.exr --camera other");
  expect_identical("a.other.exr", "b.exr");
  run("render s.xml --cache c.nacre -o b.exr --camera main");
  expect_identical("a.main.exr", "b.exr");
  const auto report = nlohmann::json::parse(testing_support::read_file(folder_.file("r.json")));
  EXPECT_EQ(report["counts"]["pixels"], 64 * 48 + 32 * 32);
  for (const auto& [stage, seconds] : report["seconds"].items()) EXPECT_GE(seconds, 0) << stage;

  run("render --camera other --camera main s.xml --cache c.nacre -o d.exr --spp 1");
  EXPECT_EQ(image("d.main.exr").width, 64);
  run("render s.xml --cache c.nacre -o e.exr --camera main,third", 1);
  EXPECT_FALSE(std::filesystem::exists(folder_.file("e.main.exr")));
  EXPECT_NE(
      run("render s.xml -o e.exr --camera main,main", 2).find("two pictures would be written to e.main.exr"),
      std::string::npos);
}

TEST_F(Program, InfoOnEverything) {
  run("bake s.xml -o c.nacre");
  run("render s.xml --cache c.nacre -o a.exr");
  const std::string scene = run("info s.xml");
  EXPECT_NE(scene.find("size 10 10 10 mm"), std::string::npos) << scene;
  EXPECT_NE(scene.find("l'"), std::string::npos);
  const std::string cache = run("info c.nacre --check");
  EXPECT_NE(cache.find("cache c.nacre: format version 2, sound"), std::string::npos) << cache;
  EXPECT_NE(cache.find("shares add up to 1.0000"), std::string::npos) << cache;
  EXPECT_NE(run("info a.exr").find("diffusion.R"), std::string::npos);
  EXPECT_NE(run("materials").find("Spectralon"), std::string::npos);
  const std::string found = run("materials --from-albedo 0.9,0.5,0.05 --mfp 2 --profile betterdipole");
  EXPECT_NE(found.find("0.90000  0.50000  0.05000"), std::string::npos) << found;
  EXPECT_NE(run("materials --from-albedo 1.1 --mfp 1", 2).find("from 0 to 1"), std::string::npos);
}

TEST_F(Program, AMeshFileIsAScene) {
  folder_.write("block.obj",
                "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nv 0 0 2\nv 2 0 2\nv 2 3 2\nv 0 3 2\n"
                "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\n");
  run("render block.obj --material marble --height 20 -o a.exr --png --size 48x48 --spp 2");
  const Image a = image("a.exr");
  double sum = 0;
  for (const float v : find_channel(a, "diffusion.G")->values) sum += v;
  EXPECT_GT(sum, 0);
  EXPECT_NE(run("render block.obj --material marbel -o b.exr", 1).find("Marble"), std::string::npos);
}

TEST_F(Program, QuietMeansQuiet) { EXPECT_EQ(run("render s.xml -o a.exr --quiet --spp 1"), ""); }

}  // namespace
}  // namespace nacre
