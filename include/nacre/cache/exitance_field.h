// Diffuse exitance over a whole surface: evaluated at nodes of its triangles, interpolated between them.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "nacre/base/large_array.h"
#include "nacre/cache/exitance.h"
#include "nacre/cache/exitance_file.h"
#include "nacre/geometry/mesh.h"
#include "nacre/geometry/ray_tracer.h"

namespace nacre {

/// M_o on the meshes of one group as a continuous function, piecewise quadratic: nodes are the vertices of
/// triangles and the midpoints of their edges; edges longer than the distance of nodes are halved first,
/// those below a third of it need no midpoint. Both rules see the edge alone, and nodes are known by their
/// position, so that neighbours agree on a common edge whatever their size: there are no cracks. Nodes are
/// evaluated when a point near them is asked for first, in blocks fixed in space; a value depends neither on
/// when nor for whom. Safe to use from several threads. Meshes and exitance have to outlive it.
class ExitanceField {
 public:
  /// Distance of nodes in smallest mean free paths for a tolerance of the sum, below which interpolation
  /// stays: M_o has no detail below about one. Its error is 0.1 to 0.25 % at the distance for 1 % and more,
  /// up to 0.9 % in random scenes (tests/soak), and falls at least with the square of that.
  static double node_distance(double tolerance) noexcept { return 1.9 * std::sqrt(strictness(tolerance)); }

  /// `meshes` by the index that hits have (nullptr: of another medium); `distance` of nodes in scene units,
  /// for that tolerance.
  ExitanceField(std::vector<const Mesh*> meshes, const Exitance& exitance, double distance, double tolerance);
  /// Number of nodes that a field would have, about; fields for which that is more than kMostNodes are not
  /// worth their memory.
  static double predict_nodes(std::span<const Mesh* const> meshes, double distance);
  static constexpr double kMostNodes = 20e6;

  /// M_o at hits of those meshes, with all materials of a hit side by side. Adds to `evaluations` those that
  /// nodes took.
  void eval(std::span<const Hit> hits, std::span<Rgb> exitance, std::uint64_t& evaluations) const;
  /// Evaluates all nodes that are not yet known.
  void fill(std::uint64_t& evaluations) const;
  std::size_t node_count() const { return positions_.size(); }
  std::size_t filled_node_count() const;
  const std::vector<std::uint32_t>& block_of_node() const { return block_of_; }
  /// A 32-digit hash of where the nodes are.
  std::string nodes_digest() const;
  /// What is evaluated so far; the key is left to those who know of the material.
  KeptExitance keep() const;
  /// Takes over what an equal field has evaluated: same nodes, same numbers. Not while others evaluate.
  void restore(const KeptExitance& kept) const;

 private:
  static constexpr std::uint32_t kNone = 0xffffffffu;
  // A triangle with its nodes: vertices a, b, c and the midpoints of ab, bc, ca, or kNone.
  struct Patch {
    std::array<std::uint32_t, 6> nodes;
  };
  // A triangle or a part of one, in a quarter of a cache line, since looking it up is all that a point costs.
  // By kind: three nodes, the index of a patch, or the first part of its own and their pattern. `mark` is the
  // kind and, but for those that are divided, what is known of the values at its nodes.
  struct alignas(16) Part {
    std::array<std::uint32_t, 3> data;
    std::uint32_t mark;
  };
  // A point in the part that it lies in.
  struct Place {
    std::uint32_t part;
    float u, v;
  };
  struct Division;
  class Divider;

  // What nodes may err by, as a share of what the widest do: less than in proportion, since the rest of the
  // tolerance is the sum's.
  static double strictness(double tolerance) noexcept {
    return std::min(1.0, std::pow(tolerance / 0.01, 1.7));
  }

  void divide_meshes(double distance);
  template <class Corners>
  void place_run(const Division& run, std::uint32_t vertices, std::span<const std::uint32_t> places,
                 const Corners& corners);
  std::vector<std::uint32_t> sort_nodes();
  std::uint32_t find_patch(const Hit& hit, float& u, float& v) const noexcept;
  Patch patch(const Part& part) const noexcept;
  void await_blocks(std::span<const std::uint32_t> blocks, std::uint64_t& evaluations) const;
  void fill_blocks(std::span<const std::uint32_t> blocks, std::uint64_t& evaluations) const;
  void fetch_nodes(const Part& part) const noexcept;
  bool look_up(const Place& place, Rgb* to) const noexcept;
  void look_up_smooth(const Place& place, Rgb* to) const noexcept;
  void make_known(std::span<const std::uint32_t> parts, std::uint64_t& evaluations) const;
  Float4* values(std::uint32_t node) const noexcept { return values_.data() + node * quads_; }
  void store(std::uint32_t node, const Rgb* materials) const noexcept;
  void unpack(const Float4* packed, Rgb* materials) const noexcept;
  void judge(Part& part) const noexcept;
  using Lanes = decltype(Float4() > Float4());  // -1 or 0 each
  Lanes steep_lanes(const Patch& patch, std::size_t quad) const noexcept;
  bool is_steep(const Patch& patch) const noexcept;
  Float4 interpolate(const Patch& patch, float u, float v, std::size_t quad) const noexcept;
  Float4 interpolate(const Place& place, std::size_t quad) const noexcept;

  const Exitance& exitance_;
  std::size_t materials_, quads_;  // Float4 that the materials of a node take, packed
  std::vector<const Mesh*> meshes_;
  float most_bend_, most_change_;
  std::vector<std::uint32_t> first_triangle_;  // by mesh
  mutable LargeArray<Part> parts_;             // by triangle, then those of divided ones
  std::vector<Patch> patches_;
  std::vector<Vec3> positions_;             // of nodes, block by block
  std::vector<std::uint32_t> block_of_;     // by node
  std::vector<std::uint32_t> block_begin_;  // the first node of each block, and the end
  mutable LargeArray<Float4> values_;       // of nodes
  std::unique_ptr<std::atomic<std::uint8_t>[]> block_state_;
};

}  // namespace nacre
