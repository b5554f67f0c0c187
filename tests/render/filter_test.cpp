// label: image
// Pictures under every filter and camera: what is constant stays so, alpha too, also in a mirror.
#include <algorithm>

#include "nacre/cache/cache.h"
#include "nacre/render/render.h"
#include "scene/scene_text.h"

namespace nacre {
namespace {

Image render_quietly(const Scene& scene, int samples) {
  RenderParams params = default_render_params(scene, 0);
  params.samples_per_pixel = samples;
  params.aovs = {false, false, true, true, false, false, false};
  Progress progress;
  Report report;
  Warnings warnings;
  const World world = make_world(scene, true);
  return render(world, {}, params, progress, report, warnings);
}

const Channel& channel(const Image& image, const std::string& name) {
  for (const Channel& c : image.channels)
    if (c.name == name) return c;
  ADD_FAILURE() << "no channel " << name;
  return image.channels.at(0);
}

double mean(const Image& image, const std::string& name) {
  const Channel& values = channel(image, name);
  double sum = 0;
  for (const float value : values.values) sum += value;
  return sum / static_cast<double>(values.values.size());
}

std::string sensor(const std::string& filter) {
  return R"(<sensor type="perspective"><float name="fov" value="10"/><film type="hdrfilm">
      <integer name="width" value="32"/><integer name="height" value="32"/><rfilter type=")" +
         filter + R"("/></film></sensor>)";
}

const std::string kLampAhead = R"(<shape type="rectangle"><transform name="toWorld"><scale value="9"/>
    <lookat origin="0, 0, 5" target="0, 0, 0"/></transform>
    <emitter type="area"><rgb name="radiance" value="2, 3, 4"/></emitter></shape>)";
const std::string kLampInAMirror = R"(
    <shape type="rectangle"><transform name="toWorld"><scale value="9"/><lookat origin="0, 0, 5" target="0, 0, 0"/>
      </transform><bsdf type="conductor"><string name="material" value="none"/></bsdf></shape>
    <shape type="rectangle"><transform name="toWorld"><scale value="9"/><translate z="-5"/></transform>
      <emitter type="area"><rgb name="radiance" value="2, 3, 4"/></emitter></shape>)";

// In every pixel, whatever the weights of its samples happen to add up to.
TEST(Filters, KeepWhatIsConstant) {
  for (const std::string filter : {"box", "tent", "gaussian", "mitchell"})
    for (const std::string& body : {kLampAhead, kLampInAMirror}) {
      const Image image = render_quietly(scene_of(sensor(filter) + body), 64);
      const auto expect_constant = [&](const std::string& name, float value) {
        for (const float v : channel(image, name).values) ASSERT_NEAR(v / value, 1, 1e-5) << filter << name;
      };
      expect_constant("R", 2);
      expect_constant("B", 4);
      expect_constant("A", 1);
    }
}

// Beside a bright edge mitchell undershoots; where nothing is near it is exactly zero.
TEST(Filters, OnlyMitchellGoesBelowZero) {
  const std::string half = R"(<shape type="rectangle"><transform name="toWorld"><translate x="1"/>
    <lookat origin="0, 0, 5" target="0, 0, 0"/></transform>
    <emitter type="area"><rgb name="radiance" value="2, 3, 4"/></emitter></shape>)";
  for (const std::string filter : {"box", "tent", "gaussian", "mitchell"}) {
    const Image image = render_quietly(scene_of(sensor(filter) + half), 64);
    const std::vector<float>& red = channel(image, "R").values;
    EXPECT_EQ(*std::ranges::min_element(red) < 0, filter == "mitchell") << filter;
    EXPECT_GT(mean(image, "R"), 0.9) << filter;
    EXPECT_LT(mean(image, "R"), 1.1) << filter;
  }
}

// A few signed weights would add up to anything, below zero too.
TEST(Filters, FewSamplesHaveNoNegativeWeights) {
  for (const int samples : {1, 2, 4, 15}) {
    const Image image = render_quietly(scene_of(sensor("mitchell") + kLampAhead), samples);
    for (const char* name : {"R", "G", "B", "A"})
      for (const float v : channel(image, name).values) ASSERT_GT(v, 0) << samples << name;
  }
}

// Bright stripes at the distance of focus are sharp, twice as far they are blurred.
TEST(Cameras, ThinLensBlursWhatIsOutOfFocus) {
  std::string stripes;
  for (int i = -2; i <= 2; ++i)
    stripes += fmt::format(R"(<shape type="rectangle"><transform name="toWorld"><scale x="0.0875" y="2"/>
        <lookat origin="{0}, 0, 10" target="{0}, 0, 0"/></transform><emitter type="area"/></shape>)",
                           0.35 * i);
  const auto contrast = [&](double focus) {
    const std::string lens = fmt::format(R"(<sensor type="thinlens"><float name="fov" value="10"/>
            <float name="apertureRadius" value="0.3"/><float name="focusDistance" value="{}"/>
            <film type="hdrfilm"><integer name="width" value="32"/><integer name="height" value="32"/>
              <rfilter type="box"/></film></sensor>)",
                                         focus);
    const Image image = render_quietly(scene_of(lens + stripes), 64);
    const double average = mean(image, "R");
    double variance = 0;
    for (const float value : channel(image, "R").values)
      variance += (value - average) * (value - average) / 1024;
    return variance / (average * average);
  };
  EXPECT_GT(contrast(10), 0.7);
  EXPECT_LT(contrast(5), 0.1);
}

TEST(Cameras, OrthographicSeesTheSizeAndDistanceThatAreThere) {
  const Image image = render_quietly(scene_of(R"(<sensor type="orthographic">
      <transform name="toWorld"><scale value="4"/><translate z="-3"/></transform><film type="hdrfilm">
        <integer name="width" value="64"/><integer name="height" value="32"/><rfilter type="box"/></film></sensor>
      <shape type="rectangle"><transform name="toWorld"><lookat origin="0, 0, 4" target="0, 0, 0"/></transform></shape>)"),
                                     16);
  // 2 x 2 of 8 x 4.
  EXPECT_NEAR(mean(image, "A"), 1 / 8., 1e-6);
  const std::vector<float>& depth = channel(image, "depth.Z").values;
  EXPECT_FLOAT_EQ(*std::ranges::max_element(depth), 7);
}

}  // namespace
}  // namespace nacre
