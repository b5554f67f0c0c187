// What leaves one translucent medium at the points that rays have hit, filled with one material or several:
// diffusion by any method, and single scattering.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "nacre/cache/exitance.h"
#include "nacre/cache/exitance_field.h"
#include "nacre/render/monte_carlo.h"
#include "nacre/render/render.h"
#include "nacre/render/single_scattering.h"

namespace nacre {

/// A point on the surface of a medium and where its random numbers come from.
struct ExitPoint {
  Hit hit;
  SurfacePoint surface;
  Vec3 out;              // unit, towards the eye
  std::uint64_t key;     // of the pixel
  std::uint32_t sample;  // of the pixel
};

/// Irradiance of a sample, and the standard error of its mean channel.
struct BakedLight {
  Rgb irradiance{0, 0, 0};
  float error = 0;
};

class Translucency {
 public:
  /// A medium of the scene filled with what is wanted of a family. `boundaries` are the world with each eta
  /// that these have in that medium. `group`, for the family's least eta, is read where the method needs it,
  /// else it may be nullptr; `irradiance` where there are several.
  Translucency(std::span<const World> boundaries, std::size_t medium, const MaterialFamily& family,
               const CacheGroup* group, const RenderParams& params, const IrradianceForEta& irradiance = {});
  Translucency(const World& world, std::size_t medium, const MaterialFamily& family, const CacheGroup* group,
               const RenderParams& params)
      : Translucency(std::span(&world, 1), medium, family, group, params) {}
  std::size_t material_count() const { return materials_.size(); }

  /// Diffuse exitance M_o at points that should lie near each other, all materials of a point side by side;
  /// `hits` are theirs. Adds to `evaluations` those of the profile.
  void eval_diffusion(std::span<const Hit> hits, std::span<const ExitPoint> points, std::span<Rgb> exitance,
                      std::uint64_t& evaluations) const;
  /// From exitance to the radiance that leaves towards the eye, its transmittance at the boundary apart.
  float exit_factor(std::size_t material) const { return materials_[material].exit_factor; }
  /// Evaluates diffusion on the whole surface, where it is kept.
  void fill(std::uint64_t& evaluations) const {
    if (field_) field_->fill(evaluations);
  }
  /// How diffusion is evaluated, in words for the report.
  std::string describe_path() const;
  /// What is evaluated so far, or an empty key where nothing is kept; the blocks of its nodes.
  KeptExitance keep() const;
  std::vector<std::uint32_t> block_of_node() const {
    return field_ ? field_->block_of_node() : std::vector<std::uint32_t>{};
  }
  std::size_t filled_node_count() const { return field_ ? field_->filled_node_count() : 0; }
  void restore(const KeptExitance& kept) const {
    if (field_) field_->restore(kept);
  }
  /// M_o of kHierarchical at hits, and the sum over every sample that it stands for.
  void eval_exitance(std::span<const Hit> hits, std::span<Rgb> exitance, std::span<Rgb> exact) const;
  /// What the cache's nearest sample has received; nothing without a cache.
  BakedLight nearest_light(const SurfacePoint& point) const noexcept;
  bool has_single_scattering() const { return !singles_.empty(); }
  /// For each material that has the eta of that boundary; others are left alone.
  void estimate_single_scattering(std::size_t boundary, const ExitPoint& point, LostSamples& lost,
                                  std::span<Rgb> radiance) const;

 private:
  struct Material {
    Medium medium;
    float exit_factor;
    Rgb total;  // of the profile
    std::optional<MonteCarloDiffusion> monte_carlo;
  };
  // Of what is wanted those of one eta.
  struct Single {
    std::size_t boundary;
    SingleScattering scattering;
    std::vector<std::size_t> materials;
  };
  void make_singles(std::span<const World> boundaries, const MaterialFamily& family);
  void make_field(const MaterialFamily& family, const CacheGroup& group, double tolerance);
  KeyValues make_key() const;
  Rgb lambert_irradiance(const ExitPoint& point) const;

  const World& world_;
  std::size_t medium_;
  std::vector<Material> materials_;
  Method method_;
  float eta_;
  int bounces_, light_samples_, single_samples_, mc_samples_;
  double tolerance_;
  bool certified_;
  const CacheGroup* group_;
  std::unique_ptr<const Exitance> exitance_;
  std::unique_ptr<const ExitanceField> field_;
  std::vector<Single> singles_;
  mutable KeyValues key_;  // of what is kept, once it was asked for: all samples are hashed
};

}  // namespace nacre
