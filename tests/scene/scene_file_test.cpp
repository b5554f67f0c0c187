// label: unit
// Scene files as a whole: shapes, surfaces, lights, cameras, references, and what is warned of.
#include "scene/scene_text.h"

namespace nacre {
namespace {

constexpr const char* kShape = "<shape type=\"rectangle\"/>";

template <class Model>
const Model& surface_model(const Scene& scene, std::size_t shape) {
  return std::get<Model>(scene.surfaces.at(static_cast<std::size_t>(scene.shapes.at(shape).surface)).model);
}

template <class Function>
Error error_of(const Function& function) {
  try {
    function();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return {ErrorCode::kIo, "", ""};
}

TEST(SceneFile, TheSmallestSceneHasDefaultsAndWarnings) {
  const Scene scene = scene_of(kShape);
  ASSERT_EQ(scene.shapes.size(), 1u);
  EXPECT_EQ(scene.shapes[0].id, "shape 1");
  EXPECT_EQ(scene.shapes[0].type, "rectangle");
  EXPECT_EQ(surface_model<DiffuseSurface>(scene, 0).reflectance, Rgb(0.5f));
  EXPECT_EQ(scene.cameras.size(), 1u);
  EXPECT_EQ(scene.films.size(), 1u);
  EXPECT_EQ(scene.integrator.kind, IntegratorKind::kDirect);
  EXPECT_EQ(count_warnings(scene, "no <emitter>"), 1);
  EXPECT_EQ(count_warnings(scene, "no <sensor>"), 1);
  EXPECT_EQ(scene.warnings.size(), 2u);
}

TEST(SceneFile, ShapesStandWhereToWorldPutsThem) {
  const Scene scene = scene_of(R"(
    <shape type="sphere"><point name="center" x="1" y="2" z="3"/><float name="radius" value="0.5"/>
      <transform name="to_world"><scale value="2"/></transform></shape>
    <shape type="cube" id="box"/>
    <shape type="disk"><transform name="toWorld"><rotate x="1" angle="-90"/></transform></shape>
    <shape type="cylinder"><point name="p1" value="0, 4, 0"/><float name="radius" value="2"/></shape>)");
  const Box3 sphere = bounds(scene.shapes[0].mesh);
  EXPECT_NEAR(sphere.min.x, 1, 1e-3);
  EXPECT_NEAR(sphere.max.z, 7, 1e-3);
  EXPECT_EQ(scene.shapes[1].id, "box");
  EXPECT_EQ(bounds(scene.shapes[1].mesh).min, Vec3(-1, -1, -1));
  EXPECT_EQ(scene.shapes[2].id, "shape 3");
  EXPECT_NEAR(face_normal(scene.shapes[2].mesh, 0).y, 1, 1e-6);
  EXPECT_NEAR(surface_area(scene.shapes[3].mesh), 2 * kPiD * 2 * 4, 0.05);
}

TEST(SceneFile, FlipNormalsTurnsFacesAndShadingNormals) {
  const Scene scene =
      scene_of(R"(<shape type="rectangle"><boolean name="flip_normals" value="true"/></shape>)");
  EXPECT_EQ(face_normal(scene.shapes[0].mesh, 0), Vec3(0, 0, -1));
  EXPECT_EQ(scene.shapes[0].mesh.normals.at(0), Vec3(0, 0, -1));
}

TEST(SceneFile, NormalsAreSmoothUnlessAskedOtherwise) {
  const SceneFolder folder;
  folder.write("m/tent.obj", "v 0 0 0\nv 1 0 1\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 4 2\n");
  const auto load = [&](const std::string& parameters) {
    return load_scene(folder.write("s.xml", R"(<scene><shape type="obj">
                                                <string name="filename" value="m/tent.obj"/>)" +
                                                parameters + "</shape></scene>"))
        .shapes[0]
        .mesh;
  };
  EXPECT_EQ(load("").positions.size(), 4u);
  EXPECT_EQ(load("").normals.size(), 4u);
  EXPECT_TRUE(load(R"(<boolean name="faceNormals" value="true"/>)").normals.empty());
  const Mesh creased = load(R"(<float name="maxSmoothAngle" value="10"/>)");
  EXPECT_EQ(creased.positions.size(), 6u);
  EXPECT_EQ(load(R"(<integer name="subdivisions" value="2"/>)").triangles.size(), 32u);
}

TEST(SceneFile, AMissingMeshNamesItsLineAndIsRelativeToTheFileThatNamesIt) {
  const SceneFolder folder;
  folder.write("sub/inner.xml",
               "<scene>\n<shape type=\"ply\"><string name=\"filename\" value=\"a.ply\"/></shape></scene>");
  const std::string main = folder.write("main.xml", R"(<scene><include filename="sub/inner.xml"/></scene>)");
  const Error error = error_of([&] { load_scene(main); });
  EXPECT_EQ(error.code(), ErrorCode::kNotFound);
  EXPECT_EQ(error.place(), folder.path() + "/sub/inner.xml:2");
  EXPECT_NE(error.reason().find(folder.path() + "/sub/a.ply"), std::string::npos);
}

TEST(SceneFile, ReferencesShareAndOrderDoesNotMatter) {
  const Scene scene = scene_of(R"(
    <subsurface type="dipole" id="unused"><float name="scale" value="1"/></subsurface>
    <subsurface type="dipole" id="milk"><string name="material" value="Wholemilk"/></subsurface>
    <shape type="cube"><ref id="milk"/><ref id="coat"/></shape>
    <shape type="cube"><subsurface type="dipole"><string name="material" value="Marble"/></subsurface></shape>
    <shape type="cube"><ref name="subsurface" id="milk"/></shape>
    <shape type="rectangle"><ref id="coat"/></shape>
    <bsdf type="plastic" id="coat"><rgb name="diffuseReflectance" value="0"/></bsdf>)");
  ASSERT_EQ(scene.media.size(), 2u);
  EXPECT_EQ(scene.subsurface.size(), 2u);
  EXPECT_EQ(scene.media[0].material, "Wholemilk");
  EXPECT_EQ(scene.shapes[0].medium, 0);
  EXPECT_EQ(scene.shapes[1].medium, 1);
  EXPECT_EQ(scene.shapes[2].medium, 0);
  EXPECT_EQ(scene.shapes[2].surface, kNone);
  ASSERT_EQ(scene.surfaces.size(), 1u);
  EXPECT_EQ(scene.shapes[0].surface, scene.shapes[3].surface);
  EXPECT_EQ(surface_model<PlasticSurface>(scene, 3).int_ior, 1.49f);
  EXPECT_EQ(count_warnings(scene, "no shape uses the subsurface 'unused'"), 1);
  EXPECT_EQ(medium_name(scene, 1), "medium 2");
}

TEST(SceneFile, WhatIsNotUsedIsCheckedAllTheSame) {
  EXPECT_THROW(scene_of(std::string(kShape) + R"(<bsdf type="ward" id="a"/>)"), Error);
  EXPECT_THROW(scene_of(std::string(kShape) + R"(<texture type="curvature" id="a"/>)"), Error);
  EXPECT_THROW(scene_of(std::string(kShape) + R"(<subsurface type="other" id="a"/>)"), Error);
}

TEST(SceneFile, Surfaces) {
  const Scene scene = scene_of(R"(
    <shape type="cube"><bsdf type="diffuse"><srgb name="reflectance" value="0.5"/></bsdf></shape>
    <shape type="cube"><bsdf type="dielectric"><string name="intIOR" value="water"/></bsdf></shape>
    <shape type="cube"><bsdf type="plastic"><boolean name="nonlinear" value="TRUE"/>
      <float name="extIOR" value="1"/></bsdf></shape>
    <shape type="cube"><bsdf type="Diffuse"><rgb name="diffuseReflectance" value="0.2"/></bsdf></shape>)");
  EXPECT_NEAR(surface_model<DiffuseSurface>(scene, 0).reflectance.y, 0.2140411f, 1e-6);
  EXPECT_EQ(surface_model<DielectricSurface>(scene, 1).int_ior, 1.333f);
  EXPECT_EQ(surface_model<DielectricSurface>(scene, 1).ext_ior, 1.000277f);
  EXPECT_TRUE(surface_model<PlasticSurface>(scene, 2).nonlinear);
  EXPECT_EQ(surface_model<PlasticSurface>(scene, 2).ext_ior, 1);
  EXPECT_EQ(surface_model<DiffuseSurface>(scene, 3).reflectance, Rgb(0.2f));
}

TEST(SceneFile, Lights) {
  const Scene scene = scene_of(R"(
    <emitter type="point" id="bulb"><transform name="toWorld"><translate y="5"/></transform>
      <rgb name="intensity" value="1 2 3"/></emitter>
    <emitter type="directional"><vector name="direction" x="0" y="-2" z="0"/>
      <spectrum name="irradiance" value="4"/></emitter>
    <shape type="disk" id="lamp"><emitter type="area"><rgb name="radiance" value="7"/></emitter></shape>
    <emitter type="directional"><transform name="toWorld"><lookat origin="0 3 0" target="0 0 0" up="1 0 0"/>
      </transform></emitter>)");
  ASSERT_EQ(scene.lights.size(), 4u);
  const auto& point = std::get<PointLight>(scene.lights[0].model);
  EXPECT_EQ(point.position, Vec3(0, 5, 0));
  EXPECT_EQ(point.intensity, Rgb(1, 2, 3));
  const auto& sun = std::get<DirectionalLight>(scene.lights[1].model);
  EXPECT_EQ(sun.direction, Vec3(0, -1, 0));
  EXPECT_EQ(sun.irradiance, Rgb(4));
  const auto& area = std::get<AreaLight>(scene.lights[2].model);
  EXPECT_EQ(area.shape, 0u);
  EXPECT_EQ(area.radiance, Rgb(7));
  EXPECT_EQ(scene.shapes[0].light, 2);
  EXPECT_EQ(surface_model<DiffuseSurface>(scene, 0).reflectance, Rgb(0.0f));
  EXPECT_EQ(std::get<DirectionalLight>(scene.lights[3].model).direction, Vec3(0, -1, 0));
  EXPECT_EQ(light_name(scene, 0), "bulb");
  EXPECT_EQ(light_name(scene, 1), "light 2");
  EXPECT_EQ(light_name(scene, 2), "lamp");
  EXPECT_EQ(count_warnings(scene, "no <emitter>"), 0);
}

TEST(SceneFile, Sensors) {
  const Scene scene = scene_of(std::string(kShape) + R"(
    <sensor type="perspective" id="front"><float name="fov" value="30"/><string name="fovAxis" value="smaller"/>
      <float name="nearClip" value="0.5"/><float name="farClip" value="50"/>
      <sampler type="ldsampler"><integer name="sampleCount" value="64"/></sampler>
      <film type="hdrfilm"><integer name="width" value="320"/><integer name="height" value="240"/>
        <string name="pixelFormat" value="rgb"/><boolean name="banner" value="false"/>
        <rfilter type="box"/></film></sensor>
    <sensor type="perspective"><sampler type="independent"><integer name="sampleCount" value="4"/></sampler>
      <film type="hdrfilm"><rfilter type="gaussian"><float name="stddev" value="0.4"/></rfilter></film></sensor>
    <sensor type="perspective" id="tele"><string name="focalLength" value="100mm"/></sensor>)");
  ASSERT_EQ(scene.cameras.size(), 3u);
  ASSERT_EQ(scene.films.size(), 3u);
  EXPECT_EQ(scene.cameras[0].id, "front");
  EXPECT_EQ(scene.cameras[0].fov, 30);
  EXPECT_EQ(scene.cameras[0].fov_axis, FovAxis::kSmaller);
  EXPECT_EQ(scene.cameras[0].near_clip, 0.5f);
  EXPECT_EQ(scene.cameras[0].far_clip, 50);
  EXPECT_EQ(scene.films[0].width, 320);
  EXPECT_EQ(scene.films[0].filter, FilterKind::kBox);
  EXPECT_EQ(scene.films[0].filter_radius, 0.5f);
  EXPECT_EQ(scene.films[1].width, 768);
  EXPECT_EQ(scene.films[1].filter, FilterKind::kGaussian);
  EXPECT_EQ(scene.films[1].filter_radius, 1.6f);
  EXPECT_EQ(scene.samples_per_pixel, 64);
  EXPECT_EQ(count_warnings(scene, "sampleCount 4 is ignored"), 1);
  // 50 mm and the 43.27 mm diagonal of 36 x 24 mm film.
  EXPECT_EQ(scene.cameras[1].fov_axis, FovAxis::kDiagonal);
  EXPECT_NEAR(scene.cameras[1].fov, 46.793, 1e-3);
  EXPECT_NEAR(scene.cameras[2].fov, 2 * std::atan(std::hypot(36, 24) / 200) * 180 / kPiD, 1e-4);
  EXPECT_EQ(find_camera(scene, "tele", "--camera"), 2u);
  EXPECT_EQ(find_camera(scene, "camera 2", "--camera"), 1u);
  EXPECT_STREQ(error_of([&] { find_camera(scene, "side", "--camera"); }).what(),
               "--camera: no camera has the id 'side'; there is 'front', 'camera 2', 'tele'");
}

TEST(SceneFile, IntegratorsAndTheirBounces) {
  const auto integrator = [](const std::string& text) { return scene_of(kShape + text).integrator; };
  EXPECT_EQ(integrator(R"(<integrator type="direct"/>)").bounces(), 1);
  EXPECT_EQ(integrator(R"(<integrator type="path"/>)").bounces(), kUnlimitedBounces);
  const auto path = [&](int depth) {
    return integrator(
        fmt::format(R"(<integrator type="path"><integer name="max_depth" value="{}"/></integrator>)", depth));
  };
  EXPECT_EQ(path(1).bounces(), 0);
  EXPECT_EQ(path(2).bounces(), 0);
  EXPECT_EQ(path(5).bounces(), 3);
  const Scene volume = scene_of(std::string(kShape) + R"(<integrator type="volpath"/>)");
  EXPECT_EQ(volume.integrator.kind, IntegratorKind::kPath);
  EXPECT_EQ(count_warnings(volume, "integrator 'volpath' is not supported"), 1);
}

TEST(SceneFile, UnknownParametersAreWarnedOfWithTheKnownOnes) {
  const Scene scene = scene_of(R"(<shape type="disk">
<float name="radiuss" value="2"/></shape>)");
  EXPECT_EQ(count_warnings(scene,
                           "scene.xml:3: shape 'disk' has no parameter 'radiuss', ignored (there are: "
                           "toWorld, flipNormals, faceNormals, maxSmoothAngle, fillHoles, subdivisions, "
                           "flipTexCoords)"),
            1);
}

TEST(SceneFile, TranslucentMeshesWithHolesAreWarnedOfOpaqueOnesAreNot) {
  const std::string medium = R"(<subsurface type="dipole"><float name="scale" value="1"/></subsurface>)";
  EXPECT_EQ(count_warnings(scene_of("<shape type=\"disk\">" + medium + "</shape>"),
                           "scene.xml:2: shape 1 is translucent, but "),
            1);
  EXPECT_EQ(count_warnings(scene_of("<shape type=\"disk\"/>"), "translucent"), 0);
  for (const char* closed : {"sphere", "cube"})
    EXPECT_EQ(
        count_warnings(scene_of(fmt::format("<shape type=\"{}\">{}</shape>", closed, medium)), "translucent"),
        0);
  EXPECT_EQ(count_warnings(scene_of("<shape type=\"sphere\"><boolean name=\"flipNormals\" value=\"true\"/>" +
                                    medium + "</shape>"),
                           "translucent"),
            1);
}

TEST(SceneFile, ADielectricOfAnotherIndexThanItsMediumIsWarnedOf) {
  const auto warnings = [](const std::string& ior) {
    return count_warnings(
        scene_of("<shape type=\"cube\"><bsdf type=\"dielectric\"><float name=\"extIOR\" value=\"1\"/>"
                 "<float name=\"intIOR\" value=\"" +
                 ior + "\"/></bsdf><subsurface type=\"dipole\"/></shape>"),
        "of the dielectric is ignored");
  };
  EXPECT_EQ(warnings("1.5"), 1);
  EXPECT_EQ(warnings("1.3"), 0);
}

TEST(SceneFile, TheDefaultCameraSeesAllCornersOfTheObject) {
  const Scene scene = scene_of(R"(<shape type="cube">
      <transform name="toWorld"><scale x="3"/><translate x="100" y="-7"/></transform></shape>)");
  const Camera& camera = scene.cameras[0];
  const double tan_x = std::tan(camera.fov * kPiD / 360), tan_y = tan_x * 576 / 768;
  double largest = 0;
  for (const Vec3& p : scene.shapes[0].mesh.positions) {
    const Vec3d seen = Vec3d(p) * camera.to_world.inverse();
    EXPECT_GT(seen.z, camera.near_clip);
    EXPECT_LT(seen.z, camera.far_clip);
    largest = std::max({largest, std::abs(seen.x) / seen.z / tan_x, std::abs(seen.y) / seen.z / tan_y});
  }
  EXPECT_LT(largest, 1);
  EXPECT_GT(largest, 0.7);
}

}  // namespace
}  // namespace nacre
