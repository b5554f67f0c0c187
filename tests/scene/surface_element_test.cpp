// label: unit
// Surfaces and textures as scene files state them.
#include "nacre/render/image_file.h"
#include "scene/scene_text.h"

namespace nacre {
namespace {

// The surface of a rectangle with this <bsdf>.
Surface surface_of(const std::string& bsdf, Scene* whole = nullptr) {
  Scene scene = scene_of("<shape type=\"rectangle\">" + bsdf + "</shape>");
  const Surface surface = scene.surfaces.at(0);
  if (whole) *whole = std::move(scene);
  return surface;
}
template <class Model>
Model model_of(const std::string& bsdf) {
  return std::get<Model>(surface_of(bsdf).model);
}

TEST(SurfaceElement, RoughModelsHaveMitsubasDefaults) {
  const auto glass = model_of<DielectricSurface>(R"(<bsdf type="roughdielectric"/>)");
  EXPECT_EQ(glass.roughness.u, 0.1f);
  EXPECT_EQ(glass.roughness.v, 0.1f);
  EXPECT_EQ(glass.int_ior, 1.5046f);
  const auto plastic =
      model_of<PlasticSurface>(R"(<bsdf type="roughplastic"><float name="alpha" value="0.25"/></bsdf>)");
  EXPECT_EQ(plastic.roughness.u, 0.25f);
  EXPECT_EQ(plastic.diffuse_reflectance, Rgb(0.5f));
  const auto metal = model_of<ConductorSurface>(
      R"(<bsdf type="roughconductor"><float name="alphaU" value="0.05"/><float name="alphaV" value="0.3"/></bsdf>)");
  EXPECT_EQ(metal.roughness.u, 0.05f);
  EXPECT_EQ(metal.roughness.v, 0.3f);
  EXPECT_EQ(model_of<ConductorSurface>(R"(<bsdf type="conductor"/>)").roughness.u, 0);
}

TEST(SurfaceElement, BeckmannIsRenderedAsGgxWithANote) {
  Scene scene;
  surface_of(R"(<bsdf type="roughplastic"><string name="distribution" value="beckmann"/>
    <boolean name="sampleVisible" value="false"/></bsdf>)",
             &scene);
  EXPECT_EQ(count_warnings(scene, "scene.xml:2: distribution 'beckmann' is rendered as 'ggx'"), 1);
  EXPECT_EQ(count_warnings(scene, "sampleVisible"), 0);
  surface_of(R"(<bsdf type="roughplastic"><string name="distribution" value="GGX"/></bsdf>)", &scene);
  EXPECT_EQ(count_warnings(scene, "distribution"), 0);
}

TEST(SurfaceElement, MetalsByNameOrByNumbers) {
  const auto copper = model_of<ConductorSurface>(R"(<bsdf type="conductor"/>)");
  EXPECT_NEAR(copper.k.x, 3.2479f / 1.000277f, 1e-5);
  const auto gold = model_of<ConductorSurface>(
      R"(<bsdf type="conductor"><string name="material" value="au"/><string name="extEta" value="water"/></bsdf>)");
  EXPECT_NEAR(gold.eta.z, 1.5859f / 1.333f, 1e-5);
  const auto own = model_of<ConductorSurface>(
      R"(<bsdf type="conductor"><rgb name="eta" value="1, 2, 3"/><float name="k" value="4"/><float name="extEta" value="2"/>
         <rgb name="specularReflectance" value="0.1, 0.2, 0.3"/></bsdf>)");
  EXPECT_EQ(own.eta, Rgb(0.5f, 1, 1.5f));
  EXPECT_EQ(own.k, Rgb(2.0f));
  EXPECT_EQ(own.specular_reflectance, Rgb(0.1f, 0.2f, 0.3f));
  const auto mirror =
      model_of<ConductorSurface>(R"(<bsdf type="conductor"><string name="material" value="none"/></bsdf>)");
  EXPECT_EQ(mirror.eta, Rgb(0.0f));
}

TEST(SurfaceElement, TwoSidedTakesWhatIsInsideOrReferredTo) {
  const Surface nested = surface_of(
      R"(<bsdf type="twosided" id="outer"><bsdf type="diffuse"><rgb name="reflectance" value="0.7"/></bsdf></bsdf>)");
  EXPECT_TRUE(nested.two_sided);
  EXPECT_EQ(nested.id, "outer");
  EXPECT_EQ(std::get<DiffuseSurface>(nested.model).reflectance, Rgb(0.7f));
  const Scene scene = scene_of(R"(
    <bsdf type="plastic" id="shiny"/>
    <shape type="cube"><bsdf type="twosided"><ref id="shiny"/></bsdf></shape>
    <shape type="cube"><ref id="shiny"/></shape>)");
  ASSERT_EQ(scene.surfaces.size(), 2u);
  EXPECT_TRUE(scene.surfaces[0].two_sided);
  EXPECT_FALSE(scene.surfaces[1].two_sided);
}

TEST(SurfaceElement, TexturesStandForReflectances) {
  const Scene scene = scene_of(R"(
    <texture type="checkerboard" id="board"><rgb name="color0" value="0.9"/><float name="uscale" value="8"/>
      <float name="vscale" value="4"/><float name="uoffset" value="0.5"/><float name="voffset" value="-1"/></texture>
    <shape type="rectangle"><bsdf type="diffuse"><ref name="reflectance" id="board"/></bsdf></shape>
    <shape type="rectangle"><bsdf type="roughplastic"><ref name="diffuse_reflectance" id="board"/>
      <texture name="specularReflectance" type="checkerboard"/></bsdf></shape>
    <shape type="sphere"><bsdf type="dielectric"><ref name="specularTransmittance" id="board"/></bsdf></shape>)");
  ASSERT_EQ(scene.textures.size(), 2u);
  EXPECT_EQ(scene.surfaces[0].textures.diffuse, 0);
  EXPECT_EQ(std::get<DiffuseSurface>(scene.surfaces[0].model).reflectance, Rgb(1.0f));
  EXPECT_EQ(scene.surfaces[1].textures.diffuse, 0);
  EXPECT_EQ(scene.surfaces[1].textures.specular_reflectance, 1);
  EXPECT_EQ(scene.surfaces[2].textures.specular_transmittance, 0);
  EXPECT_EQ(scene.surfaces[2].textures.diffuse, kNone);
  const Texture& board = scene.textures[0];
  EXPECT_EQ(board.scale, Vec2(8, 4));
  EXPECT_EQ(board.offset, Vec2(0.5f, -1));
  EXPECT_EQ(std::get<CheckerboardTexture>(board.model).color0, Rgb(0.9f));
  EXPECT_EQ(std::get<CheckerboardTexture>(board.model).color1, Rgb(0.2f));
}

TEST(SurfaceElement, AlbedoOfATranslucentObject) {
  const Scene plain = scene_of(R"(<shape type="cube"><subsurface type="dipole"/></shape>)");
  EXPECT_EQ(plain.subsurface[0].surface_albedo, Rgb(1.0f));
  EXPECT_EQ(plain.subsurface[0].albedo_at_entry, 0.5f);
  EXPECT_EQ(plain.subsurface[0].albedo_texture, kNone);
  const Scene scene = scene_of(R"(
    <shape type="cube"><subsurface type="dipole"><rgb name="surfaceAlbedo" value="0.2, 0.4, 0.6"/>
      <float name="albedoAtEntry" value="0.25"/></subsurface></shape>
    <shape type="cube"><subsurface type="dipole"><texture name="surfaceAlbedo" type="checkerboard"/></subsurface></shape>)");
  EXPECT_EQ(scene.subsurface[0].surface_albedo, Rgb(0.2f, 0.4f, 0.6f));
  EXPECT_EQ(scene.subsurface[0].albedo_at_entry, 0.25f);
  EXPECT_EQ(scene.subsurface[1].albedo_texture, 0);
  EXPECT_EQ(scene.subsurface[1].surface_albedo, Rgb(1.0f));
}

// A picture of one row: linear 0.5, written as PNG (188) and as OpenEXR, and 4, which no reflectance can be.
class Pictures : public testing::Test {
 protected:
  Pictures() {
    Image image;
    image.full_width = image.width = 2;
    image.full_height = image.height = 1;
    for (const char* name : {"R", "G", "B"}) image.channels.push_back({name, {0.5f, 4}});
    save_png(image, folder_.path() + "/row.png", 0);
    save_exr(image, folder_.path() + "/row.exr");
  }
  Scene load(const std::string& file, const std::string& more) const {
    return load_scene(folder_.write("s.xml", R"(<scene><shape type="rectangle"><bsdf type="diffuse">
<texture name="reflectance" type="bitmap"><string name="filename" value=")" +
                                                 file + "\"/>" + more + "</texture></bsdf></shape></scene>"));
  }
  float first(const std::string& file, const std::string& more = "") const {
    return std::get<BitmapTexture>(load(file, more).textures.at(0).model).bitmap.at(0, 0).x;
  }
  SceneFolder folder_;
};

TEST_F(Pictures, AreDecodedAsTheirFormatHasIt) {
  EXPECT_NEAR(first("row.png"), 0.5, 3e-3);
  EXPECT_NEAR(first("row.png", R"(<float name="gamma" value="1"/>)"), 188 / 255.0, 1e-4);
  EXPECT_NEAR(first("row.png", R"(<float name="gamma" value="2.2"/>)"), std::pow(188 / 255.0, 2.2), 1e-4);
  EXPECT_EQ(first("row.exr"), 0.5f);
  EXPECT_NEAR(first("row.exr", R"(<float name="gamma" value="-1"/>)"), 0.2140, 1e-3);
}

TEST_F(Pictures, AreCutOffWhereNoReflectanceCanBe) {
  const Scene scene = load("row.exr", "");
  EXPECT_EQ(count_warnings(scene, "s.xml:2: 1 of 2 texels are not from 0 to 1 and are cut off"), 1);
  EXPECT_EQ(std::get<BitmapTexture>(scene.textures[0].model).bitmap.at(1, 0), Rgb(1.0f));
  EXPECT_EQ(count_warnings(load("row.png", ""), "texels"), 0);
}

TEST_F(Pictures, HaveFiltersAndWrapping) {
  const auto load_one = [&](const std::string& more) {
    return std::get<BitmapTexture>(load("row.png", more).textures.at(0).model);
  };
  EXPECT_EQ(load_one("").wrap_u, WrapMode::kRepeat);
  EXPECT_FALSE(load_one("").nearest);
  EXPECT_FALSE(load_one(R"(<string name="filterType" value="ewa"/>)").nearest);
  const BitmapTexture both =
      load_one(R"(<string name="wrapMode" value="mirror"/><string name="filterType" value="nearest"/>)");
  EXPECT_EQ(both.wrap_u, WrapMode::kMirror);
  EXPECT_EQ(both.wrap_v, WrapMode::kMirror);
  EXPECT_TRUE(both.nearest);
  const BitmapTexture mixed =
      load_one(R"(<string name="wrapMode" value="mirror"/><string name="wrapModeV" value="clamp"/>)");
  EXPECT_EQ(mixed.wrap_u, WrapMode::kMirror);
  EXPECT_EQ(mixed.wrap_v, WrapMode::kClamp);
}

TEST_F(Pictures, OnMeshesWithoutCoordinatesAreWarnedOf) {
  folder_.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  folder_.write("b.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 2/2 3/3\n");
  const auto load_mesh_of = [&](const std::string& name, const std::string& more) {
    return load_scene(folder_.write("m.xml", "<scene><shape type=\"obj\"><string name=\"filename\" value=\"" +
                                                 name + "\"/>" + more +
                                                 "<bsdf type=\"diffuse\"><texture name=\"reflectance\" "
                                                 "type=\"checkerboard\"/></bsdf></shape></scene>"));
  };
  EXPECT_EQ(count_warnings(load_mesh_of("a.obj", ""), "no texture coordinates"), 1);
  EXPECT_EQ(count_warnings(load_mesh_of("b.obj", ""), "no texture coordinates"), 0);
  EXPECT_EQ(load_mesh_of("b.obj", "").shapes[0].mesh.uvs.at(2), Vec2(0, 1));
  EXPECT_EQ(
      load_mesh_of("b.obj", R"(<boolean name="flipTexCoords" value="false"/>)").shapes[0].mesh.uvs.at(2),
      Vec2(0, 0));
}

}  // namespace
}  // namespace nacre
