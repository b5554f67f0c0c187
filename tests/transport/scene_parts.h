// Small scenes put together in code.
#pragma once

#include <utility>

#include "nacre/geometry/mesh.h"
#include "nacre/geometry/primitives.h"
#include "nacre/scene/scene.h"

namespace nacre::testing_support {

/// Scales each axis, then moves.
inline Mesh placed(Mesh mesh, const Vec3& size, const Vec3& centre) {
  for (Vec3& p : mesh.positions) p = p * size + centre;
  for (Vec3& n : mesh.normals) n = (n / size).normalized();
  return mesh;
}
inline Mesh placed(Mesh mesh, float size, const Vec3& centre) {
  return placed(std::move(mesh), Vec3(size, size, size), centre);
}
inline Mesh flipped(Mesh mesh) {
  flip_normals(mesh);
  return mesh;
}

inline void add_shape(Scene& scene, Mesh mesh, int surface = kNone, int medium = kNone) {
  Shape shape;
  shape.id = "shape " + std::to_string(scene.shapes.size() + 1);
  shape.mesh = std::move(mesh);
  shape.surface = surface;
  shape.medium = medium;
  scene.shapes.push_back(std::move(shape));
}

inline int add_diffuse(Scene& scene, const Rgb& reflectance) {
  scene.surfaces.push_back({"", "", DiffuseSurface{reflectance}});
  return static_cast<int>(scene.surfaces.size()) - 1;
}

/// A shape that emits and reflects nothing.
inline void add_area_light(Scene& scene, Mesh mesh, const Rgb& radiance) {
  add_shape(scene, std::move(mesh), add_diffuse(scene, Rgb(0, 0, 0)));
  scene.shapes.back().light = static_cast<int>(scene.lights.size());
  scene.lights.push_back({"", "", AreaLight{static_cast<std::uint32_t>(scene.shapes.size() - 1), radiance}});
}
inline void add_point_light(Scene& scene, const Vec3& position, const Rgb& intensity) {
  scene.lights.push_back({"", "", PointLight{position, intensity}});
}
inline void add_directional_light(Scene& scene, const Vec3& direction, const Rgb& irradiance) {
  scene.lights.push_back({"", "", DirectionalLight{direction.normalized(), irradiance}});
}

inline void add_constant_light(Scene& scene, const Rgb& radiance) {
  scene.lights.push_back({"", "", ConstantLight{radiance}});
}

inline int add_medium(Scene& scene, const Medium& medium) {
  scene.media.push_back(medium);
  scene.subsurface.emplace_back();
  return static_cast<int>(scene.media.size()) - 1;
}

}  // namespace nacre::testing_support
