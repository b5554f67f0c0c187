// <sensor> with its film, filter and sampler, and <integrator>.
#include <algorithm>

#include "scene/elements.h"
#include "scene/parameters.h"

namespace nacre {
namespace {

constexpr int kMaxFilmSide = 65536;
constexpr std::int64_t kMaxFilmPixels = std::int64_t{1} << 28;

void read_filter(const XmlElement& element, Film& film, Warnings& warnings) {
  Parameters parameters(element, warnings);
  const std::string type = plugin_type(element);
  if (type == "box") {
    film.filter = FilterKind::kBox;
    film.filter_radius = parameters.number("radius", 0.5f, {0, 100, true});
  } else {
    film.filter = FilterKind::kGaussian;
    if (type != "gaussian") {
      warnings.push_back(
          fmt::format("{}: rfilter '{}' is not supported (there is box, gaussian): using gaussian",
                      element.place(), element.get("type")));
      return;
    }
    film.filter_stddev = parameters.number("stddev", 0.5f, {0, 25, true});
    film.filter_radius = parameters.number("radius", 4 * film.filter_stddev, {0, 100, true});
  }
  parameters.finish();
}

Film read_film(const XmlElement& element, Warnings& warnings) {
  if (plugin_type(element) != "hdrfilm")
    warnings.push_back(fmt::format("{}: film '{}' is read as hdrfilm", element.place(), element.get("type")));
  Parameters parameters(element, warnings);
  Film film;
  film.width = parameters.integer("width", film.width, 1, kMaxFilmSide);
  film.height = parameters.integer("height", film.height, 1, kMaxFilmSide);
  if (std::int64_t{film.width} * film.height > kMaxFilmPixels)
    fail(ErrorCode::kValue, element.place(), "a film of {} x {} is more than {} pixels", film.width,
         film.height, kMaxFilmPixels);
  for (const XmlElement& child : element.children)
    if (child.tag == "rfilter") read_filter(child, film, warnings);
  parameters.finish({"rfilter"}, {"fileFormat", "pixelFormat", "componentFormat", "banner", "attachLog",
                                  "highQualityEdges"});
  return film;
}

int read_sample_count(const XmlElement& element, Warnings& warnings) {
  Parameters parameters(element, warnings);
  const int count = parameters.integer("sampleCount", 0, 1, 1'000'000);
  parameters.finish({}, {"dimension", "scramble", "seed"});
  return count;
}

// Mitsuba moves and turns cameras, but does not stretch them; mirroring is left alone.
void check_rigid(const Matrix4& to_world, const std::string& place) {
  Vec3d axes[3];
  for (int i = 0; i < 3; ++i) to_world.multDirMatrix(Vec3d(i == 0, i == 1, i == 2), axes[i]);
  for (int i = 0; i < 3; ++i)
    if (!(std::abs(axes[i].length() - 1) < 1e-3) || !(std::abs(axes[i].dot(axes[(i + 1) % 3])) < 1e-3))
      fail(ErrorCode::kValue, place, "toWorld of a sensor must not scale or shear");
  const double distance = to_world.translation().length();
  if (!(distance < kMaxCoordinate))
    fail(ErrorCode::kValue, place, "the sensor is {:g} scene units away", distance);
}

}  // namespace

SensorElement read_sensor(const XmlElement& element, Warnings& warnings) {
  if (plugin_type(element) != "perspective") fail_unknown_type(element, "perspective");
  Parameters parameters(element, warnings);
  SensorElement sensor;
  Camera& camera = sensor.camera;
  camera.id = element.get("id");
  camera.place = element.place();
  camera.to_world = parameters.transform("toWorld");
  check_rigid(camera.to_world, parameters.place("toWorld"));
  if (parameters.has("fov") && parameters.has("focalLength"))
    fail(ErrorCode::kValue, parameters.place("focalLength"), "give either fov or focalLength, not both");
  // A focal length is that of a 36 x 24 mm film, whose diagonal is kept.
  const double half_diagonal = std::hypot(36.0, 24.0) / 2;
  const double focal_length = parameters.length_mm("focalLength", 50);
  camera.fov_axis =
      static_cast<FovAxis>(parameters.choice("fovAxis", {"x", "y", "diagonal", "smaller", "larger"}));
  camera.fov = parameters.number("fov", 0, {0, 180, true});
  if (camera.fov == 0) {
    camera.fov = static_cast<float>(2 * std::atan(half_diagonal / focal_length) * 180 / kPiD);
    camera.fov_axis = FovAxis::kDiagonal;
  }
  camera.near_clip = parameters.number("nearClip", camera.near_clip, kPositive);
  camera.far_clip = parameters.number("farClip", camera.far_clip, kPositive);
  if (camera.near_clip >= camera.far_clip)
    fail(ErrorCode::kValue, parameters.place(parameters.has("farClip") ? "farClip" : "nearClip"),
         "nearClip {} has to be below farClip {}", camera.near_clip, camera.far_clip);

  int films = 0, samplers = 0;
  for (const XmlElement& child : element.children) {
    if (child.tag == "film") sensor.film = read_film(child, warnings);
    if (child.tag == "sampler") sensor.samples_per_pixel = read_sample_count(child, warnings);
    if ((child.tag == "film" && ++films > 1) || (child.tag == "sampler" && ++samplers > 1))
      fail(ErrorCode::kSyntax, child.place(), "a second <{}> in one sensor", child.tag);
  }
  parameters.finish({"film", "sampler"}, {"shutterOpen", "shutterClose", "focusDistance"});
  return sensor;
}

Integrator read_integrator(const XmlElement& element, Warnings& warnings) {
  Parameters parameters(element, warnings);
  const std::string type = plugin_type(element);
  Integrator integrator;
  integrator.kind = type == "direct" ? IntegratorKind::kDirect : IntegratorKind::kPath;
  if (integrator.kind == IntegratorKind::kPath) {
    integrator.max_depth = parameters.integer("maxDepth", -1, -1, kUnlimitedBounces);
    if (integrator.max_depth == 0)
      fail(ErrorCode::kValue, parameters.place("maxDepth"), "maxDepth is 0, it has to be at least 1, or -1");
  }
  if (type == "direct") {
    constexpr int kMostSamples = 1 << 16;
    const int shading_samples = parameters.integer("shadingSamples", 1, 1, kMostSamples);
    integrator.emitter_samples = parameters.integer("emitterSamples", shading_samples, 1, kMostSamples);
  }
  if (type == "direct" || type == "path") {
    parameters.finish({}, {"bsdfSamples", "rrDepth", "strictNormals"});
  } else {
    warnings.push_back(fmt::format("{}: integrator '{}' is not supported (there is direct, path): using path",
                                   element.place(), element.get("type")));
  }
  return integrator;
}

}  // namespace nacre
