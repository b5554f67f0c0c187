// Division of triangles into patches, and of their nodes into blocks of space.
#include <algorithm>
#include <bit>

#include "cache/patch_split.h"
#include "nacre/base/parallel.h"
#include "nacre/cache/exitance_field.h"

namespace nacre {
namespace {

// Triangles that are divided side by side.
constexpr std::size_t kRun = 8192;

// Edges up to this length, squared, have no midpoint.
float straight_edge2(double distance) { return static_cast<float>(square(distance / 3)); }

// Numbers for keys in the order of their first appearance: open addressing.
template <class Key, class Hash>
class Numbering {
 public:
  explicit Numbering(std::size_t expected) {
    keys_.reserve(expected);
    slots_.assign(std::bit_ceil(2 * expected + 64), kFree);
  }
  std::uint32_t find_or_add(const Key& key) {
    if (2 * keys_.size() >= slots_.size()) grow();
    std::size_t slot = Hash()(key) & (slots_.size() - 1);
    for (; slots_[slot] != kFree; slot = (slot + 1) & (slots_.size() - 1))
      if (keys_[slots_[slot]] == key) return slots_[slot];
    slots_[slot] = static_cast<std::uint32_t>(keys_.size());
    keys_.push_back(key);
    return slots_[slot];
  }
  const std::vector<Key>& keys() const { return keys_; }

 private:
  static constexpr std::uint32_t kFree = 0xffffffffu;
  void grow() {
    slots_.assign(2 * slots_.size(), kFree);
    for (std::uint32_t i = 0; i < keys_.size(); ++i) {
      std::size_t slot = Hash()(keys_[i]) & (slots_.size() - 1);
      while (slots_[slot] != kFree) slot = (slot + 1) & (slots_.size() - 1);
      slots_[slot] = i;
    }
  }
  std::vector<std::uint32_t> slots_;
  std::vector<Key> keys_;
};

std::uint64_t mix(std::uint64_t h) noexcept {
  h = (h ^ h >> 32) * 0xd6e8feb86659fd93ull;
  h = (h ^ h >> 32) * 0xd6e8feb86659fd93ull;
  return h ^ h >> 32;
}
struct HashPosition {
  std::size_t operator()(const Vec3& p) const noexcept {
    // + 0: -0 is 0.
    const auto bits = [](float x) { return std::uint64_t{std::bit_cast<std::uint32_t>(x + 0.0f)}; };
    return mix((bits(p.x) << 32 | bits(p.y)) * 0x9e3779b97f4a7c15ull + bits(p.z));
  }
};
struct HashCode {
  std::size_t operator()(std::uint64_t code) const noexcept { return mix(code); }
};

}  // namespace

// What a run of triangles of one mesh is divided into. Nodes from the number of vertices on, patches and
// parts of parts are numbered within the run.
struct ExitanceField::Division {
  std::size_t mesh, begin, end;
  std::vector<std::uint32_t> triangles;  // those that are more than their corners,
  std::vector<Part> wholes;              // what they are,
  std::vector<Part> parts;               // and theirs
  std::vector<Patch> patches;
  std::vector<Vec3> positions;
  std::vector<std::uint32_t> numbers;  // of those nodes in the field
  std::size_t first_part, first_patch;
};

// Divides triangles until no edge is too long.
class ExitanceField::Divider {
 public:
  Divider(std::span<const Vec3> vertices, double distance, Division& into)
      : vertices_(vertices),
        longest2_(static_cast<float>(square(distance))),
        straight2_(straight_edge2(distance)),
        into_(into),
        extras_(64) {}

  void divide_triangle(std::size_t index, const Triangle& t) {
    const Part whole = divide(t, 0);
    if (whole.mark == 0) return;
    into_.triangles.push_back(static_cast<std::uint32_t>(index));
    into_.wholes.push_back(whole);
  }
  void end() { into_.positions = extras_.keys(); }

 private:
  Vec3 at(std::uint32_t node) const {
    return node < vertices_.size() ? vertices_[node] : extras_.keys()[node - vertices_.size()];
  }
  float length2(std::uint32_t a, std::uint32_t b) const { return (at(a) - at(b)).length2(); }
  // The same bits from both ends.
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    return static_cast<std::uint32_t>(vertices_.size()) + extras_.find_or_add((at(a) + at(b)) * 0.5f);
  }

  Part divide(const Triangle& t, int depth) {
    std::array<float, 3> edges2;
    for (std::size_t i = 0; i < 3; ++i) edges2[i] = length2(t[i], t[(i + 1) % 3]);
    // Coordinates too coarse for the distance of nodes have no middle between them.
    constexpr int kDeepest = 40;
    const auto is_long = [&](std::size_t i) { return edges2[i] > longest2_ && depth < kDeepest; };
    const int count = is_long(0) + is_long(1) + is_long(2);
    if (count == 0) {
      if (std::max({edges2[0], edges2[1], edges2[2]}) <= straight2_) return {{t[0], t[1], t[2]}, 0};
      Patch patch;
      for (std::size_t i = 0; i < 3; ++i) {
        patch.nodes[i] = t[i];
        patch.nodes[3 + i] = edges2[i] > straight2_ ? middle(t[i], t[(i + 1) % 3]) : kNone;
      }
      into_.patches.push_back(patch);
      return {{static_cast<std::uint32_t>(into_.patches.size() - 1), 0, 0}, kCurved};
    }
    std::uint32_t turn = 0;
    if (count == 1)
      while (!is_long(turn)) ++turn;
    if (count == 2)
      while (is_long((turn + 1) % 3)) ++turn;
    const std::uint32_t a = t[turn], b = t[(turn + 1) % 3], c = t[(turn + 2) % 3];
    std::array<Triangle, 4> pieces;
    std::uint32_t pattern = kThreeEdges;
    if (count == 1) {
      const std::uint32_t ab = middle(a, b);
      pattern = kOneEdge;
      pieces = {{{a, ab, c}, {ab, b, c}}};
    } else if (count == 2) {
      const std::uint32_t ab = middle(a, b), ca = middle(c, a);
      const bool other = length2(b, ca) < length2(ab, c);
      pattern = other ? kTwoEdgesOther : kTwoEdges;
      pieces = {{{a, ab, ca}, {ab, b, c}, {ab, c, ca}}};
      if (other) pieces = {{{a, ab, ca}, {b, c, ca}, {ab, b, ca}}};
    } else {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      pieces = {{{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {bc, ca, ab}}};
    }
    pattern |= turn << kTurnShift;
    std::array<Part, 4> made;
    for (std::uint32_t i = 0; i < part_count(pattern); ++i) made[i] = divide(pieces[i], depth + 1);
    const auto first = static_cast<std::uint32_t>(into_.parts.size());
    into_.parts.insert(into_.parts.end(), made.begin(), made.begin() + part_count(pattern));
    return {{first, pattern, 0}, kDivided};
  }

  std::span<const Vec3> vertices_;
  float longest2_, straight2_;
  Division& into_;
  Numbering<Vec3, HashPosition> extras_;
};

double ExitanceField::predict_nodes(std::span<const Mesh* const> meshes, double distance) {
  const float straight2 = straight_edge2(distance);
  double nodes = 0;
  for (const Mesh* const mesh : meshes) {
    if (!mesh) continue;
    const std::vector<Triangle>& triangles = mesh->triangles;
    std::vector<double> runs((triangles.size() + kRun - 1) / kRun);
    parallel_for(runs.size(), 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t i = first * kRun; i < std::min(last * kRun, triangles.size()); ++i) {
        const Triangle& t = triangles[i];
        const Vec3 a = mesh->positions[t[0]], ab = mesh->positions[t[1]] - a, ac = mesh->positions[t[2]] - a;
        if (std::max({ab.length2(), ac.length2(), (ac - ab).length2()}) <= straight2) {
          runs[i / kRun] += 1;
          continue;
        }
        // Edges count for slivers.
        runs[i / kRun] += 1 + 2 * double{ab.length() + ac.length() + (ac - ab).length()} / distance +
                          5 * double{ab.cross(ac).length()} / square(distance);
      }
    });
    for (const double run : runs) nodes += run;
  }
  return nodes;
}

// A patch over which M_o bends by more than a share of itself, or changes so much along an edge, may err by
// more than the tolerance: light there is as narrow as a mean free path. Errors grow like the bend to 3/2 and
// the square of the change.
ExitanceField::ExitanceField(std::vector<const Mesh*> meshes, const Exitance& exitance, double distance,
                             double tolerance)
    : exitance_(exitance),
      materials_(exitance.material_count()),
      quads_((3 * materials_ + 3) / 4),
      meshes_(std::move(meshes)),
      most_bend_(static_cast<float>(0.05 * std::pow(strictness(tolerance), 2.0 / 3))),
      most_change_(static_cast<float>(0.4 * std::sqrt(strictness(tolerance)))) {
  std::size_t vertices = 0;
  for (const Mesh* const mesh : meshes_)
    if (mesh) vertices += mesh->positions.size();
  positions_.reserve(2 * vertices);
  divide_meshes(distance);
  values_ = LargeArray<Float4>(positions_.size() * quads_);
  block_state_ = std::make_unique<std::atomic<std::uint8_t>[]>(block_begin_.size());
}

void ExitanceField::divide_meshes(double distance) {
  std::vector<Division> runs;
  std::vector<std::uint32_t> first_vertex;
  std::size_t triangles = 0;
  for (std::size_t m = 0; m < meshes_.size(); ++m) {
    first_triangle_.push_back(static_cast<std::uint32_t>(triangles));
    first_vertex.push_back(static_cast<std::uint32_t>(positions_.size()));
    if (!meshes_[m]) continue;
    positions_.insert(positions_.end(), meshes_[m]->positions.begin(), meshes_[m]->positions.end());
    const std::size_t count = meshes_[m]->triangles.size();
    triangles += count;
    for (std::size_t begin = 0; begin < count; begin += kRun) {
      Division& run = runs.emplace_back();
      run.mesh = m;
      run.begin = begin;
      run.end = std::min(begin + kRun, count);
    }
  }
  const auto corners = [&](const Division& run, std::size_t triangle) -> Triangle {
    const Triangle& t = meshes_[run.mesh]->triangles[triangle];
    const std::uint32_t first = first_vertex[run.mesh];
    return {first + t[0], first + t[1], first + t[2]};
  };
  parallel_for(runs.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t r = first; r < last; ++r) {
      Divider divider(positions_, distance, runs[r]);
      for (std::size_t i = runs[r].begin; i < runs[r].end; ++i)
        divider.divide_triangle(i, corners(runs[r], i));
      divider.end();
    }
  });
  // One after the other, renumbered.
  const auto vertices = static_cast<std::uint32_t>(positions_.size());
  std::size_t part_count = triangles, patch_count = 0, extra_count = 0;
  for (Division& run : runs) {
    run.first_part = part_count;
    run.first_patch = patch_count;
    part_count += run.parts.size();
    patch_count += run.patches.size();
    extra_count += run.positions.size();
  }
  Numbering<Vec3, HashPosition> extras(extra_count);
  for (Division& run : runs)
    for (const Vec3& p : run.positions) run.numbers.push_back(vertices + extras.find_or_add(p));
  positions_.insert(positions_.end(), extras.keys().begin(), extras.keys().end());
  const std::vector<std::uint32_t> places = sort_nodes();
  parts_ = LargeArray<Part>(part_count);
  patches_.resize(patch_count);
  parallel_for(runs.size(), 1, [&](std::size_t first, std::size_t last) {
    for (std::size_t r = first; r < last; ++r) place_run(runs[r], vertices, places, corners);
  });
}

// Puts a run where it belongs.
template <class Corners>
void ExitanceField::place_run(const Division& run, std::uint32_t vertices,
                              std::span<const std::uint32_t> places, const Corners& corners) {
  const auto renumber_node = [&](std::uint32_t& node) {
    if (node != kNone) node = places[node < vertices ? node : run.numbers[node - vertices]];
  };
  const auto renumber = [&](Part part) {
    if (part.mark == 0)
      for (std::uint32_t& node : part.data) renumber_node(node);
    else
      part.data[0] += static_cast<std::uint32_t>(part.mark == kCurved ? run.first_patch : run.first_part);
    return part;
  };
  Part* const own = &parts_[first_triangle_[run.mesh]];
  for (std::size_t i = run.begin; i < run.end; ++i) own[i] = renumber({corners(run, i), 0});
  for (std::size_t i = 0; i < run.triangles.size(); ++i) own[run.triangles[i]] = renumber(run.wholes[i]);
  std::ranges::transform(run.parts, &parts_[run.first_part], renumber);
  for (std::size_t i = 0; i < run.patches.size(); ++i) {
    Patch patch = run.patches[i];
    for (std::uint32_t& node : patch.nodes) renumber_node(node);
    patches_[run.first_patch + i] = patch;
  }
}

// Sorts nodes by the blocks of space that they are in; gives their places in the new order.
std::vector<std::uint32_t> ExitanceField::sort_nodes() {
  std::vector<std::uint64_t> codes(positions_.size());
  parallel_for(codes.size(), kRun, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      codes[i] = exitance_.cell_code(positions_[i]) >> 3 * Exitance::kWholeLevel;
  });
  Numbering<std::uint64_t, HashCode> numbers(codes.size() / 16);
  std::vector<std::uint32_t> first_seen(codes.size());
  for (std::size_t i = 0; i < codes.size(); ++i)
    first_seen[i] = i > 0 && codes[i] == codes[i - 1] ? first_seen[i - 1] : numbers.find_or_add(codes[i]);
  // In Morton order, so that neighbours share what is far.
  const std::vector<std::uint64_t>& keys = numbers.keys();
  std::vector<std::uint32_t> order(keys.size()), rank(keys.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  parallel_sort(order.begin(), order.end(),
                [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  for (std::uint32_t i = 0; i < order.size(); ++i) rank[order[i]] = i;
  block_of_.resize(codes.size());
  block_begin_.assign(keys.size() + 1, 0);
  for (std::size_t i = 0; i < codes.size(); ++i) {
    block_of_[i] = rank[first_seen[i]];
    ++block_begin_[block_of_[i] + 1];
  }
  for (std::size_t i = 1; i < block_begin_.size(); ++i) block_begin_[i] += block_begin_[i - 1];
  std::vector<std::uint32_t> places(codes.size()), next(block_begin_.begin(), block_begin_.end() - 1);
  for (std::uint32_t i = 0; i < codes.size(); ++i) places[i] = next[block_of_[i]]++;
  std::vector<Vec3> positions(codes.size());
  for (std::uint32_t i = 0; i < codes.size(); ++i) positions[places[i]] = positions_[i];
  positions_.swap(positions);
  for (std::uint32_t b = 0; b + 1 < block_begin_.size(); ++b)
    std::fill(block_of_.begin() + block_begin_[b], block_of_.begin() + block_begin_[b + 1], b);
  return places;
}

}  // namespace nacre
