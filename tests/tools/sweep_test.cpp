// label: cli
// Sweeps: each picture is that of a single render, whatever way it came about.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "nacre/base/file.h"
#include "nacre/render/image_file.h"
#include "tools/cli.h"

namespace nacre {
namespace {

using testing_support::run_nacre;
using testing_support::TemporaryFolder;

constexpr const char* kScene = R"(<scene version="0.6.0">
  <default name="a" value="0.01, 0.02, 0.03"/>
  <default name="s" value="1, 1.2, 1.5"/>
  <default name="eta" value="1.5"/>
  <integrator type="direct"/>
  <sensor type="perspective" id="front">
    <float name="fov" value="30"/>
    <transform name="toWorld"><lookat origin="0, -40, 20" target="0, 0, 0" up="0, 0, 1"/></transform>
    <sampler type="ldsampler"><integer name="sampleCount" value="2"/></sampler>
    <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="36"/></film>
  </sensor>
  <sensor type="perspective" id="side">
    <float name="fov" value="30"/>
    <transform name="toWorld"><lookat origin="40, 0, 20" target="0, 0, 0" up="0, 0, 1"/></transform>
    <sampler type="ldsampler"><integer name="sampleCount" value="2"/></sampler>
    <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="36"/></film>
  </sensor>
  <shape type="sphere" id="ball">
    <float name="radius" value="8"/>
    <subsurface type="dipole" id="wax">
      <rgb name="sigmaS" value="$s"/><rgb name="sigmaA" value="$a"/>
      <float name="intIOR" value="$eta"/><float name="extIOR" value="1"/>
    </subsurface>
  </shape>
  <shape type="rectangle" id="floor">
    <transform name="toWorld"><scale value="40"/><translate z="-8"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.4, 0.3, 0.2"/></bsdf>
  </shape>
  <emitter type="point" id="spark">
    <point name="position" x="20" y="-30" z="10"/><rgb name="intensity" value="3000, 2000, 1000"/>
  </emitter>
  <emitter type="directional" id="sun">
    <vector name="direction" x="1" y="0.5" z="-1"/><rgb name="irradiance" value="1, 1, 1"/></emitter>
</scene>
)";

class Sweep : public testing::Test {
 protected:
  void SetUp() override {
    folder_.write("s.xml", kScene);
    run("bake s.xml -o c.nacre --quiet --per-light --points 4000");
  }
  std::string run(const std::string& arguments, int expected = 0) {
    const auto result = run_nacre(folder_, arguments);
    EXPECT_EQ(result.exit_code, expected) << arguments << "\n" << result.output;
    return result.output;
  }
  void expect_refusal(const std::string& arguments, int code, const std::string& text) {
    const std::string output = run("sweep s.xml --cache c.nacre -o x " + arguments, code);
    EXPECT_NE(output.find(text), std::string::npos) << output;
    EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 1) << output;
  }
  void expect_same(const std::string& a, const std::string& b) {
    const std::string output = run("diff " + a + " " + b + " --fail-above 0");
    EXPECT_NE(output.find("identical"), std::string::npos) << output;
  }
  std::string bytes(const std::string& name) { return read_text_file(folder_.file(name)); }
  nlohmann::json manifest(const std::string& folder) {
    return nlohmann::json::parse(bytes(folder + "/manifest.json"));
  }
  TemporaryFolder folder_;
};

// Sixteen and more of a kind are combinations of fewer.
TEST_F(Sweep, ManyMaterialsAreEachWithinTheTolerance) {
  run("sweep s.xml --cache c.nacre -o d --quiet --vary sigma_a=0.02:0.08:20");
  for (const int index : {0, 7, 12, 19}) {
    run(fmt::format("render s.xml --cache c.nacre -o r.exr --quiet --method exact -D a={:.7g}",
                    0.02 + 0.06 * index / 19));
    run(fmt::format("diff d/{:04}.exr r.exr --layer diffusion --fail-above 0.01", index + 1));
  }
}

// Of one family, with an irradiance and reflections each.
TEST_F(Sweep, IndicesOfRefractionAreEachWithinTheTolerance) {
  run("sweep s.xml --cache c.nacre -o d --quiet --vary eta=1.2:1.6:12 --report report.json");
  const nlohmann::json report = nlohmann::json::parse(bytes("report.json"));
  EXPECT_EQ(report["notes"].size(), 1u) << report;
  EXPECT_EQ(report["counts"]["pixels"], 48 * 36) << "pictures share their rays";
  for (const int index : {0, 5, 11}) {
    run(fmt::format("render s.xml --cache c.nacre -o r.exr --quiet --method exact -D eta={:.7g}",
                    1.2 + 0.4 * index / 11));
    const std::string picture = fmt::format("d/{:04}.exr r.exr", index + 1);
    run("diff " + picture + " --layer diffusion --fail-above 0.01");
    for (const char* layer : {"single", "specular", "surface"})
      run("diff " + picture + " --fail-above 0.001 --layer " + layer);
  }
}

// Under another g with the same sigma_s' light is scattered after quite other distances.
TEST_F(Sweep, SingleScatteringIsNoNoisierThanAlone) {
  run("sweep s.xml --cache c.nacre -o d --quiet --spp 4 --vary 'g=0;0.9'");
  int index = 0;
  for (const char* g : {"0", "0.9"}) {
    const std::string picture = fmt::format("d/000{}.exr", ++index);
    run(fmt::format("sweep s.xml --cache c.nacre -o a --quiet --spp 4 --vary g={}", g));
    const std::string output = run("diff " + picture + " a/0001.exr --layer single --fail-above 0");
    EXPECT_NE(output.find("identical"), std::string::npos) << output;
  }
}

// What an included file says counts as much as what the scene's own does.
TEST_F(Sweep, IncludedFilesCount) {
  const auto write_lamp = [&](const char* sun) {
    folder_.write("lamp.xml", fmt::format(R"(<scene version="0.6.0"><bsdf type="diffuse" id="paint">
      <rgb name="reflectance" value="{}"/></bsdf></scene>)",
                                          sun));
  };
  std::string text = kScene;
  text.replace(text.find("<integrator"), 0, "<include filename=\"lamp.xml\"/>");
  folder_.write("i.xml", text);
  write_lamp("0.1, 0.2, 0.3");
  const std::string sweep = "sweep i.xml --cache c.nacre -o d --vary 'g=0;0.5'";
  EXPECT_NE(run(sweep).find("2 of 2 pictures"), std::string::npos);
  EXPECT_NE(run(sweep).find("0 of 2 pictures"), std::string::npos);
  write_lamp("0.3, 0.2, 0.3");
  EXPECT_NE(run(sweep).find("2 of 2 pictures"), std::string::npos);
}

TEST_F(Sweep, PartsOfDifferentPicturesAreNotMerged) {
  const auto sweep = [&](const std::string& to, const std::string& options) {
    run("sweep s.xml --cache c.nacre --quiet -o " + to + " " + options);
  };
  sweep("a", "--vary 'g=0;0.5' --crop 0,0,20x36");
  sweep("b", "--vary 'g=0;0.5' --crop 20,0,28x36");
  run("merge a/0002.exr b/0002.exr -o m.exr --quiet");
  sweep("c", "--vary 'g=0;0.5'");
  expect_same("m.exr", "c/0002.exr");
  EXPECT_NE(run("merge a/0001.exr b/0002.exr -o x.exr", 1).find("nacre:settings differs"), std::string::npos);
}

// Before anything is rendered, or any folder made.
TEST_F(Sweep, RefusesCachesThatDoNotServeEveryPoint) {
  const auto refused = [&](const std::string& options, const std::string& why) {
    const std::string output = run("sweep s.xml --quiet -o none " + options, 1);
    EXPECT_NE(output.find(why), std::string::npos) << output;
    EXPECT_NE(output.find("picture 0002"), std::string::npos) << output;
    EXPECT_FALSE(std::filesystem::exists(folder_.file("none")));
  };
  folder_.write("p.json", R"([{"g": 0.5}, {"light.sun": 0.5}])");
  run("bake s.xml -o together.nacre --quiet --points 500");
  refused("--cache together.nacre --plan p.json", "--per-light");
  run("bake s.xml -o fixed.nacre --fixed-eta --quiet --points 500");
  refused("--cache fixed.nacre --vary 'eta=1.5;1.3'", "eta was 1.5 and is 1.3");
  run("bake s.xml -o among.nacre --interreflect --quiet --points 500");
  refused("--cache among.nacre --vary 'sigma_a=0.01,0.02,0.03;0.5'", "--interreflect");
}

// In a folder that is none of a sweep, whatever has the name of an output is somebody's.
TEST_F(Sweep, ReplacesNothingButSweeps) {
  const std::string sweep = "sweep s.xml --quiet --vary 'g=0;0.5' ";
  std::filesystem::create_directory(folder_.file("own"));
  std::filesystem::copy_file(folder_.file("c.nacre"), folder_.file("own/manifest.json"));
  run(sweep + "--cache own/manifest.json -o own", 2);
  EXPECT_EQ(bytes("own/manifest.json"), bytes("c.nacre"));
  for (const char* name : {"index.html", "0002.exr", "thesis.txt"}) {
    const std::string folder = std::string("of_") + name;
    std::filesystem::create_directory(folder_.file(folder));
    folder_.write(folder + "/" + name, "mine");
    EXPECT_NE(run(sweep + "--cache c.nacre -o " + folder, 1).find("no folder of a sweep"), std::string::npos);
    EXPECT_EQ(bytes(folder + "/" + name), "mine");
  }
  run(sweep + "--cache c.nacre -o d");
  run(sweep + "--cache c.nacre -o d --report d/manifest.json", 2);
  folder_.write("d/manifest.json", R"([{"g": 0}])");
  run("sweep s.xml --quiet --cache c.nacre -o d --plan d/manifest.json", 2);
  EXPECT_EQ(bytes("d/manifest.json"), R"([{"g": 0}])");
}

TEST_F(Sweep, OptionsThatContradictThePlanAreRefused) {
  expect_refusal("--vary 'camera=front;side' --camera side", 2, "--camera side");
  expect_refusal("--vary 'light.sun=0;1' --light sun=2", 2, "--light sun=2");
  expect_refusal("--vary 'camera=front;side' --medium wax", 2, "--medium wax");
  expect_refusal("--vary sigma_a=1:1.00000001:5", 2, "seven digits");
  expect_refusal("--vary g=0 --shard ''", 2, "--shard");
  EXPECT_NE(run("sweep s.xml --cache c.nacre -o '' --vary g=0", 2).find("--output"), std::string::npos);
}

// To the bit where materials have nothing in common, else within the tolerance of each.
TEST_F(Sweep, EveryPictureIsThatOfASingleRender) {
  run("sweep s.xml --cache c.nacre -o d --quiet --vary sigma_a=0.02:0.08:3 --vary 'eta=1.5;1.3'");
  const char* const absorptions[] = {"0.02", "0.05", "0.08"};
  int index = 0;
  for (const char* a : absorptions)
    for (const char* eta : {"1.5", "1.3"}) {
      const std::string picture = fmt::format("d/{:04}.exr", ++index);
      const auto render = [&](const std::string& options) {
        run("render s.xml --cache c.nacre -o r.exr --quiet -D a=" + std::string(a) + " -D eta=" + eta +
            options);
      };
      render(" --method exact");
      run("diff " + picture + " r.exr --layer diffusion --fail-above 0.01");
      run("diff " + picture + " r.exr --layer specular --fail-above 0");
      render("");
      const std::string alone = fmt::format("e{}", index);
      run(fmt::format("sweep s.xml --cache c.nacre -o {} --quiet --vary sigma_a={} --vary eta={}", alone, a,
                      eta));
      expect_same(alone + "/0001.exr", "r.exr");
    }
  const nlohmann::json json = manifest("d");
  ASSERT_EQ(json["pictures"].size(), 6u);
  EXPECT_EQ(json["pictures"][3]["settings"]["eta"], "1.3");
  EXPECT_NEAR(json["pictures"][3]["coefficients"]["sigma_a"][0].get<double>(), 0.05, 1e-7);
  for (const char* name : {"d/0006.png", "d/contact_sheet.png", "d/index.html"})
    EXPECT_GT(bytes(name).size(), 100u) << name;
}

// Under thumbnails, where they would be cut.
TEST_F(Sweep, LongLabelsGoOnInTheNextLine) {
  run("sweep s.xml --cache c.nacre --quiet --vary material=Marble -o short");
  run("sweep s.xml --cache c.nacre --quiet --vary 'material=Pacific Ocean Surface Water' -o long");
  const auto height = [&](const std::string& folder) {
    const std::string png = bytes(folder + "/contact_sheet.png");
    return 256 * static_cast<int>(static_cast<unsigned char>(png.at(22))) +
           static_cast<unsigned char>(png.at(23));
  };
  EXPECT_EQ(height("long"), height("short") + 12);
}

// Mean free paths too different to share anything: to the bit what single renders are.
TEST_F(Sweep, MultipliesCamerasLightsAndLists) {
  run("sweep s.xml --cache c.nacre -o d --quiet --zip --vary sigma_s_prime*=1:10:2 --vary "
      "'camera=front;side' "
      "--vary 'light.sun=0;1,0.5,0'");
  run("render s.xml --cache c.nacre -o a.exr --quiet --light sun=0");
  run("render s.xml --cache c.nacre -o b.exr --quiet --camera side --light sun=1,0.5,0 -D s=10,12,15");
  expect_same("d/0001.exr", "a.exr");
  expect_same("d/0002.exr", "b.exr");
  folder_.write("p.csv",
                "camera,sigma_s_prime,light.sun\nfront,\"1,1.2,1.5\",0\nside,\"10,12,15\",\"1,0.5,0\"\n");
  run("sweep s.xml --cache c.nacre -o e --quiet --plan p.csv");
  expect_same("e/0002.exr", "b.exr");
  folder_.write("p.json", R"([{"material": "Marble", "scale": 2}, {"mfp": 0.5, "g": "0.5,0.5,0.5"}])");
  run("sweep s.xml --cache c.nacre -o f --quiet --plan p.json");
  EXPECT_EQ(manifest("f")["pictures"][0]["coefficients"]["scale"], 2.0);
  run("sweep s.xml --cache c.nacre -o g --quiet --zip --vary 'albedo=0.8,0.6,0.4;0.5' --vary mfp=1:0.5:2");
  const nlohmann::json dim = manifest("g")["pictures"][1]["coefficients"];
  EXPECT_NEAR(dim["sigma_a"][0].get<double>() + dim["sigma_s_prime"][0].get<double>(), 2, 1e-5);
  EXPECT_EQ(dim["sigma_a"][0], dim["sigma_a"][2]);
}

TEST_F(Sweep, GoesOnWhereItWas) {
  const std::string sweep = "sweep s.xml --cache c.nacre -o d --vary sigma_a=0.01:0.04:4";
  run(sweep);
  const std::string whole = bytes("d/0003.exr");
  const auto renders = [&](const std::string& command, int count) {
    const std::string output = run(command);
    EXPECT_NE(output.find(std::to_string(count) + " of 4 pictures to render"), std::string::npos) << output;
  };
  renders(sweep, 0);
  std::filesystem::remove(folder_.file("d/0002.exr"));
  std::filesystem::resize_file(folder_.file("d/0003.exr"), whole.size() / 2);
  folder_.write("d/points/0004.json", "{");
  renders(sweep, 3);
  EXPECT_EQ(bytes("d/0003.exr"), whole);
  renders(sweep, 0);
  renders(sweep + " --simd scalar", 4);
  renders(sweep + " --simd scalar", 0);
  renders(sweep + " --spp 3", 4);
  EXPECT_NE(bytes("d/0003.exr"), whole);
}

TEST_F(Sweep, NoticesATextureThatChanged) {
  std::string scene = kScene;
  const std::string plain = "<rgb name=\"reflectance\" value=\"0.4, 0.3, 0.2\"/>";
  scene.replace(scene.find(plain), plain.size(),
                "<texture type=\"bitmap\" name=\"reflectance\"><string name=\"filename\" "
                "value=\"floor.png\"/></texture>");
  folder_.write("t.xml", scene);
  // Of the cache, which no light reaches by the floor, it is no part.
  run("render s.xml --cache c.nacre -o floor.exr --png --quiet --size 8x8");
  run("bake t.xml -o t.nacre --quiet --points 4000 --bounces 0");
  const std::string sweep = "sweep t.xml --cache t.nacre -o d --vary sigma_a=0.01:0.04:2";
  EXPECT_NE(run(sweep).find("2 of 2 pictures to render"), std::string::npos);
  run("render s.xml --cache c.nacre -o floor.exr --png --quiet --size 8x8 --camera side");
  EXPECT_NE(run(sweep).find("2 of 2 pictures to render"), std::string::npos);
  EXPECT_NE(run(sweep).find("0 of 2 pictures to render"), std::string::npos);
}

TEST_F(Sweep, ShardsMakeTheSameFiles) {
  // Unlike ones, of which some are interpolated where others are not.
  const std::string sweep = "sweep s.xml --cache c.nacre --quiet --vary 'sigma_a=0.01;9;0.03;0.4;2' -o ";
  run(sweep + "d");
  run(sweep + "e --shard 2/2");
  EXPECT_FALSE(std::filesystem::exists(folder_.file("e/manifest.json")));
  run(sweep + "e --shard 1/2 --threads 1");
  for (const char* name : {"0001.exr", "0002.exr", "0005.exr", "0004.png", "contact_sheet.png", "index.html"})
    EXPECT_EQ(bytes(std::string("d/") + name), bytes(std::string("e/") + name)) << name;
}

// In one batch or another.
TEST_F(Sweep, PicturesThatWereMissingAreTheSameAgain) {
  const std::string sweep = "sweep s.xml --cache c.nacre --quiet -o d --vary 'sigma_a=0.01;9;0.03;0.4;2'";
  run(sweep);
  std::vector<std::string> first;
  for (int i = 1; i <= 5; ++i) first.push_back(bytes(fmt::format("d/{:04}.exr", i)));
  for (const char* name : {"d/0001.exr", "d/0004.exr"}) std::filesystem::remove(folder_.file(name));
  run(sweep);
  for (std::size_t i = 0; i < first.size(); ++i)
    EXPECT_EQ(bytes(fmt::format("d/{:04}.exr", i + 1)), first[i]) << i + 1;
}

// A preset comes with its index of refraction where the scene has none.
TEST_F(Sweep, PresetsBringTheirIndexOfRefraction) {
  std::string scene = kScene;
  const std::string indices = "<float name=\"intIOR\" value=\"$eta\"/><float name=\"extIOR\" value=\"1\"/>";
  const std::string coefficients = "<rgb name=\"sigmaS\" value=\"$s\"/><rgb name=\"sigmaA\" value=\"$a\"/>";
  ASSERT_NE(scene.find(indices), std::string::npos);
  scene.replace(scene.find(indices), indices.size(), "<float name=\"scale\" value=\"1\"/>");
  ASSERT_NE(scene.find(coefficients), std::string::npos);
  scene.replace(scene.find(coefficients), coefficients.size(), "<string name=\"material\" value=\"$m\"/>");
  folder_.write("m.xml", "<!-- -->" + scene);
  run("bake m.xml -o m.nacre --quiet --points 4000 -D m=Skin1");
  run("sweep m.xml --cache m.nacre -o d --quiet --vary 'material=Marble;Skin1' --method exact -D m=Skin1");
  EXPECT_EQ(manifest("d")["pictures"][0]["coefficients"]["eta"], 1.5);
  for (const char* name : {"Marble", "Skin1"}) {
    run(fmt::format("render m.xml --cache m.nacre -o r.exr --quiet --method exact -D m={}", name));
    expect_same(name == std::string("Marble") ? "d/0001.exr" : "d/0002.exr", "r.exr");
  }
}

TEST_F(Sweep, TwoSweepsDoNotShareAFolder) {
  const std::string sweep = "sweep s.xml --cache c.nacre --quiet -o x --vary sigma_a=0.01:0.05:2";
  run(sweep);
  // As another process that writes there.
  const int other = ::open(folder_.file("x/points/sweep").c_str(), O_RDWR);
  ASSERT_EQ(::flock(other, LOCK_SH), 0);
  run(sweep + " --exposure 2");  // the same sweep
  expect_refusal("--quiet --vary sigma_a=0.01:0.05:3", 1, "x: another sweep is being written there; wait");
  ::close(other);
  run("sweep s.xml --cache c.nacre --quiet -o x --vary sigma_a=0.01:0.05:3");
  EXPECT_EQ(manifest("x")["pictures"].size(), 3u);
}

TEST_F(Sweep, SaysThatThereIsNoSlurm) {
  const char* const given = std::getenv("PATH");
  const std::string path = given ? given : "/bin";
  ::setenv("PATH", "/nowhere", 1);
  expect_refusal("--vary sigma_a=1:2:3 --engine slurm", 1, "no sbatch in the PATH");
  ::setenv("PATH", path.c_str(), 1);
}

// As spreadsheets save them, and lists in JSON.
TEST_F(Sweep, ReadsPlansOfEitherKind) {
  folder_.write("p.csv", "\xef\xbb\xbfmfp,g\r\n\"0.5,1,2\",0.1\r\n");
  folder_.write("p.json", "\xef\xbb\xbf[{\"mfp\": [0.5, 1, 2], \"g\": 0.1}]");
  for (const char* const plan : {"p.csv", "p.json"}) {
    run(std::string("sweep s.xml --cache c.nacre --size 16x12 --spp 1 -o x --plan ") + plan);
    EXPECT_EQ(manifest("x")["pictures"][0]["settings"]["mfp"], "0.5,1,2");
    EXPECT_EQ(manifest("x")["pictures"][0]["settings"]["g"], "0.1");
  }
}

TEST_F(Sweep, RefusesWhatItCannotVary) {
  expect_refusal("", 2, "--vary");
  expect_refusal("--vary sigma_a", 2, "no =");
  expect_refusal("--vary colour=1:2:3", 2, "'colour' is none of");
  expect_refusal("--vary sigma_a=1:2", 2, "no range");
  expect_refusal("--vary sigma_a=0:2:3:log", 2, "above 0");
  expect_refusal("--vary sigma_a=1:2:3 --vary sigma_a*=1:2:3", 2, "twice");
  expect_refusal("--vary sigma_a=1:2:3 --vary g=0:0.5:2 --zip", 2, "--zip: sigma_a has 3");
  expect_refusal("--vary sigma_a=1:2:3 --shard 3/2", 2, "K/N");
  expect_refusal("--vary material=Marbel", 1, "Marble");
  expect_refusal("--vary eta=0.5:1:2", 1, "outside");
  expect_refusal("--vary sigma_a=0 --vary sigma_s_prime=0", 1, "neither scatters nor absorbs");
  expect_refusal("--vary albedo=0.5:1.5:2", 1, "outside");
  expect_refusal("--vary camera=top", 1, "front");
  expect_refusal("--vary sigma_a=0.1 --vary mfp=1:2:2", 1, "sigma_a=0.1 would not hold");
  expect_refusal("--vary albedo=0.1 --vary sigma_s_prime=1", 1, "sigma_s_prime=1 would not hold");
  expect_refusal("--vary 'g=0.1;0.2;0.1'", 2, "0.1 is given twice");
  expect_refusal("--vary g=0.1:0.1:2", 2, "A and B are the same");
  expect_refusal("--vary light.moon=1", 1, "moon");
  expect_refusal("--vary sigma_a=1:2:2 --medium glass", 1, "glass");
  folder_.write("p.csv", "sigma_a,g\n1\n");
  expect_refusal("--plan p.csv", 1, "p.csv:2");
  folder_.write("p.csv", "material,g,material\nMarble,1,Skin1\n");
  expect_refusal("--plan p.csv", 1, "p.csv:1: material is given twice");
  folder_.write("p.csv", "colour\n1\n");
  expect_refusal("--plan p.csv", 1, "p.csv:1: 'colour' is none of");
  folder_.write("p.json", "[{\"g\": 0.1,\n \"g\": 0.2}]");
  expect_refusal("--plan p.json", 1, "p.json: has \"g\" twice");
  folder_.write("p.json", "[{\"g\":\n 1e400}]");
  expect_refusal("--plan p.json", 1, "too large");
  folder_.write("p.json", "[{\"mfp\": [1, 2]}]");
  expect_refusal("--plan p.json", 1, "nor [r, g, b]");
  EXPECT_FALSE(std::filesystem::exists(folder_.file("x")));
}

}  // namespace
}  // namespace nacre
