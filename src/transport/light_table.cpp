// Bounds, powers and distributions of lights.
#include "nacre/transport/light_table.h"

namespace nacre {
namespace {

double mean(const Rgb& c) {
  return (static_cast<double>(c.x) + static_cast<double>(c.y) + static_cast<double>(c.z)) / 3;
}

Distribution triangles_by_area(const Mesh& mesh, const std::string& place) {
  Distribution triangles(triangle_areas(mesh));
  if (!(triangles.total() > 0)) fail(ErrorCode::kValue, place, "this light's shape has no area; remove it");
  return triangles;
}

// The axis of a mesh's normals and how far they turn away from it.
void bound_normals(const Mesh& mesh, LightBound& bound) {
  Vec3d sum(0, 0, 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += Vec3d(area_vector(mesh, t));
  if (!(sum.length() > 0) || !std::isfinite(sum.length())) return;
  const Vec3d axis = sum.normalized();
  bound.axis = Vec3(static_cast<float>(axis.x), static_cast<float>(axis.y), static_cast<float>(axis.z));
  float least = 1;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 normal = face_normal(mesh, t);
    if (normal != Vec3(0, 0, 0)) least = std::min(least, dot(normal, bound.axis));
  }
  bound.normal_angle = std::acos(std::max(least, -1.0f));
}

struct Maker {
  const Scene& scene;
  LightTable& table;
  std::size_t light;
  std::vector<LightBound>& bounds;
  std::vector<std::size_t>& near;
  std::vector<double>& distant_irradiance;

  double weight() const { return static_cast<double>(scene.lights[light].sampling_weight); }
  void add_near(const LightBound& bound) {
    bounds.push_back(bound);
    bounds.back().intensity *= weight();
    near.push_back(light);
  }
  void add_distant(double irradiance) {
    table.distant.push_back(light);
    distant_irradiance.push_back(irradiance * weight());
  }

  void operator()(const PointLight& point) {
    add_near({Box3(point.position), mean(point.intensity), {0, 0, 1}, kPi, 1});
  }
  void operator()(const SpotLight& spot) {
    add_near({Box3(spot.position), mean(spot.intensity), spot.direction, spot.cutoff_angle * kPi / 180, 1});
  }
  void operator()(const AreaLight& area) {
    const Mesh& mesh = scene.shapes[area.shape].mesh;
    table.triangles[light] = triangles_by_area(mesh, scene.lights[light].place);
    LightBound bound{
        nacre::bounds(mesh), mean(area.radiance) * table.triangles[light].total(), {0, 0, 1}, kPi, 0};
    bound_normals(mesh, bound);
    add_near(bound);
  }
  void operator()(const DirectionalLight& directional) { add_distant(mean(directional.irradiance)); }
  void operator()(const ConstantLight& constant) {
    table.environment = light;
    add_distant(kPiD * mean(constant.radiance));
  }
  void operator()(const EnvironmentMap& map) {
    table.environment = light;
    table.map.emplace(map);
    add_distant(table.map->total() / 4);  // the mean over all receivers
  }
};

}  // namespace

LightTable make_light_table(const Scene& scene) {
  LightTable table;
  table.triangles.resize(scene.lights.size());
  std::vector<LightBound> bounds;
  std::vector<std::size_t> near;
  std::vector<double> distant_irradiance;
  for (std::size_t light = 0; light < scene.lights.size(); ++light)
    std::visit(Maker{scene, table, light, bounds, near, distant_irradiance}, scene.lights[light].model);
  table.distant_irradiance = Distribution(distant_irradiance);
  table.near = LightTree(bounds, near, scene.lights.size());
  return table;
}

}  // namespace nacre
