// label: unit
// <shape type="serialized">: which mesh, its normals and its texture coordinates.
#include "geometry/serialized_bytes.h"
#include "scene/scene_text.h"

namespace nacre {
namespace {

// Two meshes that are roofs, the second wants to be flat; textured.
std::string roofs() {
  testing_support::SerializedContent smooth;
  smooth.positions = {0, 0, 0, 1, 0, 0, 1, 1, 1, 0, 1, 0};
  smooth.uvs = {0, 0, 1, 0, 1, 1, 0, 0.75};
  testing_support::SerializedContent flat = smooth;
  flat.flags = 0x10;
  return testing_support::file_of({smooth, flat}, 4);
}

Mesh mesh_with(const std::string& parameters) {
  const SceneFolder folder;
  folder.write("a.serialized", roofs());
  return load_scene(folder.write("scene.xml", R"(<scene><shape type="serialized">
    <string name="filename" value="a.serialized"/>)" +
                                                  parameters + "</shape></scene>"))
      .shapes.at(0)
      .mesh;
}

TEST(SerializedElement, TheFileSaysWhatIsFlatUnlessTheSceneDoes) {
  const std::string second = R"(<integer name="shapeIndex" value="1"/>)";
  EXPECT_FALSE(mesh_with("").normals.empty());
  EXPECT_TRUE(mesh_with(second).normals.empty());
  EXPECT_TRUE(mesh_with(R"(<boolean name="faceNormals" value="true"/>)").normals.empty());
  EXPECT_FALSE(mesh_with(second + R"(<boolean name="faceNormals" value="false"/>)").normals.empty());
  EXPECT_FALSE(mesh_with(second + R"(<float name="maxSmoothAngle" value="90"/>)").normals.empty());
}

TEST(SerializedElement, TexturesStandUpright) {
  EXPECT_EQ(mesh_with("").uvs.at(3), Vec2(0, 0.25f));
  EXPECT_EQ(mesh_with(R"(<boolean name="flipTexCoords" value="false"/>)").uvs.at(3), Vec2(0, 0.75f));
}

TEST(SerializedElement, ErrorsNameTheLineAndTheFile) {
  try {
    mesh_with(R"(<integer name="shapeIndex" value="2"/>)");
    ADD_FAILURE() << "it was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kValue);
    EXPECT_TRUE(error.place().ends_with("scene.xml:2")) << error.place();
    EXPECT_NE(error.reason().find("a.serialized: has no mesh of shapeIndex 2: there are 2"),
              std::string::npos);
  }
}

}  // namespace
}  // namespace nacre
