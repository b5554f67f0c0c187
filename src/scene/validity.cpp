// Judging media and their extents.
#include "nacre/scene/validity.h"

#include <map>

#include "nacre/geometry/piece_faults.h"
#include "nacre/geometry/topology.h"

namespace nacre {
namespace {

constexpr float kLeastAlphaPrime = 0.5f;
constexpr double kLeastThickness = 3;  // mean free paths

// Mean free paths by which single precision may move surfaces; they are found, and light on them, only so
// well.
constexpr double kMostRounding = 0.02;
constexpr double kFarAway = 4;  // of its own size, from the origin

// Surfaces that are nearer to each other than this share the density of one: about the distance of samples.
constexpr float kNear = 0.65f;  // mean free paths

// Shapes of one medium that are warned of one by one, and what is said of the others.
constexpr std::size_t kMostLines = 8;
const std::map<PieceFault, const char*> kInShort{{PieceFault::kCopy, "copies"},
                                                 {PieceFault::kNearCopy, "closer than samples are apart"},
                                                 {PieceFault::kBackSide, "without thickness"},
                                                 {PieceFault::kFlat, "without thickness"},
                                                 {PieceFault::kInside, "inside others"}};

// "left lies on right (scene.xml:7)", what comes of it, and what to do.
std::string describe(const FaultyPieces& faulty, const Shape& shape, const Shape& other) {
  const bool itself = faulty.mesh == faulty.other;
  const std::string who =
      faulty.pieces == 1 && !itself
          ? shape.id
          : fmt::format("{} of {}", faulty.pieces == 1 ? "a piece" : fmt::format("{} pieces", faulty.pieces),
                        shape.id);
  const std::string whom = itself ? "another piece of it" : fmt::format("{} ({})", other.id, other.place);
  const char* const be = faulty.pieces == 1 ? "is" : "are";
  const char* const lie = faulty.pieces == 1 ? "lies" : "lie";
  switch (faulty.fault) {
    case PieceFault::kCopy:
      return fmt::format("{} {} on {}, exactly: light enters there twice; remove the copy", who, lie, whom);
    case PieceFault::kNearCopy:
      return fmt::format(
          "{} {} closer to {} than samples are apart: what is below stays dark, and diffusion is some 10 to "
          "20 "
          "% off; remove one of them",
          who, lie, whom);
    case PieceFault::kBackSide:
      return fmt::format(
          "{} {} the back of {}, without thickness: light from either side is diffused as in a half-space; "
          "give the shell thickness",
          who, be, whom);
    case PieceFault::kFlat:
      return fmt::format(
          "{} {} closed but {} no thickness: light from either side is diffused as in a half-space; give the "
          "shell thickness",
          who, be, faulty.pieces == 1 ? "has" : "have");
    case PieceFault::kInside:
      return fmt::format(
          "{} {} inside {}, of the same medium: no light gets there, and samples are in vain; remove {}, or "
          "flipNormals if {} a cavity",
          who, lie, whom, faulty.pieces == 1 ? "it" : "them", faulty.pieces == 1 ? "it is" : "each is");
  }
  return "";
}

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
  for (int k = 0; k < 3; ++k)
    extent.furthest = std::max({extent.furthest, std::abs(box.min[k]), std::abs(box.max[k])});
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
    const double rounding =
        double{extent.furthest} * 0x1p-24 * double{medium.scale} / double{smallest_mean_free_path(medium)};
    if (rounding > kMostRounding) {
      const bool far_away =
          double{extent.furthest} * double{medium.scale} > kFarAway * max_channel(extent.size_mm);
      reasons += fmt::format("{}it is so {} that coordinates are rounded by {:.2g} mean free paths; {}",
                             reasons.empty() ? "" : "; ", far_away ? "far from the origin" : "dense",
                             rounding, far_away ? "move the scene" : "check `scale`");
    }
    if (!reasons.empty())
      warnings.push_back(fmt::format("{}: {} ({}): {}", medium.place, medium_label(scene, m), size, reasons));
  }
  return warnings;
}

Warnings check_bodies(const Scene& scene) {
  Warnings warnings;
  for (std::size_t m = 0; m < scene.media.size(); ++m) {
    const std::vector<std::uint32_t> shapes = shapes_of_medium(scene, m);
    std::vector<const Mesh*> meshes;
    meshes.reserve(shapes.size());
    for (const std::uint32_t i : shapes) meshes.push_back(&scene.shapes[i].mesh);
    const float near = kNear * smallest_mean_free_path(scene.media[m]) / scene.media[m].scale;
    std::map<PieceFault, std::size_t> counts;
    for (const FaultyPieces& faulty : find_faulty_pieces(meshes, near)) {
      if (++counts[faulty.fault] > kMostLines) continue;
      const Shape &shape = scene.shapes[shapes[faulty.mesh]], &other = scene.shapes[shapes[faulty.other]];
      warnings.push_back(shape.place + ": " + describe(faulty, shape, other));
    }
    for (const auto& [fault, count] : counts)
      if (count > kMostLines)
        warnings.push_back(fmt::format("{}: the same of {} more shapes of {}: {}", scene.media[m].place,
                                       count - kMostLines, medium_label(scene, m), kInShort.at(fault)));
  }
  return warnings;
}

}  // namespace nacre
