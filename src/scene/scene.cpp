// Names and look-ups in a scene.
#include "nacre/scene/scene.h"

namespace nacre {

int Integrator::bounces() const {
  if (kind == IntegratorKind::kDirect) return 1;
  return max_depth < 0 ? kUnlimitedBounces : std::max(0, max_depth - 2);
}

int irradiance_bounces(const Scene& scene, std::size_t medium, std::optional<int> asked) {
  return asked.value_or(scene.subsurface[medium].indirect ? scene.integrator.bounces() : 0);
}

bool is_delta(const Light& light) {
  return std::holds_alternative<PointLight>(light.model) ||
         std::holds_alternative<DirectionalLight>(light.model) ||
         std::holds_alternative<SpotLight>(light.model);
}

bool is_environment(const Light& light) {
  return std::holds_alternative<ConstantLight>(light.model) ||
         std::holds_alternative<EnvironmentMap>(light.model);
}

std::vector<std::uint32_t> shapes_of_medium(const Scene& scene, std::size_t medium) {
  std::vector<std::uint32_t> indices;
  for (std::uint32_t i = 0; i < scene.shapes.size(); ++i)
    if (scene.shapes[i].medium == static_cast<int>(medium)) indices.push_back(i);
  return indices;
}

std::string light_name(const Scene& scene, std::size_t light) {
  const std::string& id = scene.lights[light].id;
  return id.empty() ? fmt::format("light {}", light + 1) : id;
}

std::string light_plane_name(const Scene& scene, std::size_t light) {
  const std::string& group = scene.lights[light].group;
  return group.empty() ? light_name(scene, light) : group;
}

void scale_light(Light& light, const Rgb& scale) {
  struct Scaler {
    const Rgb& scale;
    void operator()(PointLight& l) const { l.intensity *= scale; }
    void operator()(SpotLight& l) const { l.intensity *= scale; }
    void operator()(DirectionalLight& l) const { l.irradiance *= scale; }
    void operator()(AreaLight& l) const { l.radiance *= scale; }
    void operator()(ConstantLight& l) const { l.radiance *= scale; }
    void operator()(EnvironmentMap& l) const {
      for (Rgb& texel : l.radiance.texels) texel *= scale;
    }
  };
  std::visit(Scaler{scale}, light.model);
}

std::string medium_name(const Scene& scene, std::size_t medium) {
  const std::string& id = scene.media[medium].id;
  return id.empty() ? fmt::format("medium {}", medium + 1) : id;
}

std::string medium_label(const Scene& scene, std::size_t medium) {
  const std::string& id = scene.media[medium].id;
  return id.empty() ? medium_name(scene, medium) : fmt::format("medium '{}'", id);
}

std::size_t find_camera(const Scene& scene, const std::string& id, const std::string& place) {
  std::string known;
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    if (scene.cameras[i].id == id) return i;
    known += (i ? ", '" : "'") + scene.cameras[i].id + "'";
  }
  fail(ErrorCode::kValue, place, "no camera has the id '{}'; there is {}", id, known);
}

}  // namespace nacre
