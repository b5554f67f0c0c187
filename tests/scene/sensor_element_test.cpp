// label: unit
// Cameras with a lens and without perspective, and filters, as scene files have them.
#include "scene/scene_text.h"

namespace nacre {
namespace {

Scene scene_with(const std::string& sensor) { return scene_of("<shape type=\"rectangle\"/>" + sensor); }

Film film_of(const std::string& filter) {
  return scene_with("<sensor type=\"perspective\"><film type=\"hdrfilm\">" + filter + "</film></sensor>")
      .films.at(0);
}

TEST(SensorElement, ThinLens) {
  const Scene scene = scene_with(R"(
    <sensor type="thinlens" id="a"><float name="fov" value="20"/><float name="apertureRadius" value="0.5"/>
      <float name="focusDistance" value="12"/></sensor>
    <sensor type="thinlens" id="b"><float name="aperture_radius" value="2"/><float name="farClip" value="70"/></sensor>)");
  EXPECT_EQ(scene.cameras[0].kind, CameraKind::kThinLens);
  EXPECT_EQ(scene.cameras[0].fov, 20);
  EXPECT_EQ(scene.cameras[0].aperture_radius, 0.5f);
  EXPECT_EQ(scene.cameras[0].focus_distance, 12);
  EXPECT_EQ(scene.cameras[1].focus_distance, 70);
  EXPECT_EQ(count_warnings(scene, "has no parameter"), 0);
}

TEST(SensorElement, OrthographicMayScaleAndHasNoFieldOfView) {
  const Scene scene = scene_with(R"(
    <sensor type="orthographic"><transform name="toWorld"><scale x="5" y="4" z="-1"/>
      <translate x="1" y="2" z="3"/></transform><float name="fov" value="20"/></sensor>)");
  EXPECT_EQ(scene.cameras[0].kind, CameraKind::kOrthographic);
  EXPECT_EQ(scene.cameras[0].to_world[0][0], 5);
  EXPECT_EQ(scene.cameras[0].to_world[1][1], 4);
  EXPECT_EQ(scene.cameras[0].to_world.translation(), Vec3d(1, 2, 3));
  EXPECT_EQ(count_warnings(scene, "has no parameter 'fov'"), 1);
}

TEST(SensorElement, Filters) {
  const Film tent = film_of("<rfilter type=\"tent\"/>");
  EXPECT_EQ(tent.filter, FilterKind::kTent);
  EXPECT_EQ(tent.filter_radius, 1);
  const Film plain = film_of("<rfilter type=\"mitchell\"/>");
  EXPECT_EQ(plain.filter, FilterKind::kMitchell);
  EXPECT_EQ(plain.filter_radius, 2);
  EXPECT_EQ(plain.filter_b, 1 / 3.0f);
  const Film sharp = film_of(
      R"(<rfilter type="mitchell"><float name="B" value="0"/><float name="C" value="0.5"/></rfilter>)");
  EXPECT_EQ(sharp.filter_b, 0);
  EXPECT_EQ(sharp.filter_c, 0.5f);
  const Scene lanczos = scene_with(
      R"(<sensor type="perspective"><film type="hdrfilm"><rfilter type="lanczos"/></film></sensor>)");
  EXPECT_EQ(lanczos.films[0].filter, FilterKind::kGaussian);
  EXPECT_EQ(count_warnings(lanczos,
                           "rfilter 'lanczos' is not supported (there is box, tent, gaussian, "
                           "mitchell): using gaussian"),
            1);
}

}  // namespace
}  // namespace nacre
