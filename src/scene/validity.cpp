// Judging media and their extents.
#include "nacre/scene/validity.h"

#include "nacre/geometry/topology.h"

namespace nacre {
namespace {

constexpr float kLeastAlphaPrime = 0.5f;
constexpr double kLeastThickness = 3;  // mean free paths

}  // namespace

MediumExtent measure_medium(const Scene& scene, std::size_t medium) {
  Box3 box;
  double area = 0, volume = 0;
  bool closed = true;
  for (const Shape& shape : scene.shapes) {
    if (shape.medium != static_cast<int>(medium)) continue;
    const TopologyReport topology = analyse_topology(shape.mesh);
    box.extendBy(topology.box);
    area += topology.area;
    volume += std::abs(topology.volume);
    closed = closed && topology.closed();
  }
  MediumExtent extent;
  if (box.isEmpty()) return extent;
  const double scale = scene.media[medium].scale;
  extent.size_mm = box.size() * static_cast<float>(scale);
  extent.area_mm2 = area * square(scale);
  extent.thickness_mm = std::min({extent.size_mm.x, extent.size_mm.y, extent.size_mm.z});
  if (closed && area > 0) extent.thickness_mm = std::min(extent.thickness_mm, 2 * volume / area * scale);
  return extent;
}

Warnings check_validity(const Scene& scene) {
  Warnings warnings;
  for (std::size_t m = 0; m < scene.media.size(); ++m) {
    const Medium& medium = scene.media[m];
    const Reduced reduced = reduce(medium);
    const MediumExtent extent = measure_medium(scene, m);
    const double longest = max_channel(reduced.mean_free_path);
    const std::string size = fmt::format(
        "{:.3g} x {:.3g} x {:.3g} mm, {:.3g} x {:.3g} x {:.3g} l'", extent.size_mm.x, extent.size_mm.y,
        extent.size_mm.z, extent.size_mm.x / longest, extent.size_mm.y / longest, extent.size_mm.z / longest);
    std::string reasons;
    if (min_channel(reduced.alpha_prime) < kLeastAlphaPrime)
      reasons = fmt::format(
          "it absorbs too much for diffusion to be right (alpha' {:.2g} {:.2g} {:.2g}, wanted above 0.5)",
          reduced.alpha_prime.x, reduced.alpha_prime.y, reduced.alpha_prime.z);
    if (extent.thickness_mm < kLeastThickness * longest)
      reasons += fmt::format(
          "{}it is {:.3g} mm thick, {:.2g} mean free paths, and diffusion wants at least {:.0f}; check "
          "`scale`",
          reasons.empty() ? "" : "; ", extent.thickness_mm, extent.thickness_mm / longest, kLeastThickness);
    if (!reasons.empty())
      warnings.push_back(fmt::format("{}: {} ({}): {}", medium.place, medium_label(scene, m), size, reasons));
  }
  return warnings;
}

}  // namespace nacre
