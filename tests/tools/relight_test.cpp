// label: cli
// Baked light used in other ways: other indices of refraction, lights dimmed and coloured, errors shown.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "nacre/render/image_file.h"
#include "tools/cli.h"

namespace nacre {
namespace {

using testing_support::run_nacre;
using testing_support::TemporaryFolder;

constexpr const char* kScene = R"(<scene version="0.6.0">
  <default name="eta" value="1.5"/>
  <integrator type="direct"/>
  <sensor type="perspective">
    <float name="fov" value="30"/>
    <transform name="toWorld"><lookat origin="0, -40, 20" target="0, 0, 0" up="0, 0, 1"/></transform>
    <sampler type="ldsampler"><integer name="sampleCount" value="2"/></sampler>
    <film type="hdrfilm"><integer name="width" value="48"/><integer name="height" value="36"/></film>
  </sensor>
  <shape type="sphere" id="ball">
    <float name="radius" value="8"/>
    <subsurface type="dipole" id="wax">
      <rgb name="sigmaS" value="1, 1.2, 1.5"/><rgb name="sigmaA" value="0.01, 0.02, 0.03"/>
      <float name="intIOR" value="$eta"/><float name="extIOR" value="1"/>
    </subsurface>
  </shape>
  <emitter type="point" id="spark">
    <point name="position" x="20" y="-30" z="10"/><rgb name="intensity" value="3000, 2000, 1000"/>
  </emitter>
  <emitter type="constant" id="sky"><string name="group" value="fill"/><rgb name="radiance" value="0.5, 0.6, 0.7"/></emitter>
  <emitter type="directional" id="sun"><string name="group" value="fill"/>
    <vector name="direction" x="1" y="0.5" z="-1"/><rgb name="irradiance" value="1, 1, 1"/></emitter>
</scene>
)";

class Relit : public testing::Test {
 protected:
  void SetUp() override { folder_.write("s.xml", kScene); }
  std::string run(const std::string& arguments, int expected = 0) {
    const auto result = run_nacre(folder_, arguments);
    EXPECT_EQ(result.exit_code, expected) << arguments << "\n" << result.output;
    return result.output;
  }
  void expect_refusal(const std::string& arguments, int code, const std::string& text) {
    const std::string output = run(arguments, code);
    EXPECT_NE(output.find(text), std::string::npos) << output;
    EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 1) << output;
  }
  TemporaryFolder folder_;
};

TEST_F(Relit, OneCacheServesEveryIndex) {
  run("bake s.xml -o c.nacre --quiet");
  for (const char* eta : {"1", "1.1", "1.33", "1.9"}) {
    const std::string define = std::string(" -D eta=") + eta;
    run("render s.xml --cache c.nacre -o a.exr --quiet" + define);
    run("render s.xml -o b.exr --quiet" + define);
    run("diff a.exr b.exr --fail-above 0.002");
  }
  expect_refusal("render s.xml --cache c.nacre -o x.exr --quiet -D eta=2.1", 1, "from 1 to 2");
  run("bake s.xml -o f.nacre --quiet --fixed-eta");
  expect_refusal("render s.xml --cache f.nacre -o x.exr --quiet -D eta=1.3", 1,
                 "medium wax/eta was 1.5 and is 1.3");
  run("bake s.xml -o g.nacre --quiet -D eta=2.4");
  run("render s.xml --cache g.nacre -o x.exr --quiet -D eta=2.4");
}

TEST_F(Relit, APointCloudServesTheIndexThatItWasBakedWith) {
  const std::string eta = " -D eta=1.3";  // no binary fraction
  for (const char* options : {"", " --per-light", " --fixed-eta"}) {
    run(std::string("bake s.xml -o c.nacre --quiet") + options + eta);
    run("export c.nacre c.ply --quiet");
    run("import c.ply -o d.nacre --quiet");
    run("import c.ply -o l.nacre --like c.nacre --quiet");
    run("render s.xml --cache c.nacre -o c.exr --quiet" + eta);
    for (const char* cache : {"d.nacre", "l.nacre"}) {
      run(std::string("render s.xml -o d.exr --quiet --cache ") + cache + eta);
      run("diff d.exr c.exr --fail-above 0");
    }
  }
  run("bake s.xml -o c.nacre --quiet");
  run("export c.nacre c.ply --quiet");
  run("import c.ply -o d.nacre --quiet");
  expect_refusal("render s.xml --cache d.nacre -o x.exr --quiet -D eta=1.3", 1,
                 "an index of refraction of 1.5 alone");
}

// The whole picture follows, as if the scene had said so.
TEST_F(Relit, LightsAreScaledWithoutABake) {
  run("bake s.xml -o c.nacre --quiet --per-light");
  for (const char* lights : {"--light spark=0", "--light spark=0.25,2,0 --light fill=0.5", "--light fill=0",
                             "--light spark=1", "--light spark=7 --light spark=2"}) {
    run(std::string("render s.xml --cache c.nacre -o a.exr --quiet ") + lights);
    run(std::string("render s.xml -o b.exr --quiet ") + lights);
    run("diff a.exr b.exr --fail-above 1e-4");
  }
  run("render s.xml --cache c.nacre -o a.exr --quiet");
  run("render s.xml -o b.exr --quiet");
  run("diff a.exr b.exr --fail-above 1e-5");
  run("render s.xml -o d.exr --quiet --light spark=0");
  run("diff d.exr b.exr --layer diffusion --fail-above 0.05", 1);
  run("diff d.exr b.exr --layer single --fail-above 0.05", 1);
}

TEST_F(Relit, LightsThatWereBakedTogetherStayTogether) {
  run("bake s.xml -o all.nacre --quiet");
  run("bake s.xml -o apart.nacre --quiet --per-light");
  expect_refusal("render s.xml --cache all.nacre -o x.exr --quiet --light spark=2", 1,
                 "bake it with --per-light");
  expect_refusal("render s.xml --cache apart.nacre -o x.exr --quiet --light sun=2", 1,
                 "the lights of 'fill'");
  run("render s.xml --cache all.nacre -o a.exr --quiet --light spark=2 --light fill=2");
  run("render s.xml -o b.exr --quiet --light spark=2 --light fill=2");
  run("diff a.exr b.exr --fail-above 1e-5");
}

TEST_F(Relit, ArgumentsThatAreNoneAreRefused) {
  for (const char* argument : {"spark", "spark=", "spark=-1", "spark=1,2", "spark=1,2,3,4", "spark=nan",
                               "spark=x", "spark=1e30", "spark=1,,2"})
    expect_refusal(std::string("render s.xml -o x.exr --quiet --light ") + argument, 2, "ID=SCALE");
  expect_refusal("render s.xml -o x.exr --quiet --light spork=1", 1, "there is 'spark', 'sky' (of 'fill')");
  expect_refusal("render s.xml -o x.exr --quiet --light =1", 1, "no light has the id ''");
  expect_refusal("bake s.xml -o x.nacre --quiet --irradiance-error 0", 2, "irradiance-error");
  expect_refusal("render s.xml -o x.exr --quiet --aov irradiance --method montecarlo", 2, "--aov irradiance");
}

TEST_F(Relit, LightsAreAddedToACache) {
  std::string scene = kScene;
  const std::size_t at = scene.find("</scene>");
  folder_.write("more.xml",
                scene.substr(0, at) +
                    "<emitter type=\"spot\" id=\"late\"><transform name=\"toWorld\"><lookat origin=\"-20, "
                    "-30, 10\" target=\"0, 0, 0\" up=\"0, 0, 1\"/></transform><rgb name=\"intensity\" "
                    "value=\"900, 900, 900\"/></emitter></scene>");
  // 1.3 is no binary fraction.
  for (const char* eta : {" -D eta=1.3", ""}) {
    run(std::string("bake s.xml -o c.nacre --quiet --per-light") + eta);
    expect_refusal(std::string("render more.xml --cache c.nacre -o a.exr --quiet") + eta, 1, "light late");
    run(std::string("bake more.xml -o c.nacre --quiet --add-lights") + eta);
    run(std::string("render more.xml --cache c.nacre -o a.exr --quiet") + eta);
    run(std::string("render more.xml -o b.exr --quiet") + eta);
    run("diff a.exr b.exr --fail-above 1e-5");
  }
  expect_refusal("bake more.xml -o c.nacre --quiet --add-lights", 1, "has all lights");
  expect_refusal("bake more.xml -o none.nacre --quiet --add-lights", 1, "none.nacre");
  run("bake s.xml -o all.nacre --quiet");
  expect_refusal("bake more.xml -o all.nacre --quiet --add-lights", 1, "--per-light");
  folder_.write(
      "lamp.xml",
      scene.substr(0, at) + "<shape type=\"rectangle\" id=\"lamp\"><emitter type=\"area\"/></shape></scene>");
  run("bake s.xml -o d.nacre --quiet --per-light");
  expect_refusal("bake lamp.xml -o d.nacre --quiet --add-lights", 1, "shape lamp");
  run("info d.nacre");
}

TEST_F(Relit, ErrorsOfTheIrradianceAreShown) {
  run("bake s.xml -o c.nacre --quiet --irradiance-samples 8");
  run("bake s.xml -o d.nacre --quiet --irradiance-samples 8 --irradiance-error 0.005");
  run("bake s.xml -o one.nacre --quiet --irradiance-samples 1");
  EXPECT_NE(run("info c.nacre").find("standard error of the irradiance: "), std::string::npos);
  EXPECT_NE(run("info one.nacre").find("not known"), std::string::npos);
  const auto worst = [&](const char* cache) {
    run(std::string("render s.xml -o e.exr --quiet --aov irradiance,irradiance_error --cache ") + cache);
    const Image image = load_exr(folder_.file("e.exr"));
    double largest = 0, irradiance = 0;
    for (const Channel& channel : image.channels) {
      for (const float v : channel.values) {
        EXPECT_TRUE(std::isfinite(v) && v >= 0);
        if (channel.name == "irradiance_error.Y") largest = std::max(largest, double{v});
        if (channel.name == "irradiance.G") irradiance = std::max(irradiance, double{v});
      }
    }
    EXPECT_GT(irradiance, 0.1);
    return largest;
  };
  const double coarse = worst("c.nacre");
  EXPECT_GT(coarse, 0);
  EXPECT_LT(worst("d.nacre"), coarse);
  EXPECT_EQ(worst("one.nacre"), 0);
}

}  // namespace
}  // namespace nacre
