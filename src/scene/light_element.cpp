// <emitter>: point, spot, directional, constant, envmap, area.
#include <algorithm>

#include "scene/elements.h"
#include "scene/parameters.h"
#include "scene/values.h"

namespace nacre {
namespace {

constexpr Range kEmission{0, 1e30};  // leaves room for sums and squares of distances in single precision
constexpr Range kWeight{0, 1e9, true};

Vec3 to_float(const Vec3d& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

void refuse_both(Parameters& parameters, const char* name) {
  if (parameters.has(name) && parameters.has("toWorld"))
    fail(ErrorCode::kValue, parameters.place("toWorld"), "give either {} or toWorld, not both", name);
}

Vec3 to_position(const Vec3d& position, const std::string& place) {
  if (!(position.length() < kMaxCoordinate))
    fail(ErrorCode::kValue, place, "the light is {:g} scene units away", position.length());
  return to_float(position);
}

Vec3 to_direction(const Vec3d& direction, const std::string& place) {
  if (!(direction.length() > 0) || !std::isfinite(direction.length()))
    fail(ErrorCode::kValue, place, "the direction of the light has no length");
  return to_float(direction.normalized());
}

PointLight read_point(Parameters& parameters) {
  refuse_both(parameters, "position");
  const Vec3d origin = Vec3d(0, 0, 0) * parameters.transform("toWorld");
  const Vec3d position = parameters.triple("position", origin);
  return {to_position(position, parameters.plugin().place()),
          parameters.color("intensity", {1, 1, 1}, kEmission)};
}

DirectionalLight read_directional(Parameters& parameters) {
  refuse_both(parameters, "direction");
  Vec3d forward;
  parameters.transform("toWorld").multDirMatrix(Vec3d(0, 0, 1), forward);
  const Vec3d direction = parameters.triple("direction", forward);
  return {to_direction(direction, parameters.plugin().place()),
          parameters.color("irradiance", {1, 1, 1}, kEmission)};
}

SpotLight read_spot(Parameters& parameters) {
  for (const XmlElement& child : parameters.plugin().children)
    if (child.tag == "texture" || (child.tag == "ref" && to_lower(child.get("name")) == "texture"))
      fail(ErrorCode::kUnsupported, child.place(), "the texture of a spot is not supported");
  const Matrix4 to_world = parameters.transform("toWorld");
  Vec3d forward;
  to_world.multDirMatrix(Vec3d(0, 0, 1), forward);
  SpotLight spot;
  spot.position = to_position(Vec3d(0, 0, 0) * to_world, parameters.plugin().place());
  spot.direction = to_direction(forward, parameters.plugin().place());
  spot.intensity = parameters.color("intensity", {1, 1, 1}, kEmission);
  spot.cutoff_angle = parameters.number("cutoffAngle", 20, {0, 180, true});
  spot.beam_width = parameters.number("beamWidth", 0.75f * spot.cutoff_angle, {0, 180});
  if (spot.beam_width > spot.cutoff_angle)
    fail(ErrorCode::kValue, parameters.place("beamWidth"), "beamWidth is {}, more than the cutoffAngle of {}",
         spot.beam_width, spot.cutoff_angle);
  return spot;
}

// The rotation of a transform that scales all axes alike; where a light infinitely far away is moved to or
// how large it is does not matter.
Matrix4 read_rotation(Parameters& parameters) {
  const Matrix4 to_world = parameters.transform("toWorld");
  Vec3d axes[3];
  for (int i = 0; i < 3; ++i) to_world.multDirMatrix(Vec3d(i == 0, i == 1, i == 2), axes[i]);
  const double size = axes[0].length();
  for (int i = 0; i < 3; ++i)
    if (!(std::abs(axes[i].length() / size - 1) < 1e-3) ||
        !(std::abs(axes[i].dot(axes[(i + 1) % 3])) < 1e-3 * size * size))
      fail(ErrorCode::kValue, parameters.place("toWorld"), "toWorld of an envmap must not stretch or shear");
  // What rounding left of skewness goes, too.
  const Vec3d x = axes[0].normalized();
  const Vec3d y = (axes[1] - x * axes[1].dot(x)).normalized();
  const Vec3d z = x.cross(y) * (x.cross(y).dot(axes[2]) < 0 ? -1.0 : 1.0);
  Matrix4 rotation;
  for (int k = 0; k < 3; ++k) {
    rotation[0][k] = x[k];
    rotation[1][k] = y[k];
    rotation[2][k] = z[k];
  }
  return rotation;
}

EnvironmentMap read_envmap(Parameters& parameters) {
  const std::string name = parameters.string("filename", "");
  const std::string place = parameters.place("filename");
  if (name.empty())
    fail(ErrorCode::kSyntax, place, "{} needs <string name=\"filename\" value=\"...\"/>", parameters.name());
  const float scale = parameters.number("scale", 1, kEmission);
  const bool has_gamma = parameters.has("gamma");
  const float gamma = parameters.number("gamma", kGammaOfFormat, {-1, 10});
  if (has_gamma && gamma <= 0 && gamma != kGammaSrgb)
    fail(ErrorCode::kValue, parameters.place("gamma"), "gamma is {}, it has to be above 0, or -1 for sRGB",
         gamma);
  parameters.boolean("cache", false);  // of mip maps; there are none here
  EnvironmentMap map;
  map.to_world = read_rotation(parameters);
  const std::string path = resolve_path(name, parameters.plugin());
  map.radiance = load_bitmap(path, place, gamma);
  for (Rgb& texel : map.radiance.texels) {
    // Filters that sharpen leave a little less than nothing beside what is bright.
    for (int k = 0; k < 3; ++k) texel[k] = std::max(0.0f, texel[k] * scale);
    if (!(max_channel(texel) <= static_cast<float>(kEmission.high)))
      fail(ErrorCode::kValue, place, "{}: a radiance is above {:g}", path, kEmission.high);
  }
  return map;
}

}  // namespace

Light read_light(const XmlElement& element, Warnings& warnings) {
  Parameters parameters(element, warnings);
  Light light;
  light.id = element.get("id");
  light.place = element.place();
  light.sampling_weight = parameters.number("samplingWeight", 1, kWeight);
  light.group = parameters.string("group", "");
  const std::string type = plugin_type(element);
  if (type == "point")
    light.model = read_point(parameters);
  else if (type == "spot")
    light.model = read_spot(parameters);
  else if (type == "directional")
    light.model = read_directional(parameters);
  else if (type == "constant")
    light.model = ConstantLight{parameters.color("radiance", {1, 1, 1}, kEmission)};
  else if (type == "envmap")
    light.model = read_envmap(parameters);
  else if (type == "area")
    fail(ErrorCode::kSyntax, element.place(), "an area emitter has to stand inside the shape that emits");
  else
    fail_unknown_type(element, "point, spot, directional, constant, envmap, area");
  parameters.finish();
  return light;
}

Light read_area_light(const XmlElement& element, std::uint32_t shape, Warnings& warnings) {
  if (plugin_type(element) != "area") fail_unknown_type(element, "area inside a shape");
  Parameters parameters(element, warnings);
  Light light;
  light.id = element.get("id");
  light.place = element.place();
  light.model = AreaLight{shape, parameters.color("radiance", {1, 1, 1}, kEmission)};
  light.sampling_weight = parameters.number("samplingWeight", 1, kWeight);
  light.group = parameters.string("group", "");
  parameters.finish();
  return light;
}

}  // namespace nacre
