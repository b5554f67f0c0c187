// label: unit
// Lights as scene files give them.
#include "nacre/render/image_file.h"
#include "scene/scene_text.h"

namespace nacre {
namespace {

constexpr const char* kShape = "<shape type=\"rectangle\"/>";

template <class Model>
Model light_of(const std::string& text) {
  return std::get<Model>(scene_of(kShape + text).lights.at(0).model);
}

// Two texels: (1, 2, 4) and (0.5, 0.5, 0.5).
std::string two_texels() {
  const unsigned char bytes[] = {32, 64, 128, 131, 128, 128, 128, 128};
  return "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n" +
         std::string(reinterpret_cast<const char*>(bytes), sizeof bytes);
}

Scene scene_with_map(const std::string& parameters, const std::string& picture = two_texels()) {
  const SceneFolder folder;
  folder.write("maps/a.hdr", picture);
  return load_scene(folder.write("scene.xml", std::string("<scene>") + kShape +
                                                  "<emitter type=\"envmap\"><string name=\"filename\" "
                                                  "value=\"maps/a.hdr\"/>" +
                                                  parameters + "</emitter></scene>"));
}
EnvironmentMap map_of(const std::string& parameters) {
  return std::get<EnvironmentMap>(scene_with_map(parameters).lights.at(0).model);
}

TEST(LightElement, SpotDefaults) {
  const auto spot = light_of<SpotLight>("<emitter type=\"spot\"/>");
  EXPECT_EQ(spot.position, Vec3(0, 0, 0));
  EXPECT_EQ(spot.direction, Vec3(0, 0, 1));
  EXPECT_EQ(spot.intensity, Rgb(1));
  EXPECT_EQ(spot.cutoff_angle, 20);
  EXPECT_EQ(spot.beam_width, 15);
}

TEST(LightElement, SpotParameters) {
  const auto spot = light_of<SpotLight>(R"(<emitter type="spot"><rgb name="intensity" value="1 2 3"/>
      <float name="cutoffAngle" value="40"/><transform name="toWorld"><scale value="7"/>
      <lookat origin="0 3 0" target="0 0 0" up="1 0 0"/></transform></emitter>)");
  EXPECT_EQ(spot.position, Vec3(0, 3, 0));
  EXPECT_NEAR((spot.direction - Vec3(0, -1, 0)).length(), 0, 1e-6);
  EXPECT_EQ(spot.intensity, Rgb(1, 2, 3));
  EXPECT_EQ(spot.beam_width, 30);
  EXPECT_EQ(light_of<SpotLight>(R"(<emitter type="spot"><float name="beamWidth" value="20"/></emitter>)")
                .beam_width,
            20);
}

TEST(LightElement, Constant) {
  EXPECT_EQ(light_of<ConstantLight>("<emitter type=\"constant\"/>").radiance, Rgb(1));
  const Scene scene = scene_of(std::string(kShape) + R"(<emitter type="constant" id="sky">
      <rgb name="radiance" value="0.1 0.2 0.3"/></emitter><emitter type="point"/>)");
  EXPECT_EQ(std::get<ConstantLight>(scene.lights[0].model).radiance, Rgb(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(light_name(scene, 0), "sky");
  EXPECT_TRUE(is_environment(scene.lights[0]) && !is_delta(scene.lights[0]));
  EXPECT_TRUE(!is_environment(scene.lights[1]) && is_delta(scene.lights[1]));
}

TEST(LightElement, EnvironmentMapIsFoundBesideItsSceneAndScaled) {
  const EnvironmentMap map = map_of(R"(<float name="scale" value="2"/><boolean name="cache" value="true"/>)");
  ASSERT_EQ(map.radiance.width, 2);
  ASSERT_EQ(map.radiance.height, 1);
  EXPECT_EQ(map.radiance.at(0, 0), Rgb(2, 4, 8));
  EXPECT_EQ(map.radiance.at(1, 0), Rgb(1));
  EXPECT_EQ(map.to_world, Matrix4());
  EXPECT_TRUE(scene_with_map("").warnings.size() == 1 &&
              count_warnings(scene_with_map(""), "no <sensor>") == 1);
}

TEST(LightElement, EnvironmentMapTurnsAndMirrorsButIsNotMoved) {
  const Matrix4 turned = map_of(R"(<transform name="toWorld"><scale value="3"/><rotate y="1" angle="90"/>
                                   <translate x="9"/></transform>)")
                             .to_world;
  EXPECT_NEAR((Vec3d(turned[2][0], turned[2][1], turned[2][2]) - Vec3d(1, 0, 0)).length(), 0, 1e-12);
  EXPECT_EQ(turned[3][0], 0);
  const Matrix4 mirrored = map_of(R"(<transform name="toWorld"><scale x="-1"/></transform>)").to_world;
  EXPECT_EQ(mirrored[0][0], -1);
  EXPECT_EQ(mirrored[2][2], 1);
}

TEST(LightElement, EnvironmentMapAllowsNothingBelowZero) {
  const SceneFolder folder;
  Image image;
  image.full_width = image.width = image.full_height = image.height = 1;
  image.channels = {{"B", {-0.25f}}, {"G", {0}}, {"R", {3}}};
  save_exr(image, folder.path() + "/a.exr");
  const std::string text = std::string("<scene>") + kShape +
                           "<emitter type=\"envmap\"><string name=\"filename\" value=\"a.exr\"/><float "
                           "name=\"scale\" value=\"{}\"/></emitter></scene>";
  const Scene scene = load_scene(folder.write("s.xml", fmt::format(fmt::runtime(text), 1)));
  EXPECT_EQ(std::get<EnvironmentMap>(scene.lights[0].model).radiance.at(0, 0), Rgb(3, 0, 0));
  EXPECT_THROW(load_scene(folder.write("t.xml", fmt::format(fmt::runtime(text), 1e30))), Error);
}

TEST(LightElement, SamplingWeights) {
  const Scene scene = scene_of(R"(
    <emitter type="point"><float name="samplingWeight" value="2.5"/></emitter>
    <shape type="disk"><emitter type="area"><float name="samplingWeight" value="0.5"/></emitter></shape>
    <emitter type="constant"/>)");
  EXPECT_EQ(scene.lights[0].sampling_weight, 2.5f);
  EXPECT_EQ(scene.lights[1].sampling_weight, 0.5f);
  EXPECT_EQ(scene.lights[2].sampling_weight, 1);
}

// Whatever the shape, it can emit, and its light belongs to it.
TEST(LightElement, EveryTypeOfShapeEmits) {
  const SceneFolder folder;
  folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  folder.write("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  folder.write("a.stl",
               "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
               "endfacet\nendsolid a\n");
  folder.write(
      "a.ply",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  std::string text = "<scene>";
  int count = 0;
  for (const char* type : {"obj", "off", "stl", "ply", "sphere", "cube", "rectangle", "disk", "cylinder"}) {
    text += fmt::format("<shape type=\"{}\">", type);
    if (++count <= 4) text += fmt::format("<string name=\"filename\" value=\"a.{}\"/>", type);
    text += "<emitter type=\"area\"/></shape>\n";
  }
  const Scene scene = load_scene(folder.write("s.xml", text + "</scene>"));
  ASSERT_EQ(scene.lights.size(), 9u);
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    EXPECT_EQ(std::get<AreaLight>(scene.lights[i].model).shape, i);
    EXPECT_EQ(scene.shapes[i].light, static_cast<int>(i));
  }
}

}  // namespace
}  // namespace nacre
