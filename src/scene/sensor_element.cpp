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
  } else if (type == "tent") {
    film.filter = FilterKind::kTent;
    film.filter_radius = 1;
  } else if (type == "mitchell") {
    film.filter = FilterKind::kMitchell;
    film.filter_radius = 2;
    film.filter_b = parameters.number("B", film.filter_b, kFraction);
    film.filter_c = parameters.number("C", film.filter_c, kFraction);
  } else {
    film.filter = FilterKind::kGaussian;
    if (type != "gaussian") {
      warnings.push_back(
          fmt::format("{}: rfilter '{}' is not supported (there is box, tent, gaussian, mitchell): using "
                      "gaussian",
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

// Mitsuba moves and turns cameras, but stretches only the picture of an orthographic one; mirroring is left
// alone.
void check_transform(const Camera& camera, const std::string& place) {
  const bool scaled = camera.kind == CameraKind::kOrthographic;
  Vec3d axes[3];
  for (int i = 0; i < 3; ++i) {
    camera.to_world.multDirMatrix(Vec3d(i == 0, i == 1, i == 2), axes[i]);
    const double length = axes[i].length();
    if (!scaled && !(std::abs(length - 1) < 1e-3))
      fail(ErrorCode::kValue, place, "toWorld of a sensor must not scale or shear");
    if (!(length > 1 / kMaxCoordinate && length < kMaxCoordinate))
      fail(ErrorCode::kValue, place, "toWorld scales a sensor by {:g}", length);
    axes[i] /= length;
  }
  for (int i = 0; i < 3; ++i)
    if (!(std::abs(axes[i].dot(axes[(i + 1) % 3])) < 1e-3))
      fail(ErrorCode::kValue, place, "toWorld of a sensor must not {}shear", scaled ? "" : "scale or ");
  const double distance = camera.to_world.translation().length();
  if (!(distance < kMaxCoordinate))
    fail(ErrorCode::kValue, place, "the sensor is {:g} scene units away", distance);
}

void read_field_of_view(Parameters& parameters, Camera& camera) {
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
}

void read_clip_planes(Parameters& parameters, Camera& camera) {
  camera.near_clip = parameters.number("nearClip", camera.near_clip, kPositive);
  camera.far_clip = parameters.number("farClip", camera.far_clip, kPositive);
  if (camera.near_clip >= camera.far_clip)
    fail(ErrorCode::kValue, parameters.place(parameters.has("farClip") ? "farClip" : "nearClip"),
         "nearClip {} has to be below farClip {}", camera.near_clip, camera.far_clip);
}

void read_lens(Parameters& parameters, Camera& camera) {
  if (!parameters.has("apertureRadius"))
    fail(ErrorCode::kSyntax, parameters.plugin().place(),
         "a thinlens needs its apertureRadius, in scene units");
  constexpr double kMaxLength = 1e15;
  camera.aperture_radius = parameters.number("apertureRadius", 0, {0, kMaxLength, true});
  camera.focus_distance = parameters.number("focusDistance", camera.far_clip, {1e-15, kUnbounded});
}

CameraKind camera_kind(const XmlElement& element) {
  const std::string type = plugin_type(element);
  if (type == "perspective") return CameraKind::kPerspective;
  if (type == "thinlens") return CameraKind::kThinLens;
  if (type == "orthographic") return CameraKind::kOrthographic;
  fail_unknown_type(element, "perspective, thinlens, orthographic");
}

}  // namespace

SensorElement read_sensor(const XmlElement& element, Warnings& warnings) {
  SensorElement sensor;
  Camera& camera = sensor.camera;
  camera.kind = camera_kind(element);
  Parameters parameters(element, warnings);
  camera.id = element.get("id");
  camera.place = element.place();
  camera.to_world = parameters.transform("toWorld");
  check_transform(camera, parameters.place("toWorld"));
  if (camera.kind != CameraKind::kOrthographic) read_field_of_view(parameters, camera);
  read_clip_planes(parameters, camera);
  if (camera.kind == CameraKind::kThinLens) read_lens(parameters, camera);

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
