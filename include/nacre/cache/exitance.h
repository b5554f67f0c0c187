// Diffuse exitance: the sum of a diffusion profile over the samples of a cache.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "nacre/base/large_array.h"
#include "nacre/cache/cache.h"
#include "nacre/cache/kernel.h"
#include "nacre/cache/material_family.h"
#include "nacre/optics/medium.h"

namespace nacre {

/// A sample, or a node that stands for its samples, as the inner loops read it.
struct SumSource {
  float x, y, z, spare;
  Float4 power;  // E_t A
};
/// A node of the octree as they do. Second moments are those of E_t A over its sum, halved, about x, y, z.
struct SumNode {
  float x, y, z, radius;
  float spread;         // trace of the second moment, the largest of a channel; -1 for a dark node
  float lean;           // length of the first moment, the largest of a channel
  std::uint32_t first;  // child, or sample of a leaf
  std::uint32_t packed_counts;
  Float4 power;
  float xx, yy, zz, yz, zx, xy;  // second moment of all channels together
  float tint;                    // largest norm of a channel's difference from that
  float spare;
  static constexpr int kChildShift = 28;
  std::uint32_t child_count() const noexcept { return packed_counts >> kChildShift; }
  std::uint32_t sample_count() const noexcept { return packed_counts & ((1u << kChildShift) - 1); }
};

class KernelSet;

/// E_t of a group's samples for a relative index of refraction, plane by plane.
using IrradianceForEta = std::function<std::array<std::vector<float>, 3>(double eta)>;

/// What the relative error of a hierarchical sum is: its root mean square over a picture, or the largest.
enum class Promise { kCalibrated, kCertified };

/// One group of a cache seen with materials and one tolerance. M_o is a function of position and these
/// alone. The cache has to outlive it.
class Exitance {
 public:
  /// `tolerance` is the relative error of the sum against eval_exact, with each material; 0 sums every
  /// sample. Throws Error(kLimit) where it cannot be certified, being near the accuracy of the tables. The
  /// irradiance of `group` is that for the family's least eta; where its members have several, which neither
  /// a sum over every sample nor a certified one may, `irradiance` gives that for others.
  Exitance(const CacheGroup& group, const MaterialFamily& family, double tolerance,
           Promise promise = Promise::kCalibrated, const IrradianceForEta& irradiance = {});
  Exitance(const CacheGroup& group, const Medium& medium, double tolerance,
           Promise promise = Promise::kCalibrated)
      : Exitance(group, MaterialFamily{{medium}}, tolerance, promise) {}
  ~Exitance();
  Exitance(const Exitance&) = delete;
  Exitance& operator=(const Exitance&) = delete;
  std::size_t material_count() const noexcept { return material_count_; }
  /// Where light falls on few pieces of a mean free path, errors cancel less: the share of what is allowed
  /// otherwise, 1 where there are many.
  double piece_share() const noexcept { return piece_share_; }

  /// Diffuse exitance M_o = sum R_d(|x - p|) E_t(p) A_p at points in scene units, with all materials of a
  /// point side by side. Space is divided into blocks, those into cells, down to a few distances of samples.
  /// A node of the octree stands for its samples, and its contribution to a block or cell is a Taylor series
  /// of second order around its centre, where a bound on both errors is small against the whole sum; what is
  /// too near for a block is left to its parts, and in a cell summed point by point. Blocks and cells are
  /// fixed in space, so that a point's value does not depend on its company; points that lie near each other
  /// are cheap. Counts evaluations of R_d in `evaluations`. Source: Jensen & Buhler 2002 for the hierarchy,
  /// Greengard & Rokhlin 1987 for the expansions; the error bounds and the cells are nacre's own.
  void eval(std::span<const Vec3> points, std::span<Rgb> exitance, std::uint64_t& evaluations) const;
  /// The same for points that are all there will ever be in the cells of level kWholeLevel in which they lie:
  /// the parts of those cells fit closely around them.
  void eval_whole(std::span<const Vec3> points, std::span<Rgb> exitance, std::uint64_t& evaluations) const;
  /// The same sum over every sample, in octree order. Of materials with one eta.
  void eval_exact(std::span<const Vec3> points, std::span<Rgb> exitance, std::uint64_t& evaluations) const;

  /// The cell of a point, in Morton order; shifted right by 3 bits a level, the larger cell around it.
  std::uint64_t cell_code(const Vec3& x) const noexcept;
  static constexpr int kWholeLevel = 3;

 private:
  // Least side of the smallest cells in distances of samples, in mean free paths.
  static constexpr double kCellSpacings = 0.75, kCellLengths = 0.4;
  static constexpr int kBlockLevels = 5;  // a block has 32 of them along each side
  // Cells that are divided no further, for points about as dense as samples.
  static constexpr int kLeafLevel = 1;
  // Certified, a node is accepted if its radius is at most this share of its distance: all that larger ones
  // contribute is too uncertain anyway.
  static constexpr double kCertifiedRatio = 1.0 / 16;
  // Smallest tabulated radius of a target in cells, and steps.
  static constexpr double kSmallestRadius = 0.125;
  static constexpr int kRadiiPerOctave = 4;

  struct Point {
    std::uint64_t code;
    std::uint32_t index;
  };
  // What is tabulated for targets of one radius: how spread out a node may be, by bins of distance.
  struct Radius {
    std::array<std::vector<float>, 3> as_point, in_series;
  };
  // A kernel that errors are held against, among the extreme ones of the family, and its tables.
  struct Guide {
    std::size_t kernel;  // its index
    Rgb lit{0, 0, 0};    // M_o under the mean irradiance
    // Channels with light whose errors are held against it, and against no guide before it.
    std::array<bool, 3> limits{false, false, false};
    std::vector<Radius> radii;                    // from the smallest cell on, kRadiiPerOctave each
    std::array<std::vector<float>, 3> per_third;  // what a share of the sum allows, by channel
  };
  static constexpr std::size_t kMostGuides = 4;  // that find_extremes gives
  using Totals = std::array<Float4, kMostGuides>;
  struct Target;
  struct Room;

  struct Grains;
  struct Moments;
  Grains find_grains() const;
  SumSource make_source(std::size_t sample) const noexcept;
  OctreeNode make_octree_node(std::uint32_t index) const noexcept;
  std::vector<Vec3> scaled(std::span<const Vec3> points) const;
  double lit_pieces(double radius) const;
  std::vector<std::uint32_t> copy_octree();
  void add_all_moments(std::span<const Float4> other_light);
  Moments add_moments(std::uint32_t index, std::span<const std::uint32_t> known,
                      std::span<const Moments> moments, std::span<const Float4> other_light);
  void set_moments(SumNode& node, const Moments& sum) const;
  void widen_moments(SumNode& node, const Moments& sum) const;
  std::vector<Float4> source_powers(std::span<const std::uint32_t> origins, double eta,
                                    const IrradianceForEta& irradiance) const;
  void make_powers(std::span<const std::uint32_t> origins, double most_eta,
                   const IrradianceForEta& irradiance);
  // nullptr where all materials see the same light.
  const float* source_powers() const noexcept { return powers_.size() > 0 ? powers_.data() : nullptr; }
  const float* node_powers() const noexcept {
    return powers_.size() > 0 ? powers_.data() + source_count_ * row_width_ : nullptr;
  }
  void make_kernels(const MaterialFamily& family);
  void make_set(const MaterialFamily& family, double tolerance, double farthest);
  void add_set(std::span<const Kernel> kernels, const std::array<std::size_t, 3>& counts,
               std::span<const ChannelChoice> choices, const MaterialFamily& family);
  void make_tables();
  void make_tables(Guide& guide, std::size_t count);
  bool in_grid(const Vec3& x) const noexcept;
  void sum_exactly(std::span<const Vec3> scaled_points, std::span<Rgb> exitance,
                   std::uint64_t& evaluations) const;
  void eval_points(std::span<const Vec3> points, std::span<Rgb> exitance, std::uint64_t& evaluations,
                   bool whole) const;
  void place(Target& target, std::span<const Point> range, int level, const Room& room) const;
  Totals weigh(const Target& target, Room& room) const;
  double find_darkness(const Totals& totals) const;
  KernelTables tables_for(const Target& target) const noexcept;
  const KernelSet& set_for(const Target& target) const noexcept;
  void make_limits(const Target& target, Room& room) const;
  void eval_outside(const Point& point, Room& room) const;
  void eval_point(const Target& target, const Point& point, Room& room) const;
  void eval_target(std::span<const Point> range, int level, const Target* parent, Room& room) const;

  const CacheGroup& group_;
  // Power of two that makes scene units lengths of about a mean free path, in which all that follows is, so
  // that nothing runs over or under, however long they are.
  float unit_;
  LargeArray<SumSource> sources_;
  LargeArray<SumNode> nodes_;
  double spacing_;  // distance of samples
  std::size_t material_count_;
  std::vector<Kernel> kernels_;  // of the materials, then those of guides that are none of them
  // Where they are of a family: theirs, or what spans them; and for the dark, where that is not interpolated.
  std::unique_ptr<const KernelSet> set_, dark_set_;
  std::vector<float> weights_;    // of what spans them, by lane of the set and material
  std::size_t kernel_count_ = 1;  // that are summed up
  // Of families with several indices of refraction: those whose light kernels of the set see, and the power
  // of each source, then of each node, under each of them (KernelSet::Rows).
  std::vector<double> light_etas_;
  LargeArray<float> powers_;
  std::size_t source_count_ = 0, node_count_ = 0, row_width_ = 0;
  std::vector<Guide> guides_;
  Promise promise_;
  double allowance_;
  double piece_share_ = 1;
  double own_share_ = 1;        // of it, what a node's own contribution allows
  float moment_slack_ = 1e-5f;  // what rounding and tables may take from second moments
  Vec3d origin_{0, 0, 0};       // corner of the first cell
  double cell_size_ = 1, cells_per_unit_ = 1;
  DistanceBins bins_{};
  std::vector<float> lean_, bend_;  // by bin, what first and second moments count against the third
};

}  // namespace nacre
