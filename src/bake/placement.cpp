// Dart throwing in blocks.
#include "bake/placement.h"

#include <array>
#include <tuple>
#include <unordered_map>

#include "nacre/base/error.h"
#include "nacre/base/parallel.h"
#include "nacre/base/random.h"
#include "nacre/cache/cache.h"

namespace nacre {
namespace {

// Smallest distance over hexagonal spacing. With this many candidates per point about `target` darts stick
// (measured); more candidates would allow a larger ratio, up to 0.777 at saturation.
constexpr double kRelativeRadius = 0.715;
constexpr int kRounds = 14;

constexpr int kBlockCells = 8;               // cells of one radius along a block's side
constexpr int kGridCells = kBlockCells + 2;  // with a halo of one cell
constexpr int kCoordinateBits = 16;

struct Candidate {
  std::uint64_t key;  // block, then a random rank inside it
  Vec3 position;
  std::uint32_t triangle;
};

struct Block {
  std::array<int, 3> coordinates;
  std::vector<PlacedPoint> points;
};

std::uint64_t pack(int x, int y, int z) {
  return static_cast<std::uint64_t>(x) << (2 * kCoordinateBits) |
         static_cast<std::uint64_t>(y) << kCoordinateBits | static_cast<std::uint64_t>(z);
}

// The points of one block and its surroundings in a dense grid of cells, for constant-time look-up.
class LocalGrid {
 public:
  LocalGrid(const Vec3& corner, float radius)
      : corner_(corner), inverse_(1 / radius), radius2_(radius * radius) {
    heads_.fill(-1);
  }
  void add(const PlacedPoint& point) {
    std::array<int, 3> cell;
    if (!locate(point.position, cell)) return;
    int& head = heads_[index(cell[0], cell[1], cell[2])];
    next_.push_back(head);
    points_.push_back({point.position, point.normal});
    head = static_cast<int>(points_.size()) - 1;
  }
  bool conflicts(const Vec3& position, const Vec3& normal) const {
    std::array<int, 3> cell;
    if (!locate(position, cell)) return true;
    for (int z = cell[2] - 1; z <= cell[2] + 1; ++z)
      for (int y = cell[1] - 1; y <= cell[1] + 1; ++y)
        for (int x = cell[0] - 1; x <= cell[0] + 1; ++x)
          for (int i = heads_[index(x, y, z)]; i >= 0; i = next_[static_cast<std::size_t>(i)]) {
            const auto& [other, other_normal] = points_[static_cast<std::size_t>(i)];
            if ((other - position).length2() < radius2_ && dot(other_normal, normal) > kSameSheetCosine)
              return true;
          }
    return false;
  }

 private:
  static std::size_t index(int x, int y, int z) {
    return static_cast<std::size_t>(((z + 1) * (kGridCells + 2) + y + 1) * (kGridCells + 2) + x + 1);
  }
  // Cells 0 to kGridCells - 1 along each axis, the halo included; one more layer around stays empty.
  bool locate(const Vec3& p, std::array<int, 3>& cell) const {
    for (int axis = 0; axis < 3; ++axis) {
      const float c = std::floor((p[axis] - corner_[axis]) * inverse_) + 1;
      if (!(c >= 0 && c < static_cast<float>(kGridCells))) return false;
      cell[static_cast<std::size_t>(axis)] = static_cast<int>(c);
    }
    return true;
  }

  struct Entry {
    Vec3 position, normal;
  };
  Vec3 corner_;
  float inverse_, radius2_;
  std::array<int, (kGridCells + 2) * (kGridCells + 2) * (kGridCells + 2)> heads_;
  std::vector<int> next_;
  std::vector<Entry> points_;
};

class DartThrower {
 public:
  DartThrower(const GroupSurface& surface, double target, std::uint64_t seed)
      : surface_(surface), seed_(seed) {
    radius_ = static_cast<float>(kRelativeRadius * hexagonal_spacing(surface.areas.total(), target));
    for (const Vec3& p : surface.positions) box_.extendBy(p);
    // Block coordinates have to fit their bits; where space is that large blocks hold more than a block's
    // cells, which is then the caller's limit on the number of points.
    block_size_ = radius_ * static_cast<float>(kBlockCells);
  }

  static bool fits(const GroupSurface& surface, double target) {
    Box3 box;
    for (const Vec3& p : surface.positions) box.extendBy(p);
    const double block = kRelativeRadius * hexagonal_spacing(surface.areas.total(), target) * kBlockCells;
    const Vec3 size = box.size();
    return std::max({size.x, size.y, size.z}) / block < (1 << kCoordinateBits) - 2;
  }

  void throw_round(int round, std::size_t candidates) {
    candidates_.resize(candidates);
    make_candidates(round);
    parallel_sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
      return a.key != b.key ? a.key < b.key
                            : std::tie(a.triangle, a.position.x, a.position.y, a.position.z) <
                                  std::tie(b.triangle, b.position.x, b.position.y, b.position.z);
    });
    find_runs();
    for (unsigned phase = 0; phase < 8; ++phase) throw_phase(phase);
  }

  std::size_t count() const {
    std::size_t sum = 0;
    for (const Block& block : blocks_) sum += block.points.size();
    return sum;
  }

  std::vector<PlacedPoint> take_points() {
    // In the order of the blocks' coordinates, which does not depend on when a block was first met.
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
    for (std::uint32_t b = 0; b < blocks_.size(); ++b) {
      const auto& c = blocks_[b].coordinates;
      order.emplace_back(pack(c[0], c[1], c[2]), b);
    }
    std::sort(order.begin(), order.end());
    std::vector<PlacedPoint> points;
    for (const auto& [key, b] : order) {
      points.insert(points.end(), blocks_[b].points.begin(), blocks_[b].points.end());
      std::vector<PlacedPoint>().swap(blocks_[b].points);
    }
    return points;
  }

 private:
  struct Run {
    std::size_t begin, end;
    std::uint32_t block;
  };

  // One candidate per stratum of area, keyed by its number.
  void make_candidates(int round) {
    const std::size_t count = candidates_.size();
    parallel_for(count, 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        Rng rng(hash_words(seed_, static_cast<std::uint64_t>(round), i));
        double u = (static_cast<double>(i) + rng.next_double()) / static_cast<double>(count);
        const std::size_t triangle = surface_.areas.sample(u);
        const Vec2 b = sample_uniform_triangle(rng.next_2d());
        const Triangle& t = surface_.triangles[triangle];
        const Vec3& p0 = surface_.positions[t[0]];
        const Vec3 p = p0 + (surface_.positions[t[1]] - p0) * b.x + (surface_.positions[t[2]] - p0) * b.y;
        std::array<int, 3> c;
        for (int axis = 0; axis < 3; ++axis)
          c[static_cast<std::size_t>(axis)] = static_cast<int>((p[axis] - box_.min[axis]) / block_size_) + 1;
        candidates_[i] = {pack(c[0], c[1], c[2]) << 16 | rng.next_bits() >> 48, p,
                          static_cast<std::uint32_t>(triangle)};
      }
    });
  }

  // Consecutive candidates of one block; blocks that were not met before are added.
  void find_runs() {
    runs_.clear();
    for (std::size_t begin = 0; begin < candidates_.size();) {
      const std::uint64_t key = candidates_[begin].key >> 16;
      std::size_t end = begin + 1;
      while (end < candidates_.size() && candidates_[end].key >> 16 == key) ++end;
      const auto [at, added] = numbers_.try_emplace(key, static_cast<std::uint32_t>(blocks_.size()));
      if (added) {
        constexpr std::uint64_t kMask = (1u << kCoordinateBits) - 1;
        blocks_.push_back({{static_cast<int>(key >> (2 * kCoordinateBits)),
                            static_cast<int>(key >> kCoordinateBits & kMask), static_cast<int>(key & kMask)},
                           {}});
      }
      runs_.push_back({begin, end, at->second});
      begin = end;
    }
  }

  // Blocks of one phase are a whole block apart in each direction, so that what one reads no other writes.
  void throw_phase(unsigned phase) {
    std::vector<const Run*> runs;
    for (const Run& run : runs_) {
      const auto& c = blocks_[run.block].coordinates;
      const auto parity = static_cast<unsigned>((c[0] & 1) | (c[1] & 1) << 1 | (c[2] & 1) << 2);
      if (parity == phase) runs.push_back(&run);
    }
    parallel_for(runs.size(), 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) throw_into_block(*runs[i]);
    });
  }

  void throw_into_block(const Run& run) {
    Block& block = blocks_[run.block];
    const auto& c = block.coordinates;
    const Vec3 corner = box_.min + Vec3(static_cast<float>(c[0] - 1), static_cast<float>(c[1] - 1),
                                        static_cast<float>(c[2] - 1)) *
                                       block_size_;
    LocalGrid grid(corner, radius_);
    for (int z = c[2] - 1; z <= c[2] + 1; ++z)
      for (int y = c[1] - 1; y <= c[1] + 1; ++y)
        for (int x = c[0] - 1; x <= c[0] + 1; ++x)
          if (const auto at = numbers_.find(pack(x, y, z)); at != numbers_.end())
            for (const PlacedPoint& point : blocks_[at->second].points) grid.add(point);
    for (std::size_t i = run.begin; i < run.end; ++i) {
      const Candidate& candidate = candidates_[i];
      const PlacedPoint point{candidate.position, candidate.triangle, surface_.normal(candidate.triangle)};
      if (grid.conflicts(point.position, point.normal)) continue;
      grid.add(point);
      block.points.push_back(point);
    }
  }

  const GroupSurface& surface_;
  std::uint64_t seed_;
  float radius_, block_size_;
  Box3 box_;
  std::vector<Candidate> candidates_;
  std::vector<Run> runs_;
  std::vector<Block> blocks_;
  std::unordered_map<std::uint64_t, std::uint32_t> numbers_;  // block coordinates to index
};

}  // namespace

std::vector<PlacedPoint> place_points(const GroupSurface& surface, double target, std::uint64_t seed,
                                      Progress& progress) {
  if (!(surface.areas.total() > 0) || !(target > 0)) return {};
  if (!DartThrower::fits(surface, target))
    fail(ErrorCode::kLimit, "",
         "the samples are too close together for an object of this size; check `scale` or use fewer points");
  DartThrower thrower(surface, target, seed);
  progress.begin("placing samples", "rounds", kRounds);
  // On dust and hair, which have room for any number of points, nearly every dart sticks: no round throws
  // more than are missing at the rate at which those of the round before stuck.
  const double most = std::max(target, 256.0);
  double rate = 1;
  for (int round = 0; round < kRounds; ++round) {
    const auto before = static_cast<double>(thrower.count());
    if (before >= target) break;
    const double candidates = std::ceil(std::min(most, (target - before) / rate));
    thrower.throw_round(round, static_cast<std::size_t>(candidates));
    rate = (static_cast<double>(thrower.count()) - before) / candidates;
    progress.advance(1);
  }
  progress.end();
  return thrower.take_points();
}

}  // namespace nacre
