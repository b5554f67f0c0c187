// <shape>: mesh files and built-in shapes, brought into world space with the normals that were asked for.
#include <algorithm>
#include <limits>

#include "nacre/geometry/fill_holes.h"
#include "nacre/geometry/mesh_file.h"
#include "nacre/geometry/primitives.h"
#include "nacre/geometry/serialized_file.h"
#include "nacre/geometry/subdivide.h"
#include "scene/elements.h"
#include "scene/parameters.h"
#include "scene/values.h"

namespace nacre {
namespace {

// In the shape's own space; file meshes without normals get them later, in world space.
struct ShapeMesh {
  Mesh mesh;
  bool face_normals = false;  // unless the scene file says otherwise
};

ShapeMesh load_mesh_of_type(Parameters& parameters, const std::string& type, Warnings& warnings) {
  const std::string name = parameters.string("filename", "");
  const std::string place = parameters.place("filename");
  if (name.empty())
    fail(ErrorCode::kSyntax, place, "{} needs <string name=\"filename\" value=\"...\"/>", parameters.name());
  if (!to_lower(name).ends_with("." + type))
    fail(ErrorCode::kValue, place, "'{}' is not a .{} file: {} reads no other", name, type,
         parameters.name());
  const std::string path = resolve_path(name, parameters.plugin());
  try {
    if (type != "serialized") return {load_mesh(path, warnings)};
    const int index = parameters.integer("shapeIndex", 0, 0, std::numeric_limits<int>::max());
    SerializedMesh read = load_serialized_mesh(path, static_cast<std::uint32_t>(index), warnings);
    // Mitsuba counts v of a texture from its upper edge, and these are its own files.
    for (Vec2& uv : read.mesh.uvs) uv.y = 1 - uv.y;
    return {std::move(read.mesh), read.face_normals};
  } catch (const Error& error) {
    if (error.place() != path) throw;
    throw Error(error.code(), place, error.what());
  }
}

Mesh make_built_in_mesh(Parameters& parameters, const std::string& type) {
  const auto to_float = [](const Vec3d& v) {
    return Vec3(static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z));
  };
  if (type == "rectangle") return make_rectangle();
  if (type == "cube") return make_cube();
  if (type == "disk") return make_disk();
  if (type == "cylinder") {
    const Vec3d p0 = parameters.triple("p0", {0, 0, 0}), p1 = parameters.triple("p1", {0, 0, 1});
    const float radius = parameters.number("radius", 1, kPositive);
    return make_cylinder(to_float(p0), to_float(p1), radius, parameters.plugin().place());
  }
  if (type == "sphere") {
    const Vec3d center = parameters.triple("center", {0, 0, 0});
    const double radius = parameters.number("radius", 1, kPositive);
    Mesh mesh = make_sphere();
    Matrix4 placement;
    placement.setScale(radius);
    placement[3][0] = center.x;
    placement[3][1] = center.y;
    placement[3][2] = center.z;
    transform_mesh(mesh, placement, parameters.plugin().place());
    return mesh;
  }
  fail_unknown_type(
      parameters.plugin(),
      "obj, ply, stl, off, serialized, sphere, rectangle, cube, disk, cylinder, shapegroup, instance");
}

ShapeMesh make_mesh(Parameters& parameters, const std::string& type, Warnings& warnings) {
  if (is_mesh_file(type)) return load_mesh_of_type(parameters, type, warnings);
  return {make_built_in_mesh(parameters, type)};
}

constexpr double kMinArea = 1e-30;  // below it single precision has no face normals

}  // namespace

void place_mesh(Mesh& mesh, const Matrix4& to_world, const std::string& transform_place,
                const std::string& place) {
  transform_mesh(mesh, to_world, transform_place);
  for (const Vec3& p : mesh.positions)
    for (int k = 0; k < 3; ++k)
      if (!(std::abs(p[k]) < kMaxVertex))
        fail(ErrorCode::kValue, place,
             "the shape reaches out to {:g} in world space, further than {:g}: choose "
             "larger units",
             std::abs(p[k]), kMaxVertex);
  if (!(surface_area(mesh) > kMinArea))
    fail(ErrorCode::kValue, place, "the shape has no area in world space");
}

bool is_mesh_file(std::string_view type) {
  for (const std::string_view file_type : {"obj", "ply", "stl", "off", "serialized"})
    if (type == file_type) return true;
  return false;
}

Mesh read_mesh(const XmlElement& element, Warnings& warnings, const SubdivisionCharge& charge) {
  Parameters parameters(element, warnings);
  auto [mesh, flat] = make_mesh(parameters, plugin_type(element), warnings);
  const Matrix4 to_world = parameters.transform("toWorld");
  const bool flip = parameters.boolean("flipNormals", false);
  const bool face_normals = parameters.has("faceNormals") ? parameters.boolean("faceNormals", false)
                                                          : flat && !parameters.has("maxSmoothAngle");
  const bool has_angle = parameters.has("maxSmoothAngle");
  const float angle = parameters.number("maxSmoothAngle", 180, {0, 180});
  const bool closes = parameters.boolean("fillHoles", false);
  const int levels = parameters.integer("subdivisions", 0, 0, 6);
  if (face_normals && has_angle)
    fail(ErrorCode::kValue, parameters.place("maxSmoothAngle"),
         "give either faceNormals or maxSmoothAngle, not both");
  // Here v = 0 is the bottom of a picture, which is what Mitsuba's default, true, makes of files.
  const bool upright = parameters.boolean("flipTexCoords", true);
  parameters.finish({"bsdf", "subsurface", "emitter", "ref"}, {"srgb", "collapse"});
  if (!upright)
    for (Vec2& uv : mesh.uvs) uv.y = 1 - uv.y;

  if (closes) fill_holes(mesh, parameters.place("fillHoles"), warnings);
  if (levels > 0) {
    const std::size_t count = mesh.triangles.size();
    charge(count << 2 * levels, is_mesh_file(plugin_type(element)) ? count : 0,
           parameters.place("subdivisions"));
    mesh = subdivide_loop(mesh, levels, parameters.place("subdivisions"), warnings);
  }
  place_mesh(mesh, to_world, parameters.place("toWorld"), element.place());
  if (flip) flip_normals(mesh);
  if (face_normals) {
    mesh.normals.clear();
  } else if (has_angle || mesh.normals.empty()) {
    compute_normals(mesh, angle);
  }
  return mesh;
}

}  // namespace nacre
