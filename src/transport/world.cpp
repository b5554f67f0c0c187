// Preparing a scene.
#include "nacre/transport/world.h"

#include "nacre/optics/fresnel.h"

namespace nacre {

World make_world(const Scene& scene, bool shadows) {
  std::vector<const Mesh*> meshes;
  for (const Shape& shape : scene.shapes) meshes.push_back(&shape.mesh);
  World world{&scene, RayTracer(meshes), {}, {}, nullptr, shadows, {}};
  refresh(world);
  return world;
}

namespace {

void make_bsdfs(World& world) {
  const Scene& scene = *world.scene;
  world.bsdfs.clear();
  world.clear_glass.clear();
  world.has_glass = false;
  for (const Shape& shape : scene.shapes) {
    const Bsdf bsdf =
        make_bsdf(shape.surface == kNone ? nullptr : &scene.surfaces[static_cast<std::size_t>(shape.surface)],
                  shape.medium == kNone ? nullptr : &world.media[static_cast<std::size_t>(shape.medium)]);
    const bool glass = bsdf.transmits && !bsdf.rough();
    world.clear_glass.push_back(glass);
    world.has_glass = world.has_glass || glass;
    world.bsdfs.push_back(bsdf);
  }
}

}  // namespace

void refresh(World& world) {
  world.media = world.scene->media;
  world.lights = std::make_shared<const LightTable>(make_light_table(*world.scene));
  make_bsdfs(world);
}

World fill_medium(World world, std::size_t medium, const Medium& material) {
  world.media[medium] = material;
  make_bsdfs(world);
  return world;
}

SurfacePoint surface_point(const World& world, const Hit& hit) noexcept {
  const Mesh& mesh = world.shape(hit).mesh;
  SurfacePoint point{hit_position(mesh, hit), face_normal(mesh, hit.triangle),
                     triangle_extent(mesh, hit.triangle), shading_normal(mesh, hit)};
  if (dot(point.shading_normal, point.geometric_normal) < 0) point.shading_normal = -point.shading_normal;
  return point;
}

Vec3 SurfacePoint::normal_towards(const Vec3& direction) const noexcept {
  constexpr float kGrazing = 1e-3f;  // sine of the least angle between the image and the plane
  const Vec3 plane = geometric_normal * side(direction);
  const Vec3 normal = shading_normal * side(direction);
  const Vec3 image = reflect(direction, normal);
  const float above = dot(image, plane);
  if (above >= kGrazing) return normal;
  // Halfway between the direction and the lifted image.
  return (direction + (image + plane * (kGrazing - above)).normalized()).normalized();
}

}  // namespace nacre
