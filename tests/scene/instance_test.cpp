// label: unit
// Shapegroups and their instances: where they stand, what they share, what is not seen.
#include "scene/scene_text.h"

namespace nacre {
namespace {

const std::string kGroup = R"(
  <shape type="shapegroup" id="pair">
    <shape type="cube" id="box"><transform name="toWorld"><translate x="3"/></transform>
      <bsdf type="diffuse" id="red"><rgb name="reflectance" value="0.9, 0, 0"/></bsdf></shape>
    <shape type="sphere"><subsurface type="dipole"><float name="scale" value="1"/></subsurface></shape>
  </shape>)";

std::string instance(const std::string& transform) {
  return R"(<shape type="instance"><ref id="pair"/><transform name="toWorld">)" + transform +
         "</transform></shape>";
}

TEST(Instances, StandInWorldSpaceUnderTheirOwnNames) {
  // One of them before the group.
  const Scene scene = scene_of(instance(R"(<scale value="2"/><translate y="10"/>)") + kGroup +
                               instance(R"(<rotate z="1" angle="90"/>)") + R"(<shape type="disk"/>)");
  ASSERT_EQ(scene.shapes.size(), 5u);
  EXPECT_EQ(scene.shapes[0].id, "pair/box#1");
  EXPECT_EQ(scene.shapes[1].id, "pair/shape 2#1");
  EXPECT_EQ(scene.shapes[2].id, "pair/box#2");
  EXPECT_EQ(scene.shapes[3].id, "pair/shape 2#2");
  EXPECT_EQ(scene.shapes[4].id, "shape 5");
  EXPECT_EQ(scene.shapes[0].type, "cube");
  const Box3 first = bounds(scene.shapes[0].mesh), second = bounds(scene.shapes[2].mesh);
  EXPECT_EQ(first.min, Vec3(4, 8, -2));
  EXPECT_EQ(first.max, Vec3(8, 12, 2));
  EXPECT_NEAR((second.min - Vec3(-1, 2, -1)).length(), 0, 1e-5);
  EXPECT_NEAR((second.max - Vec3(1, 4, 1)).length(), 0, 1e-5);
  EXPECT_EQ(scene.shapes[1].mesh.triangles, scene.shapes[3].mesh.triangles);
  EXPECT_EQ(count_warnings(scene, "shapegroup"), 0);
}

TEST(Instances, ShareSurfacesAndMedia) {
  const Scene scene = scene_of(kGroup + instance("") + instance("<translate x=\"9\"/>"));
  ASSERT_EQ(scene.media.size(), 1u);
  ASSERT_EQ(scene.surfaces.size(), 1u);
  EXPECT_EQ(scene.shapes[0].surface, 0);
  EXPECT_EQ(scene.shapes[2].surface, 0);
  EXPECT_EQ(scene.shapes[1].medium, 0);
  EXPECT_EQ(scene.shapes[3].medium, 0);
}

TEST(Instances, MirroredOnesKeepOutsideOutside) {
  const Scene scene = scene_of(kGroup + instance("<scale x=\"-1\"/>"));
  EXPECT_NEAR(signed_volume(scene.shapes[0].mesh), 8, 1e-4);
  EXPECT_NEAR(bounds(scene.shapes[0].mesh).max.x, -2, 1e-6);
}

TEST(Instances, AGroupAloneLeavesNothingInTheScene) {
  const Scene scene = scene_of(kGroup + "<shape type=\"disk\"/>");
  EXPECT_EQ(scene.shapes.size(), 1u);
  EXPECT_TRUE(scene.media.empty());
  EXPECT_EQ(scene.surfaces.size(), 1u);
  EXPECT_EQ(count_warnings(scene, "no instance uses the shapegroup 'pair'"), 1);
}

TEST(Instances, WarnOnceOfTheirShapes) {
  const Scene scene = scene_of(R"(<shape type="shapegroup" id="pair"><shape type="disk">
      <subsurface type="dipole"><float name="scale" value="1"/></subsurface></shape></shape>)" +
                               instance("") + instance("") + instance(""));
  EXPECT_EQ(count_warnings(scene, "is translucent, but"), 1);
}

// A few lines of text must not fill the memory: what all instances of a group come to is found out before the
// first of them is made.
TEST(Instances, ExplosionsAreRefused) {
  const auto message = [](const std::string& shapes, int instances) -> std::string {
    std::string text = R"(<shape type="shapegroup" id="pair">)" + shapes + "</shape>\n";
    for (int i = 0; i < instances; ++i) text += instance("");
    try {
      return fmt::format("{} shapes", scene_of(text).shapes.size());
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kLimit);
      return error.what();
    }
  };
  const std::string fine = R"(<shape type="sphere"/>)";
  EXPECT_EQ(message(fine, 3), "3 shapes");
  const std::string many = message(fine, 5000);
  EXPECT_NE(many.find("scene.xml:3: up to here the scene has"), std::string::npos) << many;
  EXPECT_NE(many.find("triangles, more than 200000000"), std::string::npos) << many;
  EXPECT_NE(message(fine, 100).find("spheres, cubes and the like have 8192000 triangles"), std::string::npos);
  const std::string fission = R"(<shape type="cube"><integer name="subdivisions" value="6"/></shape>)";
  EXPECT_EQ(message(fission, 100), "100 shapes");
  EXPECT_NE(message(fission, 1000).find("scene.xml:3: up to here subdivisions make"), std::string::npos);
  std::string small;
  for (int i = 0; i < 2000; ++i) small += R"(<shape type="rectangle"/>)";
  EXPECT_NE(message(small, 1000).find("has 2002000 shapes, more than 1000000"), std::string::npos);
}

}  // namespace
}  // namespace nacre
