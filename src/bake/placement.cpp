// Dart throwing in blocks.
#include "bake/placement.h"

#include <malloc.h>

#include <bit>
#include <limits>

#include "bake/space_blocks.h"
#include "nacre/base/error.h"
#include "nacre/base/random.h"
#include "nacre/cache/cache.h"

namespace nacre {
namespace {

// Smallest distance over the hexagonal spacing of the target. With this many candidates per point about as
// many darts stick as are asked for (measured); more candidates would allow a larger ratio, up to 0.777 at
// saturation.
constexpr double kRelativeRadius = 0.711;
constexpr double kCandidates = 12;
// At most so many per point at once, for the memory that they take.
constexpr double kCandidatesAtOnce = 5;
constexpr double kFewestCandidates = 256;

constexpr int kBlockCells = 12;  // cells along a block's side, each two radii wide
constexpr float kBlockRadii = 2.0f * kBlockCells;

struct Point {
  Vec3 position;
  std::uint32_t triangle;
};

// Points in the order of strata of area: point i is a function of seed and round alone, cheap to make again
// where its triangle is known.
class CandidateStream {
 public:
  CandidateStream(const GroupSurface& surface, std::uint64_t key, std::size_t count)
      : surface_(surface),
        cumulative_(surface.areas.cumulative()),
        key_(key),
        stratum_(surface.areas.total() / static_cast<double>(count)),
        last_(std::nextafter(surface.areas.total(), 0.0)) {}

  /// The triangle of point i; ascending i, from one call to the next.
  std::uint32_t find_triangle(std::size_t i) {
    Rng rng(key_ + 2 * i * Rng::kStep);  // the i-th pair of one sequence
    find_triangle_at(std::min((static_cast<double>(i) + rng.next_double()) * stratum_, last_));
    return static_cast<std::uint32_t>(triangle_);
  }
  Point make(std::size_t i, std::uint32_t triangle) const {
    const std::uint64_t bits = Rng(key_ + (2 * i + 1) * Rng::kStep).next_bits();
    // A parallelogram folded into the triangle.
    const float u = to_unit_float(static_cast<std::uint32_t>(bits >> 32));
    const float v = to_unit_float(static_cast<std::uint32_t>(bits));
    const float b = u + v > 1 ? 1 - u : u, c = u + v > 1 ? 1 - v : v;
    const Triangle& t = surface_.triangles[triangle];
    const Vec3& p0 = surface_.positions[t[0]];
    return {p0 + (surface_.positions[t[1]] - p0) * b + (surface_.positions[t[2]] - p0) * c, triangle};
  }

 private:
  // The first triangle whose cumulative area is above x, never one without area; in steps that double, since
  // it is mostly near the last.
  void find_triangle_at(double x) {
    if (cumulative_[triangle_] > x) return;
    std::size_t low = triangle_ + 1, step = 1;
    while (low + step < cumulative_.size() && cumulative_[low + step - 1] <= x) {
      low += step;
      step *= 2;
    }
    const auto begin = cumulative_.begin() + static_cast<std::ptrdiff_t>(low);
    const auto end =
        cumulative_.begin() + static_cast<std::ptrdiff_t>(std::min(low + step, cumulative_.size()));
    triangle_ = static_cast<std::size_t>(std::upper_bound(begin, end, x) - cumulative_.begin());
  }

  const GroupSurface& surface_;
  std::span<const double> cumulative_;
  std::uint64_t key_;
  double stratum_, last_;
  std::size_t triangle_ = 0;
};

// The points of one block and its surroundings in a dense grid. Cells are two radii wide, so that all that a
// dart can be too near to is in the eight cells around the corner nearest to it.
class LocalGrid {
 public:
  LocalGrid(std::span<const Vec3> normals, float radius)
      : normals_(normals), inverse_(0.5f / radius), radius2_(radius * radius) {}

  void move_to(const Vec3& corner) {
    corner_ = corner;
    first_.fill(-1);
    slots_.clear();
  }
  /// Whether a point of the block matters to any of its neighbours.
  bool is_near_side(const Point& point) const {
    const Vec3 at = (point.position - corner_) * inverse_;
    constexpr float kWider = kMargin + 0.01f;
    int inside = 1;
    for (int axis = 0; axis < 3; ++axis)
      inside &= int{at[axis] > kWider} & int{at[axis] < static_cast<float>(kBlockCells) - kWider};
    return inside == 0;
  }
  /// Adds a point of the block or of a neighbour, unless it is too far away to matter.
  void add(const Point& point) {
    const Vec3 at = (point.position - corner_) * inverse_;
    // Without a branch for each: which of them decides is anyone's guess.
    int within = 1;
    for (int axis = 0; axis < 3; ++axis)
      within &= int{at[axis] > -kMargin} & int{at[axis] < static_cast<float>(kBlockCells) + kMargin};
    if (within == 0) return;
    const auto cell = [](float x) { return static_cast<int>(x + 1) - 1; };
    insert(point, index(cell(at.x), cell(at.y), cell(at.z)));
  }
  bool add_if_free(const Point& point) {
    const Vec3 at = (point.position - corner_) * inverse_;
    const int x = cell_of(at.x), y = cell_of(at.y), z = cell_of(at.z);
    const auto side = [](float position, int cell) {
      return position - static_cast<float>(cell) < 0.5f ? -1 : 1;
    };
    const int own = index(x, y, z);
    const int dx = side(at.x, x) * step(0), dy = side(at.y, y) * step(1), dz = side(at.z, z) * step(2);
    for (const int cell :
         {own, own + dx, own + dy, own + dz, own + dx + dy, own + dx + dz, own + dy + dz, own + dx + dy + dz})
      for (int s = first_[static_cast<std::size_t>(cell)]; s >= 0;
           s = slots_[static_cast<std::size_t>(s)].next)
        if (conflicts(slots_[static_cast<std::size_t>(s)], point)) return false;
    insert(point, own);
    return true;
  }

 private:
  static constexpr int kSide = kBlockCells + 2;
  static constexpr float kMargin = 0.51f;  // a radius, and what rounding may add
  static constexpr std::size_t kLanes = 4;
  using Lanes [[gnu::vector_size(4 * kLanes)]] = float;
  // A few points of a cell, tested at once; those that are not there are infinitely far away.
  struct Slots {
    Lanes x, y, z;
    std::uint32_t triangles[kLanes];
    int next;
    int count;
  };

  static constexpr int step(int axis) { return axis == 0 ? 1 : axis == 1 ? kSide : kSide * kSide; }
  static int index(int x, int y, int z) { return (x + 1) * step(0) + (y + 1) * step(1) + (z + 1) * step(2); }
  // Rounding may leave a point of the block just outside it.
  static int cell_of(float x) { return std::clamp(static_cast<int>(x), 0, kBlockCells - 1); }

  bool conflicts(const Slots& slots, const Point& point) const {
    const Lanes dx = slots.x - point.position.x, dy = slots.y - point.position.y,
                dz = slots.z - point.position.z;
    const auto near = dx * dx + dy * dy + dz * dz < radius2_;
    const auto halves = std::bit_cast<std::array<std::uint64_t, 2>>(near);
    if ((halves[0] | halves[1]) == 0) return false;
    for (std::size_t k = 0; k < kLanes; ++k) {
      if (!near[k]) continue;
      const std::uint32_t other = slots.triangles[k];
      if (other == point.triangle || dot(normals_[other], normals_[point.triangle]) > kSameSheetCosine)
        return true;
    }
    return false;
  }

  void insert(const Point& point, int cell) {
    int& first = first_[static_cast<std::size_t>(cell)];
    if (first < 0 || slots_[static_cast<std::size_t>(first)].count == static_cast<int>(kLanes)) {
      Slots slots{};
      slots.x = slots.x + std::numeric_limits<float>::infinity();
      slots.next = first;
      first = static_cast<int>(slots_.size());
      slots_.push_back(slots);
    }
    Slots& slots = slots_[static_cast<std::size_t>(first)];
    const auto k = static_cast<std::size_t>(slots.count++);
    slots.x[k] = point.position.x;
    slots.y[k] = point.position.y;
    slots.z[k] = point.position.z;
    slots.triangles[k] = point.triangle;
  }

  std::span<const Vec3> normals_;  // of all triangles
  float inverse_, radius2_;
  Vec3 corner_;
  std::array<int, std::size_t{kSide} * kSide * kSide> first_;
  std::vector<Slots> slots_;
};

Box3 bounds_of(const GroupSurface& surface) {
  Box3 box;
  for (const Vec3& p : surface.positions) box.extendBy(p);
  return box;
}

class DartThrower {
 public:
  DartThrower(const GroupSurface& surface, const Box3& box, float radius, double target, std::uint64_t seed)
      : surface_(surface),
        seed_(seed),
        radius_(radius),
        blocks_(box, kBlockRadii * radius, static_cast<std::size_t>(target)),
        normals_(surface.triangles.size()),
        points_(blocks_.bucket_count()) {
    parallel_for(normals_.size(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) normals_[t] = surface_.normal(t);
    });
  }

  void throw_round(std::uint64_t round, std::size_t count) {
    const std::uint64_t key = hash_words(seed_, round);
    std::vector<std::uint32_t> triangles(count);
    const Buckets candidates = sort_into_buckets(
        count, blocks_.bucket_count(), [&](std::size_t begin, std::size_t end, const auto& emit) {
          CandidateStream stream(surface_, key, count);
          for (std::size_t i = begin; i < end; ++i) {
            triangles[i] = stream.find_triangle(i);
            emit(i, blocks_.bucket(blocks_.at(stream.make(i, triangles[i]).position)));
          }
        });
    for (std::uint32_t phase = 0; phase < SpaceBlocks::kPhases; ++phase) {
      const std::uint32_t first = phase * blocks_.buckets_per_phase();
      parallel_for(blocks_.buckets_per_phase(), 8, [&](std::size_t begin, std::size_t end) {
        const CandidateStream stream(surface_, key, count);
        Scratch scratch{LocalGrid(normals_, radius_), {}, {}, {}};
        for (std::size_t i = begin; i < end; ++i) {
          const std::uint32_t bucket = first + static_cast<std::uint32_t>(i);
          make_darts(stream, candidates.of(bucket), triangles, hash_words(key, bucket), scratch.darts);
          throw_into_bucket(bucket, scratch);
        }
      });
    }
  }

  std::size_t count() const {
    std::size_t sum = 0;
    for (const Bucket& bucket : points_) sum += bucket.points.size();
    return sum;
  }

  std::vector<PlacedPoint> take_points() {
    std::vector<std::size_t> begins(points_.size());
    std::size_t sum = 0;
    for (std::size_t b = 0; b < points_.size(); ++b) {
      begins[b] = sum;
      sum += points_[b].points.size();
    }
    std::vector<PlacedPoint> placed(sum);
    parallel_for(points_.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t b = begin; b < end; ++b) {
        std::size_t at = begins[b];
        for (const Point& point : points_[b].points)
          placed[at++] = {point.position, point.triangle, normals_[point.triangle]};
        std::vector<Point>().swap(points_[b].points);
      }
    });
    // Many small pieces of memory, which the allocator would keep for ever.
    malloc_trim(0);
    return placed;
  }

 private:
  // The points in a bucket, those near the sides of their blocks first.
  struct Bucket {
    std::vector<Point> points;
    std::size_t near_sides = 0;
  };
  struct Scratch {
    LocalGrid grid;
    std::vector<Point> darts, stuck;
    std::vector<std::uint64_t> blocks;
  };

  // Candidates come triangle by triangle, darts have to fly in no order: each takes the place of any that was
  // made before it, or its own.
  static void make_darts(const CandidateStream& stream, std::span<const std::uint32_t> candidates,
                         std::span<const std::uint32_t> triangles, std::uint64_t key,
                         std::vector<Point>& darts) {
    darts.resize(candidates.size());
    Rng rng(key);
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      const auto other = static_cast<std::size_t>((rng.next_bits() >> 32) * (i + 1) >> 32);
      darts[i] = darts[other];
      darts[other] = stream.make(candidates[i], triangles[candidates[i]]);
    }
  }

  void throw_into_bucket(std::uint32_t bucket, Scratch& scratch) {
    if (scratch.darts.empty()) return;
    scratch.blocks.clear();
    for (const Point& dart : scratch.darts) {
      const std::uint64_t block = SpaceBlocks::key(blocks_.at(dart.position));
      if (scratch.blocks.empty() || scratch.blocks.back() != block) scratch.blocks.push_back(block);
    }
    const bool one_block = scratch.blocks.size() == 1;
    std::sort(scratch.blocks.begin(), scratch.blocks.end());
    scratch.blocks.erase(std::unique(scratch.blocks.begin(), scratch.blocks.end()), scratch.blocks.end());
    for (const std::uint64_t block : scratch.blocks)
      throw_into_block(bucket, SpaceBlocks::from_key(block), one_block, scratch);
  }

  void throw_into_block(std::uint32_t bucket, const BlockAt& block, bool alone, Scratch& scratch) {
    scratch.grid.move_to(blocks_.corner(block));
    SpaceBlocks::for_each_around(block, [&](const BlockAt& near) {
      const Bucket& there = points_[blocks_.bucket(near)];
      const std::size_t count = near == block ? there.points.size() : there.near_sides;
      for (std::size_t i = 0; i < count; ++i) scratch.grid.add(there.points[i]);
    });
    scratch.stuck.clear();
    for (const Point& dart : scratch.darts)
      if ((alone || blocks_.at(dart.position) == block) && scratch.grid.add_if_free(dart))
        scratch.stuck.push_back(dart);
    Bucket& own = points_[bucket];
    own.points.reserve(own.points.size() + scratch.stuck.size());  // and not twice that
    for (const Point& point : scratch.stuck) {
      own.points.push_back(point);
      if (scratch.grid.is_near_side(point)) std::swap(own.points.back(), own.points[own.near_sides++]);
    }
  }

  const GroupSurface& surface_;
  std::uint64_t seed_;
  float radius_;
  SpaceBlocks blocks_;
  std::vector<Vec3> normals_;  // of triangles
  std::vector<Bucket> points_;
};

}  // namespace

std::vector<PlacedPoint> place_points(const GroupSurface& surface, double target, std::uint64_t seed,
                                      Progress& progress) {
  if (!(surface.areas.total() > 0) || !(target > 0)) return {};
  const Box3 box = bounds_of(surface);
  const Vec3 size = box.size();
  const double radius = kRelativeRadius * hexagonal_spacing(surface.areas.total(), target);
  if (!(std::max({size.x, size.y, size.z}) / (radius * static_cast<double>(kBlockRadii)) <
        SpaceBlocks::kMostBlocks - 1))
    fail(ErrorCode::kLimit, "",
         "the samples are too close together for an object of this size; check `scale` or use fewer points");
  DartThrower thrower(surface, box, static_cast<float>(radius), target, seed);
  double left = std::ceil(kCandidates * std::max(target, kFewestCandidates / kCandidates));
  progress.begin("placing samples", "candidates", static_cast<std::uint64_t>(left));
  // On dust and hair, which have room for any number of points, nearly every dart sticks: the first rounds
  // throw no more than are missing at the rate at which those of the round before stuck. Where that rate
  // falls it will be half as high at most, and fewer rounds are faster.
  double rate = 1, count = 0;
  for (std::uint64_t round = 0; count < target && left >= 1; ++round) {
    const double candidates =
        std::ceil(std::min({(target - count) / rate * (round > 1 ? 2 : 1),
                            std::max(kCandidatesAtOnce * target, kFewestCandidates), left}));
    thrower.throw_round(round, static_cast<std::size_t>(candidates));
    const auto now = static_cast<double>(thrower.count());
    rate = (now - count) / candidates;
    count = now;
    left -= candidates;
    progress.advance(static_cast<std::uint64_t>(candidates));
  }
  progress.end();
  return thrower.take_points();
}

}  // namespace nacre
