// From exitance to radiance.
#include "render/translucency.h"

#include "nacre/base/random.h"
#include "nacre/base/simd.h"
#include "nacre/cache/fingerprint.h"
#include "nacre/cache/nearest.h"
#include "nacre/cache/relight.h"
#include "nacre/optics/profile.h"
#include "nacre/transport/irradiance.h"

namespace nacre {
namespace {

// Purposes of random numbers at one point.
enum Purpose : std::uint64_t { kMonteCarloPoints = 11, kLambertLight, kSinglePoints };

}  // namespace

Translucency::Translucency(std::span<const World> boundaries, std::size_t medium,
                           const MaterialFamily& family, const CacheGroup* group, const RenderParams& params,
                           const IrradianceForEta& irradiance)
    : world_(boundaries[0]),
      medium_(medium),
      method_(family.media[0].lambert ? Method::kLambert : params.method),
      eta_(family.media[0].eta()),
      bounces_(irradiance_bounces(*boundaries[0].scene, medium, params.bounces)),
      light_samples_(boundaries[0].scene->integrator.emitter_samples),
      single_samples_(params.single_samples),
      mc_samples_(params.mc_samples),
      tolerance_(params.tolerance),
      certified_(params.certified),
      group_(group) {
  if (uses_cache(method_)) {
    exitance_ = std::make_unique<const Exitance>(
        *group, family, method_ == Method::kExact ? 0 : params.tolerance,
        params.certified ? Promise::kCertified : Promise::kCalibrated, irradiance);
    // Interpolation has no bound.
    if (method_ == Method::kHierarchical && params.tolerance > 0 && !params.certified)
      make_field(family, *group, params.tolerance);
  }
  for (const std::uint32_t index : family.wanted) {
    const Medium& m = family.media[index];
    materials_.push_back({m, nacre::exit_factor(m), Rgb(0, 0, 0), {}});
    Material& material = materials_.back();
    const auto profiles = make_profiles(m);
    for (int k = 0; k < 3; ++k)
      material.total[k] = static_cast<float>(profiles[static_cast<std::size_t>(k)].total);
    if (method_ == Method::kMonteCarlo)
      material.monte_carlo.emplace(world_, medium, m, params.mc_sampling, bounces_);
  }
  // An opaque surface has no inside, and normalized diffusion holds all orders of scattering already.
  if (single_samples_ > 0 && method_ != Method::kLambert &&
      family.media[0].profile != ProfileKind::kNormalized)
    make_singles(boundaries, family);
}

void Translucency::make_singles(std::span<const World> boundaries, const MaterialFamily& family) {
  for (std::size_t b = 0; b < boundaries.size(); ++b) {
    std::vector<std::size_t> materials;
    for (std::size_t m = 0; m < materials_.size(); ++m)
      if (materials_[m].medium.eta() == boundaries[b].media[medium_].eta()) materials.push_back(m);
    if (!materials.empty())
      singles_.push_back({b, SingleScattering(boundaries[b], medium_, family), std::move(materials)});
  }
}

// Where samples are further apart than a mean free path, M_o has detail at every sample; and where a body has
// so many mean free paths that nodes would fill the memory, pixels are fewer. On a body of a few of them M_o
// follows the body's own shape, and where light is absorbed rather than scattered it falls faster.
void Translucency::make_field(const MaterialFamily& family, const CacheGroup& group, double tolerance) {
  std::vector<const Mesh*> meshes;
  for (const Shape& shape : world_.scene->shapes)
    meshes.push_back(shape.medium == static_cast<int>(medium_) ? &shape.mesh : nullptr);
  if (group.size() == 0) return;
  const double spacing = hexagonal_spacing(group);
  if (std::ranges::any_of(family.media, [&](const Medium& m) { return is_sparse(m, spacing); })) return;
  constexpr double kNodesPerRadius = 3, kAbsorbing = 0.75;
  double detail = std::numeric_limits<double>::infinity();
  for (const Medium& medium : family.media)
    detail =
        std::min(detail, shortest_length(std::span(&medium, 1)) * (absorbs_much(medium) ? kAbsorbing : 1));
  // Light on few pieces has detail at each, which fewer others hide.
  tolerance *= std::sqrt(exitance_->piece_share());
  const double distance = std::min(ExitanceField::node_distance(tolerance) * detail,
                                   double{group.nodes[0].radius} / kNodesPerRadius);
  if (ExitanceField::predict_nodes(meshes, distance) <= ExitanceField::kMostNodes)
    field_ = std::make_unique<const ExitanceField>(std::move(meshes), *exitance_, distance, tolerance);
}

std::string Translucency::describe_path() const {
  switch (method_) {
    case Method::kExact:
      return "sum over every sample";
    case Method::kMonteCarlo:
      return "Monte Carlo over the surface";
    case Method::kLambert:
      return "opaque surface";
    case Method::kHierarchical:
      break;
  }
  if (tolerance_ == 0) return "sum over every sample";
  if (field_)
    return fmt::format("interpolated, {} of {} nodes evaluated", field_->filled_node_count(),
                       field_->node_count());
  return certified_ ? "hierarchical at every point, certified" : "hierarchical at every point";
}

// All that M_o depends on, by name.
KeyValues Translucency::make_key() const {
  const Medium& m = materials_[0].medium;
  const auto triple = [](const Rgb& v) { return fmt::format("{} {} {}", v.x, v.y, v.z); };
  const std::string label = medium_label(*world_.scene, medium_);
  KeyValues key{{"samples", samples_digest(*group_)},
                {"sigma_s", triple(m.sigma_s)},
                {"sigma_a", triple(m.sigma_a)},
                {"g", triple(m.g)},
                {"eta", fmt::format("{}", m.eta())},
                {"mm per unit", fmt::format("{}", m.scale)},
                {"profile", std::string(kProfileNames[static_cast<std::size_t>(m.profile)])},
                {"tolerance", fmt::format("{}", tolerance_)},
                {"nodes", field_->nodes_digest()},
                {"--simd", simd_target()}};  // sums differ by rounding
  for (auto& entry : key) entry.first = label + "/" + entry.first;
  return key;
}

KeptExitance Translucency::keep() const {
  if (!field_ || materials_.size() > 1) return {};
  if (key_.empty()) key_ = make_key();
  KeptExitance kept = field_->keep();
  kept.key = key_;
  return kept;
}

void Translucency::eval_diffusion(std::span<const Hit> hits, std::span<const ExitPoint> points,
                                  std::span<Rgb> exitance, std::uint64_t& evaluations) const {
  if (field_) return field_->eval(hits, exitance, evaluations);
  if (exitance_) {
    std::vector<Vec3> positions;
    positions.reserve(points.size());
    for (const ExitPoint& point : points) positions.push_back(point.surface.position);
    if (method_ == Method::kExact)
      exitance_->eval_exact(positions, exitance, evaluations);
    else
      exitance_->eval(positions, exitance, evaluations);
    return;
  }
  Rgb* to = exitance.data();
  for (const ExitPoint& point : points) {
    if (method_ == Method::kLambert) {
      const Rgb irradiance = lambert_irradiance(point);
      for (const Material& material : materials_) *to++ = material.total * irradiance;
      continue;
    }
    for (const Material& material : materials_)
      *to++ =
          material.monte_carlo->estimate(point.surface, mc_samples_, hash_words(point.key, kMonteCarloPoints),
                                         point.sample * static_cast<std::uint32_t>(mc_samples_));
    evaluations += materials_.size() * static_cast<std::uint64_t>(mc_samples_);
  }
}

void Translucency::eval_exitance(std::span<const Hit> hits, std::span<Rgb> exitance,
                                 std::span<Rgb> exact) const {
  std::vector<Vec3> positions;
  for (const Hit& hit : hits) positions.push_back(hit_position(world_.shape(hit).mesh, hit));
  std::uint64_t evaluations = 0;
  if (field_)
    field_->eval(hits, exitance, evaluations);
  else
    exitance_->eval(positions, exitance, evaluations);
  exitance_->eval_exact(positions, exact, evaluations);
}

BakedLight Translucency::nearest_light(const SurfacePoint& point) const noexcept {
  if (!exitance_ || group_->size() == 0) return {};
  const std::size_t sample = find_nearest_sample(*group_, point.position, point.geometric_normal);
  return {group_->irradiance(sample), irradiance_error(*group_, sample)};
}

Rgb Translucency::lambert_irradiance(const ExitPoint& point) const {
  const float side = point.surface.side(point.out);
  const Receiver receiver{point.surface.position, point.surface.shading_normal * side,
                          point.surface.origin(side), eta_, surface_albedo(world_, point.hit, true)};
  return estimate_irradiance(world_, receiver, light_samples_, bounces_, hash_words(point.key, kLambertLight),
                             point.sample * static_cast<std::uint32_t>(light_samples_));
}

void Translucency::estimate_single_scattering(std::size_t boundary, const ExitPoint& point, LostSamples& lost,
                                              std::span<Rgb> radiance) const {
  for (const Single& single : singles_) {
    if (single.boundary != boundary) continue;
    std::vector<Rgb> scattered(single.materials.size());
    single.scattering.estimate(point.surface, point.out, single_samples_,
                               hash_words(point.key, kSinglePoints),
                               point.sample * static_cast<std::uint32_t>(single_samples_), lost, scattered);
    const Rgb albedo = surface_albedo(world_, point.hit, false);
    for (std::size_t i = 0; i < scattered.size(); ++i) radiance[single.materials[i]] = scattered[i] * albedo;
  }
}

}  // namespace nacre
