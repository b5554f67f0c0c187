// The scene around a single mesh file: cove, lights and camera in proportion to the object.
#include <map>
#include <utility>

#include "nacre/geometry/mesh_file.h"
#include "nacre/geometry/primitives.h"
#include "nacre/geometry/subdivide.h"
#include "nacre/geometry/topology.h"
#include "nacre/scene/scene_file.h"
#include "scene/framing.h"
#include "scene/values.h"

namespace nacre {
namespace {

// Meshes below kCoarse triangles are subdivided until they have kSmooth, if they are sampled from something
// smooth: at most one edge in twenty may fold by more than kSharpFold degrees.
constexpr std::size_t kCoarse = 20'000, kSmooth = 50'000;
constexpr double kSharpFold = 60, kMaxSharpShare = 0.05;

bool is_smooth(const Mesh& mesh) {
  const std::vector<std::uint32_t> weld = weld_map(mesh);
  std::map<std::pair<std::uint32_t, std::uint32_t>, Vec3> first_normal;
  std::size_t edges = 0, sharp = 0;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const Vec3 normal = face_normal(mesh, i);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = weld[mesh.triangles[i][k]], b = weld[mesh.triangles[i][(k + 1) % 3]];
      const auto [edge, is_new] = first_normal.emplace(std::minmax(a, b), normal);
      if (is_new) continue;
      ++edges;
      if (dot(edge->second, normal) < std::cos(kSharpFold * kPiD / 180)) ++sharp;
    }
  }
  return static_cast<double>(sharp) <= kMaxSharpShare * static_cast<double>(edges);
}

// Takes the facets out of a coarse mesh; keeps the normals that the file of a fine one has.
void smooth_mesh(Mesh& mesh, const std::string& path, Warnings& warnings) {
  const bool coarse = mesh.triangles.size() < kCoarse;
  if (coarse && is_smooth(mesh) && analyse_topology(mesh).non_manifold_edges == 0) {
    int levels = 0;
    for (std::size_t count = mesh.triangles.size(); count < kSmooth && levels < 6; count *= 4) ++levels;
    mesh = subdivide_loop(mesh, levels, path, warnings);
  } else if (mesh.normals.empty()) {
    compute_normals(mesh, kSharpFold);
  }
}

// A floor at y = 0 that runs up into a wall without an edge, so that the picture has no horizon. Open in
// front, where it reaches behind the camera.
Mesh make_cove(double size) {
  constexpr int kArcSteps = 64;
  const double half_width = 60 * size, front = 60 * size, back = 7 * size, radius = 5 * size, top = 40 * size;
  std::vector<Vec3d> profile{{0, 0, front}};
  for (int i = 0; i <= kArcSteps; ++i) {
    const double angle = kPiD / 2 * i / kArcSteps;
    profile.emplace_back(0, radius * (1 - std::cos(angle)), -back - radius * std::sin(angle));
  }
  profile.emplace_back(0, top, -back - radius);
  Mesh mesh;
  for (const Vec3d& p : profile)
    for (const double x : {-half_width, half_width})
      mesh.positions.emplace_back(static_cast<float>(x), static_cast<float>(p.y), static_cast<float>(p.z));
  for (std::uint32_t i = 0; i + 3 < mesh.positions.size(); i += 2) {
    mesh.triangles.push_back({i, i + 1, i + 3});
    mesh.triangles.push_back({i, i + 3, i + 2});
  }
  compute_normals(mesh, 180);
  return mesh;
}

void add_floor(Scene& scene, double size) {
  Shape floor;
  floor.id = "floor";
  floor.type = "cove";
  floor.place = scene.path;
  floor.mesh = make_cove(size);
  floor.surface = static_cast<int>(scene.surfaces.size());
  scene.surfaces.push_back({"floor", scene.path, DiffuseSurface{{0.5f, 0.5f, 0.5f}}});
  scene.shapes.push_back(std::move(floor));
}

// A square light at `position` that faces `target` and gives it the irradiance (perpendicular to the way).
void add_light(Scene& scene, const std::string& id, const Vec3d& position, const Vec3d& target,
               double half_side, const Rgb& irradiance) {
  Shape shape;
  shape.id = id;
  shape.type = "rectangle";
  shape.place = scene.path;
  shape.mesh = make_rectangle();
  Matrix4 to_world;
  to_world.setScale(half_side);
  transform_mesh(shape.mesh, to_world * look_at(position, target, {0, 1, 0}).value_or(Matrix4()), scene.path);
  shape.surface = static_cast<int>(scene.surfaces.size());
  shape.light = static_cast<int>(scene.lights.size());
  const double solid_angle = square(2 * half_side) / (target - position).length2();
  scene.surfaces.push_back({id, scene.path, DiffuseSurface{{0, 0, 0}}});
  scene.lights.push_back({id, scene.path,
                          AreaLight{static_cast<std::uint32_t>(scene.shapes.size()),
                                    irradiance / static_cast<float>(solid_angle)}});
  scene.shapes.push_back(std::move(shape));
}

}  // namespace

Scene make_showcase_scene(const std::string& mesh_path, const Medium& medium, double height_mm) {
  if (!(height_mm > 0) || !(height_mm < 1e9))
    fail(ErrorCode::kValue, "--height", "{} mm is not a height: it has to be above 0", height_mm);
  Scene scene;
  scene.path = mesh_path;

  Shape object;
  object.id = "object";
  object.type = "mesh";
  object.place = mesh_path;
  object.medium = 0;
  object.mesh = load_mesh(mesh_path, scene.warnings);
  const Box3 box = bounds(object.mesh);
  const Vec3d extent = Vec3d(box.max) - Vec3d(box.min);
  const double scale = height_mm / extent.y;
  if (!(extent.y > 0) || !(extent.length() * scale < 1e12))
    fail(ErrorCode::kValue, mesh_path, "the mesh is flat: it measures {:g} x {:g} x {:g} and y has to be up",
         extent.x, extent.y, extent.z);
  const Vec3d foot((box.min.x + box.max.x) / 2.0, box.min.y, (box.min.z + box.max.z) / 2.0);
  Matrix4 to_foot, to_height;
  to_foot.setTranslation(-foot);
  to_height.setScale(scale);
  transform_mesh(object.mesh, to_foot * to_height, mesh_path);
  smooth_mesh(object.mesh, mesh_path, scene.warnings);
  const TopologyReport report = analyse_topology(object.mesh);
  if (const std::string problems = describe_problems(report); !problems.empty())
    scene.warnings.push_back(fmt::format(
        "{}: the mesh is translucent, but {}{}", mesh_path, problems,
        report.boundary_edges > 0 && !report.is_sheet() ? "; fillHoles in a scene file closes holes" : ""));

  const Box3 placed = bounds(object.mesh);
  const double size = (Vec3d(placed.max) - Vec3d(placed.min)).length() / 2;
  const Vec3d center(0, height_mm / 2, 0);
  scene.shapes.push_back(std::move(object));
  scene.media.push_back(medium);
  scene.media[0].scale = 1;
  scene.media[0].place = mesh_path;
  scene.subsurface.emplace_back();

  // The key comes from behind, where thin parts let it through; the fill opens the shadows from the front.
  add_floor(scene, size);
  add_light(scene, "key", center + Vec3d(2.6, 2.6, -2.4) * size, center, 0.7 * size, {4.0f, 3.8f, 3.5f});
  add_light(scene, "fill", center + Vec3d(-3.5, 3.0, 4.5) * size, center, 1.8 * size, {1.2f, 1.3f, 1.4f});

  Film film;
  film.width = film.height = 1024;
  Camera camera = make_framing_camera(placed, {0, -0.22, -1}, 28, film);
  camera.id = "camera";
  camera.place = mesh_path;
  scene.cameras.push_back(std::move(camera));
  scene.films.push_back(film);
  scene.integrator.emitter_samples = 4;  // soft shadows on the floor without grain
  return scene;
}

}  // namespace nacre
