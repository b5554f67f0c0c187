// A scene as plain data: shapes in world space, media, surfaces, lights, cameras, film. What a scene file
// means, no more.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "nacre/base/error.h"
#include "nacre/base/math.h"
#include "nacre/geometry/mesh.h"
#include "nacre/optics/medium.h"
#include "nacre/scene/bitmap.h"
#include "nacre/scene/texture.h"

namespace nacre {

inline constexpr int kNone = -1;

/// GGX roughness along the tangent (the direction in which u grows) and across it; 0: smooth.
struct Roughness {
  float u = 0, v = 0;
};

/// Lambertian: albedo / pi. One-sided as in Mitsuba: black from behind.
struct DiffuseSurface {
  Rgb reflectance{0.5f, 0.5f, 0.5f};
};
/// Dielectric boundary: on a translucent shape the boundary of the medium, else clear glass.
struct DielectricSurface {
  float int_ior = 1.5046f, ext_ior = 1.000277f;
  Rgb specular_reflectance{1, 1, 1}, specular_transmittance{1, 1, 1};
  Roughness roughness{};
};
/// Dielectric coat over a diffuse base.
struct PlasticSurface {
  float int_ior = 1.49f, ext_ior = 1.000277f;
  Rgb diffuse_reflectance{0.5f, 0.5f, 0.5f}, specular_reflectance{1, 1, 1};
  bool nonlinear = false;
  Roughness roughness{};
};
/// Metal. Its complex index is eta + i k, relative to what is outside.
struct ConductorSurface {
  Rgb eta{0, 0, 0}, k{1, 1, 1};
  Rgb specular_reflectance{1, 1, 1};
  Roughness roughness{};
};
/// Indices into Scene::textures. Where there is one, it multiplies the colour of that name in the model.
struct SurfaceTextures {
  int diffuse = kNone;  // of DiffuseSurface::reflectance, too
  int specular_reflectance = kNone, specular_transmittance = kNone;
};
struct Surface {
  std::string id, place;
  std::variant<DiffuseSurface, DielectricSurface, PlasticSurface, ConductorSurface> model;
  SurfaceTextures textures{};
  bool two_sided = false;  // the back looks like the front
};

/// How the samples of one subsurface element are to be made, next to its Medium.
struct SubsurfaceSettings {
  int irradiance_samples = 0;   // per light; 0: nacre's default
  bool indirect = true;         // irrIndirect
  float sample_multiplier = 1;  // times the default number of samples
  /// Reflectance of the surface itself, which colours light on its way in, by albedo^albedo_at_entry, and on
  /// its way out, by albedo^(1 - albedo_at_entry).
  Rgb surface_albedo{1, 1, 1};
  int albedo_texture = kNone;  // index into Scene::textures; multiplies surface_albedo
  float albedo_at_entry = 0.5f;
};

/// Emission of light. Positions and directions in world space; spectra are scene-linear rgb.
struct PointLight {
  Vec3 position;
  Rgb intensity;  // per steradian
};
struct DirectionalLight {
  Vec3 direction;  // of travel, unit length
  Rgb irradiance;  // perpendicular to it
};
/// A point that sends `intensity` into the directions less than beam_width from its axis, and from there to
/// cutoff_angle ever less, in proportion to the angle that is left.
struct SpotLight {
  Vec3 position;
  Vec3 direction;                            // of its axis, unit length
  Rgb intensity;                             // per steradian
  float cutoff_angle = 20, beam_width = 15;  // degrees from the axis
};
/// The same radiance from every direction, infinitely far away.
struct ConstantLight {
  Rgb radiance;
};
/// Radiance from infinitely far away by direction: a picture of all directions. In its own space +y is the
/// upper edge, -z the left and the right one, +z the middle and +x a quarter from the left. Bilinear between
/// the texels' centres.
struct EnvironmentMap {
  Bitmap radiance;   // its scale included
  Matrix4 to_world;  // orthonormal; may mirror
};
/// Every point of a shape's front side emits.
struct AreaLight {
  std::uint32_t shape;  // index into Scene::shapes
  Rgb radiance;
};
struct Light {
  std::string id, place;
  std::variant<PointLight, DirectionalLight, AreaLight, SpotLight, ConstantLight, EnvironmentMap> model;
  float sampling_weight = 1;  // times the probability to be chosen, where lights are chosen
  std::string group = {};     // lights of one group are kept and scaled as one; empty: by itself
};
/// Whether light arrives from a single direction.
bool is_delta(const Light& light);
/// Whether it is a constant light or an environment map, of which a scene has at most one.
bool is_environment(const Light& light);

struct Shape {
  std::string id;     // from the file, else "shape 1", "shape 2", ... in order of appearance
  std::string type;   // "obj", "sphere", ...
  std::string place;  // "file:line"
  Mesh mesh;          // world space
  int surface =
      kNone;  // index into Scene::surfaces; kNone on a translucent shape: smooth boundary of the medium's eta
  int medium = kNone;  // index into Scene::media
  int light = kNone;   // index into Scene::lights (an AreaLight)
};

enum class CameraKind { kPerspective, kThinLens, kOrthographic };
enum class FovAxis { kX, kY, kDiagonal, kSmaller, kLarger };

/// Mitsuba's camera space: looks along +z, +y up, +x to the left of the picture.
struct Camera {
  std::string id, place;
  /// Rigid, perhaps mirroring. Of kOrthographic it also scales the picture, which spans [-1, 1] in x.
  Matrix4 to_world;
  CameraKind kind = CameraKind::kPerspective;
  float fov = 39.3077f;  // full angle along fov_axis, degrees; not of kOrthographic
  FovAxis fov_axis = FovAxis::kX;
  float near_clip = 1e-2f, far_clip = 1e4f;
  // kThinLens: radius of the lens, and distance along the axis at which things are sharp.
  float aperture_radius = 0, focus_distance = 1e4f;
};

enum class FilterKind { kBox, kTent, kGaussian, kMitchell };
struct Film {
  int width = 768, height = 576;
  FilterKind filter = FilterKind::kGaussian;
  float filter_radius = 2;                         // pixels; where the filter ends
  float filter_stddev = 0.5f;                      // kGaussian
  float filter_b = 1 / 3.0f, filter_c = 1 / 3.0f;  // kMitchell: Mitchell & Netravali 1988
};

/// What Integrator::bounces() returns for a path without limit.
inline constexpr int kUnlimitedBounces = 1'000'000;

enum class IntegratorKind { kDirect, kPath };
struct Integrator {
  IntegratorKind kind = IntegratorKind::kDirect;
  int emitter_samples = 1;  // connections to each light with an extent from every shaded point
  int max_depth = -1;       // kPath: longest path in edges, camera to light; -1: no limit. 1 is emission seen
                            // directly, 2 direct light
  /// Bounces of surface light that reach a translucent surface: 1 for direct, max_depth - 2 (at least 0) or
  /// kUnlimitedBounces for path.
  int bounces() const;
};

struct Scene {
  std::string path;                  // of the file it came from
  std::vector<std::string> sources;  // that one and what it includes, if it is XML
  std::vector<std::string> files;    // what is named in them
  std::vector<Shape> shapes;
  std::vector<Medium> media;
  std::vector<SubsurfaceSettings> subsurface;  // parallel to media
  std::vector<Surface> surfaces;
  std::vector<Texture> textures;
  std::vector<Light> lights;
  std::vector<Camera> cameras;  // at least one; the first is the default. Film belongs to all of them
  std::vector<Film> films;      // parallel to cameras
  int samples_per_pixel = 16;
  Integrator integrator;
  Warnings warnings;
};

/// Bounces of light off opaque surfaces before it enters a medium: `asked` for, else by the integrator unless
/// the medium wants direct light only.
int irradiance_bounces(const Scene& scene, std::size_t medium, std::optional<int> asked);
/// Indices of the shapes that a medium fills, in order.
std::vector<std::uint32_t> shapes_of_medium(const Scene& scene, std::size_t medium);
/// Name for messages: id or "light 2".
std::string light_name(const Scene& scene, std::size_t light);
/// Name by which a bake keeps a light apart from others: its group, or its own.
std::string light_plane_name(const Scene& scene, std::size_t light);
/// Multiplies what a light emits.
void scale_light(Light& light, const Rgb& scale);
std::string medium_name(const Scene& scene, std::size_t medium);
/// The same as part of a sentence: "medium 'wax'" or "medium 2".
std::string medium_label(const Scene& scene, std::size_t medium);
/// Index of the camera with that id. Throws Error(kValue, place) that lists the ids there are.
std::size_t find_camera(const Scene& scene, const std::string& id, const std::string& place);

}  // namespace nacre
