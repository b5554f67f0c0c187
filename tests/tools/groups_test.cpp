// label: cli
// Groups as a user sees them: in pictures, in a cache, in warnings.
#include <gtest/gtest.h>

#include <algorithm>

#include "nacre/render/image_file.h"
#include "tools/cli.h"

namespace nacre {
namespace {

using testing_support::run_nacre;
using testing_support::TemporaryFolder;

// Two cubes that touch; light from the left falls on the first alone. The second is of $right.
constexpr const char* kTwoCubes = R"(<scene version="0.6.0">
  <default name="right" value="right medium"/>
  <sensor type="perspective">
    <float name="fov" value="30"/>
    <transform name="toWorld"><lookat origin="0, 20, 30" target="0, 0, 0" up="0, 1, 0"/></transform>
    <sampler type="independent"><integer name="sampleCount" value="2"/></sampler>
    <film type="hdrfilm"><integer name="width" value="64"/><integer name="height" value="48"/></film>
  </sensor>
  <subsurface type="dipole" id="left medium"><string name="material" value="Marble"/><float name="scale" value="1"/></subsurface>
  <subsurface type="dipole" id="right medium"><string name="material" value="Skin1"/><float name="scale" value="1"/></subsurface>
  <shape type="cube" id="left">
    <transform name="toWorld"><scale value="3"/><translate x="-3"/></transform>
    <ref id="left medium"/>
  </shape>
  <shape type="cube" id="right">
    <transform name="toWorld"><scale value="3"/><translate x="3"/></transform>
    <ref id="$right"/>
  </shape>
  <emitter type="directional"><vector name="direction" x="1" y="0" z="0"/><rgb name="irradiance" value="1, 1, 1"/></emitter>
</scene>
)";

class Groups : public testing::Test {
 protected:
  void SetUp() override { folder_.write("two.xml", kTwoCubes); }
  std::string run(const std::string& arguments) {
    const auto result = run_nacre(folder_, arguments);
    EXPECT_EQ(result.exit_code, 0) << arguments << "\n" << result.output;
    return result.output;
  }
  // The brightest diffusion of what has an object id.
  float brightest(const std::string& picture, float object) {
    const Image image = load_exr(folder_.file(picture));
    float most = 0;
    std::size_t pixels = 0;
    for (std::size_t i = 0; i < image.channels[0].values.size(); ++i) {
      if (find_channel(image, "object.id")->values[i] != object) continue;
      ++pixels;
      for (const char* channel : {"diffusion.R", "diffusion.G", "diffusion.B"})
        most = std::max(most, find_channel(image, channel)->values[i]);
    }
    EXPECT_GT(pixels, 50u);
    return most;
  }
  TemporaryFolder folder_;
};

TEST_F(Groups, TheDarkOneIsBlackInThePicture) {
  run("bake two.xml -o two.nacre --quiet");
  const std::string info = run("info two.nacre");
  EXPECT_NE(info.find("group left medium"), std::string::npos) << info;
  EXPECT_NE(info.find("group right medium"), std::string::npos) << info;
  // One sample at the middle of each pixel, so that none holds light of both.
  run("render two.xml --cache two.nacre -o two.exr --spp 1 --quiet");
  EXPECT_GT(brightest("two.exr", 1), 0.01f);
  EXPECT_EQ(brightest("two.exr", 2), 0);
  // Of one medium it is not.
  run("render two.xml -o one.exr --spp 1 --quiet -D 'right=left medium'");
  EXPECT_GT(brightest("one.exr", 2), 1e-5f);
}

TEST_F(Groups, WhatBoundsNothingIsWarnedOf) {
  EXPECT_EQ(run("info two.xml").find("lies"), std::string::npos);
  EXPECT_EQ(run("info two.xml -D 'right=left medium'").find("lies"), std::string::npos);
  std::string text = kTwoCubes;
  const std::string move = "<translate x=\"3\"/>";
  const auto at = text.find(move);
  folder_.write("copy.xml", text.replace(at, move.size(), "<translate x=\"-3\"/>"));
  for (const char* command : {"info copy.xml", "bake copy.xml -o c.nacre --points 2000 --quiet"}) {
    const std::string output = run(std::string(command) + " -D 'right=left medium'");
    EXPECT_NE(
        output.find("nacre: warning: copy.xml:15: right lies on left (copy.xml:11), exactly: light enters "
                    "there twice; remove the copy\n"),
        std::string::npos)
        << output;
  }
  EXPECT_EQ(run_nacre(folder_, "info copy.xml --check -D 'right=left medium'").exit_code, 1);
}

TEST_F(Groups, BordersAreWarnedOfWithWhatToDo) {
  std::string text = kTwoCubes;
  const auto at = text.find("type=\"cube\" id=\"right\"");
  folder_.write("sheet.xml", text.replace(at, 11, "type=\"disk\""));
  EXPECT_NE(run("info sheet.xml").find("half-space: give it thickness"), std::string::npos);
}

}  // namespace
}  // namespace nacre
