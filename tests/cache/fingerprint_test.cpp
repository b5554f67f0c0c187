// label: unit
// Whatever changes a cache's numbers changes its fingerprint, and the message names it; nothing else does.
#include "nacre/cache/fingerprint.h"

#include <gtest/gtest.h>

#include <functional>

#include "nacre/geometry/mesh.h"

namespace nacre {
namespace {

Mesh make_triangle(float size) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {size, 0, 0}, {0, size, 0}};
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

// A candle on a table between a key light, the sun and a lamp.
Scene make_scene() {
  Scene scene;
  Medium wax;
  wax.id = "wax";
  wax.sigma_s = {1, 2, 3};
  wax.sigma_a = {0.1f, 0.1f, 0.1f};
  wax.int_ior = 1.5f;
  wax.ext_ior = 1;
  scene.media = {wax};
  scene.subsurface.resize(1);
  scene.surfaces.push_back({"wood", "", DiffuseSurface{{0.5f, 0.25f, 0.125f}}});
  Shape candle, table, lamp;
  candle.id = "candle";
  candle.mesh = make_triangle(1);
  candle.medium = 0;
  table.id = "table";
  table.mesh = make_triangle(5);
  table.mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
  table.surface = 0;
  lamp.id = "lamp";
  lamp.mesh = make_triangle(2);
  lamp.light = 2;
  scene.shapes = {candle, table, lamp};
  scene.lights = {{"key", "", PointLight{{0, 1, 2}, {3, 3, 3}}},
                  {"", "", DirectionalLight{{0, 0, -1}, {1, 1, 1}}},
                  {"glow", "", AreaLight{2, {5, 5, 5}}}};
  return scene;
}

KeyValues fingerprint(const Scene& scene, int bounces = 1, bool shadows = true) {
  return make_fingerprint(scene, {{bounces}, shadows});
}

// The mismatch after a change to the scene, baked with so many bounces.
template <class Change>
std::string mismatch(const Change& change, int bounces = 1, bool shadows = true) {
  Scene scene = make_scene();
  const KeyValues before = fingerprint(scene, bounces, shadows);
  change(scene);
  return describe_mismatch(before, fingerprint(scene, bounces, shadows));
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != text.npos; }

TEST(Fingerprint, OfTheSameSceneMatches) {
  EXPECT_EQ(mismatch([](Scene&) {}), "");
  EXPECT_EQ(fingerprint_digest(fingerprint(make_scene())), fingerprint_digest(fingerprint(make_scene())));
  EXPECT_EQ(fingerprint_digest(fingerprint(make_scene())).size(), 32u);
}

TEST(Fingerprint, NamesALightThatMoved) {
  EXPECT_EQ(mismatch([](Scene& s) { std::get<PointLight>(s.lights[0].model).position.z = 3; }),
            "light key/position was 0 1 2 and is 0 1 3");
  EXPECT_EQ(mismatch([](Scene& s) { std::get<PointLight>(s.lights[0].model).intensity.x = 4; }),
            "light key/intensity was 3 3 3 and is 4 3 3");
  EXPECT_EQ(mismatch([](Scene& s) { std::get<DirectionalLight>(s.lights[1].model).irradiance.y = 2; }),
            "light light 2/irradiance was 1 1 1 and is 1 2 1");
  EXPECT_EQ(mismatch([](Scene& s) {
              std::get<DirectionalLight>(s.lights[1].model).direction = {0, -1, 0};
            }),
            "light light 2/direction was 0 0 -1 and is 0 -1 0");
  EXPECT_EQ(mismatch([](Scene& s) { std::get<AreaLight>(s.lights[2].model).radiance.z = 0.1f; }),
            "light glow/radiance was 5 5 5 and is 5 5 0.1");
}

TEST(Fingerprint, CountsEveryNumberOfLightsAllAroundAndSpots) {
  const auto of = [](auto model) {
    Scene scene = make_scene();
    scene.lights.push_back({"new", "", std::move(model)});
    return fingerprint(scene);
  };
  const auto differ = [&](const auto& model, const auto& change) {
    auto changed = model;
    change(changed);
    return describe_mismatch(of(model), of(changed));
  };
  SpotLight spot{{1, 2, 3}, {0, 0, 1}, {4, 5, 6}};
  EXPECT_EQ(differ(spot, [](SpotLight& s) { s.position.x = 0; }),
            "light new/position was 1 2 3 and is 0 2 3");
  EXPECT_EQ(differ(spot,
                   [](SpotLight& s) {
                     s.direction = {0, 1, 0};
                   }),
            "light new/direction was 0 0 1 and is 0 1 0");
  EXPECT_EQ(differ(spot, [](SpotLight& s) { s.intensity.z = 0; }),
            "light new/intensity was 4 5 6 and is 4 5 0");
  EXPECT_EQ(differ(spot, [](SpotLight& s) { s.cutoff_angle = 21; }),
            "light new/angles was 20 15 and is 21 15");
  EXPECT_EQ(differ(spot, [](SpotLight& s) { s.beam_width = 14; }), "light new/angles was 20 15 and is 20 14");
  EXPECT_EQ(differ(ConstantLight{{1, 1, 1}}, [](ConstantLight& c) { c.radiance.y = 2; }),
            "light new/radiance was 1 1 1 and is 1 2 1");
  const EnvironmentMap map{{2, 1, {{1, 1, 1}, {2, 2, 2}}}, {}};
  EXPECT_EQ(differ(map, [](EnvironmentMap&) {}), "");
  EXPECT_NE(differ(map, [](EnvironmentMap& m) { m.radiance.texels[1].z = 3; }), "");
  EXPECT_NE(differ(map, [](EnvironmentMap& m) { std::swap(m.radiance.width, m.radiance.height); }), "");
  EXPECT_NE(differ(map, [](EnvironmentMap& m) { m.to_world.rotate(Imath::V3d(0, 1e-3, 0)); }), "");
}

// How it is sampled changes noise, not what a cache is of.
TEST(Fingerprint, IgnoresSamplingWeights) {
  EXPECT_EQ(mismatch([](Scene& s) { s.lights[0].sampling_weight = 3; }), "");
}

// The smallest change that a float can hold counts.
TEST(Fingerprint, SeesTheLastBit) {
  EXPECT_NE(mismatch([](Scene& s) {
              float& z = std::get<PointLight>(s.lights[0].model).position.z;
              z = std::nextafter(z, 9.0f);
            }),
            "");
}

TEST(Fingerprint, NamesLightsThatCameOrWent) {
  const std::string gone = mismatch([](Scene& s) { s.lights.erase(s.lights.begin()); });
  EXPECT_TRUE(contains(gone, "light key/position is gone")) << gone;
  const std::string fresh = mismatch([](Scene& s) {
    s.lights.push_back({"fill", "", PointLight{{1, 1, 1}, {2, 2, 2}}});
  });
  EXPECT_TRUE(contains(fresh, "light fill/position is new (1 1 1)")) << fresh;
}

TEST(Fingerprint, NamesGeometryThatChanged) {
  EXPECT_EQ(mismatch([](Scene& s) { s.shapes[0].mesh.positions[1].x += 1e-6f; }),
            "shape candle/geometry has changed");
  EXPECT_EQ(mismatch([](Scene& s) {
              s.shapes[0].mesh.triangles[0] = {0, 2, 1};
            }),
            "shape candle/geometry has changed");
  EXPECT_EQ(mismatch([](Scene& s) { s.shapes[2].mesh.positions[1].x += 1; }),
            "shape lamp/geometry has changed");
  const std::string fresh = mismatch([](Scene& s) {
    s.shapes.push_back(s.shapes[1]);
    s.shapes.back().id = "wall";
  });
  EXPECT_TRUE(contains(fresh, "shape wall/geometry is new;")) << fresh;
}

TEST(Fingerprint, NamesShadowsBouncesAndEta) {
  const Scene scene = make_scene();
  EXPECT_EQ(describe_mismatch(fingerprint(scene, 1, true), fingerprint(scene, 1, false)),
            "shadows was yes and is no");
  EXPECT_EQ(describe_mismatch(fingerprint(scene, 1), fingerprint(scene, 2)),
            "medium wax/bounces was 1 and is 2");
  EXPECT_EQ(mismatch([](Scene& s) { s.media[0].int_ior = 1.25f; }), "medium wax/eta was 1.5 and is 1.25");
}

TEST(Fingerprint, NamesTheMediumOfAShape) {
  EXPECT_EQ(mismatch([](Scene& s) { s.shapes[2].medium = 0; }, 0), "shape lamp/medium was none and is wax");
}

// Coefficients and profile are what a cache is reused for; cameras and files' names leave no trace.
TEST(Fingerprint, IgnoresWhatTheCacheDoesNotDependOn) {
  EXPECT_EQ(mismatch([](Scene& s) {
              s.media[0].sigma_a = {1, 2, 3};
              s.media[0].sigma_s = {7, 7, 7};
              s.media[0].g = {0.5f, 0.5f, 0.5f};
              s.media[0].scale = 20;
              s.media[0].profile = ProfileKind::kNormalized;
              s.media[0].material = "Ketchup";
              s.samples_per_pixel = 1;
              s.path = "elsewhere.xml";
              s.shapes[0].type = "ply";
              s.shapes[0].place = "elsewhere.xml:3";
            }),
            "");
}

TEST(Fingerprint, ReflectancesCountOnlyWhereLightBounces) {
  const auto paint = [](Scene& s) {
    std::get<DiffuseSurface>(s.surfaces[0].model).reflectance = {0.5f, 0.5f, 0.5f};
  };
  EXPECT_EQ(mismatch(paint, 0), "");
  EXPECT_EQ(mismatch(paint, 1), "shape table/surface was diffuse 0.5 0.25 0.125 and is diffuse 0.5 0.5 0.5");
  const auto varnish = [](Scene& s) { s.surfaces[0].model = PlasticSurface{}; };
  EXPECT_EQ(mismatch(varnish, 0), "");
  const std::string text = mismatch(varnish, 1);
  EXPECT_TRUE(contains(text, "is plastic 0.5 0.5 0.5 1.49 1.000277 false")) << text;
}

TEST(Fingerprint, EveryNumberOfASurfaceCounts) {
  using Change = std::function<void(Surface&)>;
  const auto differs = [](const auto& model, const Change& change) {
    Scene scene = make_scene();
    scene.surfaces[0].model = model;
    const KeyValues before = fingerprint(scene, 1);
    EXPECT_EQ(describe_mismatch(before, fingerprint(scene, 1)), "");
    change(scene.surfaces[0]);
    return contains(describe_mismatch(before, fingerprint(scene, 1)), "shape table/surface was");
  };
  const ConductorSurface metal{{1, 2, 3}, {4, 5, 6}, {1, 1, 1}, {0.1f, 0.2f}};
  const auto of_metal = [](Surface& s) -> ConductorSurface& { return std::get<ConductorSurface>(s.model); };
  EXPECT_TRUE(differs(metal, [&](Surface& s) { of_metal(s).eta.y = 9; }));
  EXPECT_TRUE(differs(metal, [&](Surface& s) { of_metal(s).k.z = 9; }));
  EXPECT_TRUE(differs(metal, [&](Surface& s) { of_metal(s).specular_reflectance.x = 0; }));
  EXPECT_TRUE(differs(metal, [&](Surface& s) { of_metal(s).roughness.v = 0.3f; }));
  EXPECT_TRUE(differs(metal, [](Surface& s) { s.two_sided = true; }));
  EXPECT_TRUE(differs(PlasticSurface{}, [](Surface& s) {
    std::get<PlasticSurface>(s.model).roughness = {0.1f, 0.1f};
  }));
  EXPECT_TRUE(differs(DielectricSurface{}, [](Surface& s) {
    std::get<DielectricSurface>(s.model).roughness = {0.1f, 0.1f};
  }));
}

Scene make_textured_scene() {
  Scene scene = make_scene();
  BitmapTexture picture;
  picture.bitmap = {1, 2, {{0, 0, 0}, {1, 1, 1}}};
  scene.textures = {{"", "", picture}, {"", "", CheckerboardTexture{}}};
  scene.surfaces[0].textures.diffuse = 0;
  scene.subsurface[0].albedo_texture = 1;
  for (Shape& shape : scene.shapes) shape.mesh.uvs = {{0, 0}, {1, 0}, {0, 1}};
  return scene;
}
template <class Change>
std::string textured_mismatch(const Change& change, int bounces) {
  Scene scene = make_textured_scene();
  const KeyValues before = fingerprint(scene, bounces);
  change(scene);
  return describe_mismatch(before, fingerprint(scene, bounces));
}

TEST(Fingerprint, TexturesCountWhereLightMeetsThem) {
  const auto repaint = [](Scene& s) {
    std::get<BitmapTexture>(s.textures[0].model).bitmap.texels[1].y = 0.5f;
  };
  EXPECT_EQ(textured_mismatch(repaint, 0), "");
  EXPECT_TRUE(contains(textured_mismatch(repaint, 1), "shape table/diffuse_texture was bitmap 1 2 "));
  const auto move = [](Scene& s) { s.shapes[1].mesh.uvs[0] = {0.5f, 0.5f}; };
  EXPECT_EQ(textured_mismatch(move, 0), "");
  EXPECT_EQ(textured_mismatch(move, 1), "shape table/geometry has changed");
  // Light enters through the albedo of a translucent object always.
  EXPECT_TRUE(contains(textured_mismatch([](Scene& s) { s.textures[1].scale.x = 3; }, 0),
                       "medium wax/albedo_texture was checkerboard"));
  EXPECT_TRUE(contains(textured_mismatch([](Scene& s) { s.subsurface[0].albedo_at_entry = 1; }, 0),
                       "medium wax/surface_albedo was 1 1 1 0.5"));
  EXPECT_EQ(textured_mismatch(
                [](Scene& s) {
                  s.shapes[0].mesh.uvs[0] = {0.5f, 0.5f};
                },
                0),
            "shape candle/geometry has changed");
}

// Opaque shapes reflect about their smooth normals; samples have those of the faces.
TEST(Fingerprint, SmoothNormalsCountOnlyWhereLightBounces) {
  const auto smooth = [](Scene& s) { s.shapes[1].mesh.normals[0] = {0, 0.6f, 0.8f}; };
  EXPECT_EQ(mismatch(smooth, 0), "");
  EXPECT_EQ(mismatch(smooth, 1), "shape table/geometry has changed");
  EXPECT_EQ(mismatch([](Scene& s) { s.shapes[0].mesh.normals = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}}; }, 1), "");
}

TEST(Fingerprint, OpaqueShapesLeaveNoTraceWithoutShadowsAndBounces) {
  const auto move = [](Scene& s) { s.shapes[1].mesh.positions[0].x = 9; };
  EXPECT_EQ(mismatch(move, 0, false), "");
  EXPECT_EQ(mismatch(move, 0, true), "shape table/geometry has changed");
  EXPECT_EQ(mismatch(move, 1, false), "shape table/geometry has changed");
}

TEST(Fingerprint, TellsShapesOfOneNameApart) {
  const auto rename = [](Scene& s) { s.shapes[1].id = s.shapes[0].id = "thing"; };
  Scene scene = make_scene();
  rename(scene);
  const KeyValues before = fingerprint(scene);
  scene.shapes[1].mesh.positions[0].x = 9;
  EXPECT_EQ(describe_mismatch(before, fingerprint(scene)), "shape thing/geometry (2) has changed");
}

TEST(Fingerprint, LongListsAreCut) {
  const std::string text = mismatch([](Scene& s) { s.lights.clear(); });
  EXPECT_TRUE(contains(text, "; and 3 more")) << text;
  EXPECT_FALSE(contains(text, "\n"));
}

TEST(Fingerprint, DigestDependsOnKeysValuesAndTheirBorders) {
  const std::string ab = fingerprint_digest({{"a", "b"}});
  EXPECT_NE(ab, fingerprint_digest({{"ab", ""}}));
  EXPECT_NE(ab, fingerprint_digest({{"", "ab"}}));
  EXPECT_NE(ab, fingerprint_digest({{"b", "a"}}));
  EXPECT_NE(ab, fingerprint_digest({}));
}

TEST(FingerprintBounces, AreThoseItWasMadeWith) {
  Scene scene = make_scene();
  scene.media.push_back(scene.media[0]);  // of the same name
  scene.media.push_back(scene.media[0]);
  scene.media[2].id = "milk";
  EXPECT_EQ(fingerprint_conditions(make_fingerprint(scene, {{3, 0, 7}, true}), 3).bounces,
            (std::vector<int>{3, 0, 7}));
}

TEST(FingerprintConditions, AreThoseItWasMadeWith) {
  const Scene scene = make_scene();
  for (const bool shadows : {false, true})
    for (const bool interreflect : {false, true})
      for (const bool every_eta : {false, true}) {
        const BakeConditions c =
            fingerprint_conditions(make_fingerprint(scene, {{2}, shadows, interreflect, every_eta}), 1);
        EXPECT_EQ(c.shadows, shadows);
        EXPECT_EQ(c.interreflect, interreflect);
        EXPECT_EQ(c.every_eta, every_eta);
      }
}

// Of a cache that serves all of them, the index is none of its business.
TEST(FingerprintConditions, EveryEtaLeavesItOut) {
  const Scene scene = make_scene();
  Scene other = scene;
  other.media[0].int_ior = 1.31f;
  EXPECT_NE(make_fingerprint(scene, {{1}, true}), make_fingerprint(other, {{1}, true}));
  EXPECT_EQ(make_fingerprint(scene, {{1}, true, false, true}),
            make_fingerprint(other, {{1}, true, false, true}));
}

TEST(FingerprintBounces, AreZeroWhereTheFingerprintHasNone) {
  EXPECT_EQ(fingerprint_conditions({}, 2).bounces, (std::vector<int>{0, 0}));
  EXPECT_EQ(fingerprint_conditions({{"medium a/bounces", "-4"}, {"medium b/bounces", "x"}}, 2).bounces,
            (std::vector<int>{0, 0}));
  EXPECT_EQ(fingerprint_conditions({{"medium a/bounces", "1"}, {"medium b/bounces", "2"}}, 1).bounces,
            (std::vector<int>{1}));
}

}  // namespace
}  // namespace nacre
