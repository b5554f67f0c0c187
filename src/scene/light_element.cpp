// <emitter>: point, directional, area.
#include "scene/elements.h"
#include "scene/parameters.h"

namespace nacre {
namespace {

constexpr Range kEmission{0, 1e30};  // leaves room for sums and squares of distances in single precision

Vec3 to_float(const Vec3d& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

void refuse_both(Parameters& parameters, const char* name) {
  if (parameters.has(name) && parameters.has("toWorld"))
    fail(ErrorCode::kValue, parameters.place("toWorld"), "give either {} or toWorld, not both", name);
}

}  // namespace

Light read_light(const XmlElement& element, Warnings& warnings) {
  Parameters parameters(element, warnings);
  Light light;
  light.id = element.get("id");
  light.place = element.place();
  const std::string type = plugin_type(element);
  if (type == "point") {
    refuse_both(parameters, "position");
    const Vec3d origin = Vec3d(0, 0, 0) * parameters.transform("toWorld");
    const Vec3d position = parameters.triple("position", origin);
    if (!(position.length() < kMaxCoordinate))
      fail(ErrorCode::kValue, element.place(), "the light is {:g} scene units away", position.length());
    light.model = PointLight{to_float(position), parameters.color("intensity", {1, 1, 1}, kEmission)};
  } else if (type == "directional") {
    refuse_both(parameters, "direction");
    Vec3d forward;
    parameters.transform("toWorld").multDirMatrix(Vec3d(0, 0, 1), forward);
    const Vec3d direction = parameters.triple("direction", forward);
    if (!(direction.length() > 0) || !std::isfinite(direction.length()))
      fail(ErrorCode::kValue, element.place(), "the direction of the light has no length");
    light.model = DirectionalLight{to_float(direction.normalized()),
                                   parameters.color("irradiance", {1, 1, 1}, kEmission)};
  } else if (type == "area") {
    fail(ErrorCode::kSyntax, element.place(), "an area emitter has to stand inside the shape that emits");
  } else {
    fail_unknown_type(element, "point, directional, area");
  }
  parameters.finish({}, {"samplingWeight"});
  return light;
}

Rgb read_area_radiance(const XmlElement& element, Warnings& warnings) {
  if (plugin_type(element) != "area") fail_unknown_type(element, "area inside a shape");
  Parameters parameters(element, warnings);
  const Rgb radiance = parameters.color("radiance", {1, 1, 1}, kEmission);
  parameters.finish({}, {"samplingWeight"});
  return radiance;
}

}  // namespace nacre
