// Division of triangles into patches, and their interpolation.
#include "nacre/cache/exitance_field.h"

#include <algorithm>
#include <numeric>

#include "nacre/base/parallel.h"

namespace nacre {
namespace {

enum BlockState : std::uint8_t { kEmpty, kBusy, kFull };
enum PatchState : std::uint8_t { kUnknown, kSmooth, kSteep };

// A patch over which M_o bends by more than this share of itself, or changes so much along an edge, may err
// by more than the tolerance: light there is as narrow as a mean free path.
constexpr float kMostBend = 0.02f, kMostChange = 0.2f;

// How a triangle is divided, once turned so that the edges concerned come in this order.
enum Pattern : std::uint32_t {
  kOneEdge,        // ab
  kTwoEdges,       // ab and ca, the rest divided from the middle of ab to c
  kTwoEdgesOther,  // the same, from b to the middle of ca
  kThreeEdges,
  kPatternMask = 3,
  kTurnShift = 2,  // then by how many vertices it was turned
};

constexpr std::uint32_t kSplitBit = 0x80000000u;

std::uint32_t part_count(std::uint32_t pattern) {
  constexpr std::uint32_t kCounts[] = {2, 3, 3, 4};
  return kCounts[pattern & kPatternMask];
}

// The part of a divided triangle that a point is in, and its weights there.
std::uint32_t find_part(std::uint32_t pattern, float& u, float& v) noexcept {
  float w = std::max(1 - u - v, 0.0f);
  for (std::uint32_t turn = pattern >> kTurnShift; turn > 0; --turn) {  // a b c -> b c a
    const float first = w;
    w = u;
    u = v;
    v = first;
  }
  const auto go = [&](std::uint32_t part, float part_u, float part_v) {
    u = part_u;
    v = part_v;
    return part;
  };
  switch (pattern & kPatternMask) {
    case kOneEdge:
      return w >= u ? go(0, 2 * u, v) : go(1, u - w, v);
    case kTwoEdges:
      if (w >= 0.5f) return go(0, 2 * u, 2 * v);
      return u >= w ? go(1, u - w, v) : go(2, v - w + u, 2 * (w - u));
    case kTwoEdgesOther:
      if (w >= 0.5f) return go(0, 2 * u, 2 * v);
      return v >= w ? go(1, v - w, 2 * w) : go(2, u - w + v, 2 * v);
    default:
      if (w >= 0.5f) return go(0, 2 * u, 2 * v);
      if (u >= 0.5f) return go(1, u - w - v, 2 * v);
      if (v >= 0.5f) return go(2, 2 * u, v - w - u);
      return go(3, 1 - 2 * u, 1 - 2 * v);
  }
}

// Numbers for positions, one for each that differs in a bit: open addressing.
class NodeTable {
 public:
  explicit NodeTable(std::size_t expected) { slots_.assign(std::bit_ceil(2 * expected + 16), kFree); }

  std::uint32_t find_or_add(const Vec3& p, std::vector<Vec3>& positions) {
    if (2 * positions.size() >= slots_.size()) grow(positions);
    std::size_t slot = hash(p) & (slots_.size() - 1);
    for (; slots_[slot] != kFree; slot = (slot + 1) & (slots_.size() - 1))
      if (positions[slots_[slot]] == p) return slots_[slot];
    slots_[slot] = static_cast<std::uint32_t>(positions.size());
    positions.push_back(p);
    return slots_[slot];
  }

 private:
  static constexpr std::uint32_t kFree = 0xffffffffu;
  static std::size_t hash(const Vec3& p) noexcept {
    // + 0: -0 is 0.
    const auto bits = [](float x) { return std::uint64_t{std::bit_cast<std::uint32_t>(x + 0.0f)}; };
    std::uint64_t h = bits(p.x) * 0x9e3779b97f4a7c15ull + bits(p.y);
    h = (h ^ h >> 32) * 0xd6e8feb86659fd93ull + bits(p.z);
    h = (h ^ h >> 32) * 0xd6e8feb86659fd93ull;
    return static_cast<std::size_t>(h ^ h >> 32);
  }
  void grow(const std::vector<Vec3>& positions) {
    slots_.assign(2 * slots_.size(), kFree);
    for (std::uint32_t i = 0; i < positions.size(); ++i) {
      std::size_t slot = hash(positions[i]) & (slots_.size() - 1);
      while (slots_[slot] != kFree) slot = (slot + 1) & (slots_.size() - 1);
      slots_[slot] = i;
    }
  }
  std::vector<std::uint32_t> slots_;
};

}  // namespace

// Divides triangles until no edge is too long.
class ExitanceField::Builder {
 public:
  Builder(ExitanceField& field, double distance, std::size_t expected)
      : field_(field),
        longest2_(static_cast<float>(square(distance))),
        straight2_(static_cast<float>(square(distance / 3))),
        table_(expected) {}

  std::uint32_t add_node(const Vec3& p) { return table_.find_or_add(p, field_.positions_); }

  // A part of parts_ for the triangle of these nodes.
  std::uint32_t divide(const Triangle& t, int depth) {
    std::array<float, 3> length2;
    for (std::size_t i = 0; i < 3; ++i) length2[i] = (at(t[i]) - at(t[(i + 1) % 3])).length2();
    // Coordinates too coarse for the distance of nodes have no middle between them.
    constexpr int kDeepest = 40;
    const auto is_long = [&](std::size_t i) { return length2[i] > longest2_ && depth < kDeepest; };
    const int count = is_long(0) + is_long(1) + is_long(2);
    if (count == 0) {
      Patch patch;
      for (std::size_t i = 0; i < 3; ++i) {
        patch.nodes[i] = t[i];
        patch.nodes[3 + i] = length2[i] > straight2_ ? middle(t[i], t[(i + 1) % 3]) : kNone;
      }
      field_.patches_.push_back(patch);
      return static_cast<std::uint32_t>(field_.patches_.size() - 1);
    }
    std::uint32_t turn = 0;
    if (count == 1)
      while (!is_long(turn)) ++turn;
    if (count == 2)
      while (is_long((turn + 1) % 3)) ++turn;
    const std::uint32_t a = t[turn], b = t[(turn + 1) % 3], c = t[(turn + 2) % 3];
    std::array<Triangle, 4> parts;
    std::uint32_t pattern = kThreeEdges;
    if (count == 1) {
      const std::uint32_t ab = middle(a, b);
      pattern = kOneEdge;
      parts = {{{a, ab, c}, {ab, b, c}}};
    } else if (count == 2) {
      const std::uint32_t ab = middle(a, b), ca = middle(c, a);
      const bool other = (at(b) - at(ca)).length2() < (at(ab) - at(c)).length2();
      pattern = other ? kTwoEdgesOther : kTwoEdges;
      parts = {{{a, ab, ca}, {ab, b, c}, {ab, c, ca}}};
      if (other) parts = {{{a, ab, ca}, {b, c, ca}, {ab, b, ca}}};
    } else {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      parts = {{{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {bc, ca, ab}}};
    }
    pattern |= turn << kTurnShift;
    const auto split = static_cast<std::uint32_t>(field_.splits_.size());
    field_.splits_.push_back({});
    std::array<std::uint32_t, 4> made{};
    for (std::uint32_t i = 0; i < part_count(pattern); ++i) made[i] = divide(parts[i], depth + 1);
    field_.splits_[split] = {static_cast<std::uint32_t>(field_.parts_.size()), pattern};
    field_.parts_.insert(field_.parts_.end(), made.begin(), made.begin() + part_count(pattern));
    return kSplitBit | split;
  }

 private:
  const Vec3& at(std::uint32_t node) const { return field_.positions_[node]; }
  // The same bits from both ends.
  std::uint32_t middle(std::uint32_t a, std::uint32_t b) { return add_node((at(a) + at(b)) * 0.5f); }

  ExitanceField& field_;
  float longest2_, straight2_;
  NodeTable table_;
};

double ExitanceField::predict_nodes(std::span<const Mesh* const> meshes, double distance) {
  double nodes = 0;
  for (const Mesh* const mesh : meshes)
    if (mesh) {
      double longest = 0;  // slivers
      for (const Triangle& t : mesh->triangles)
        for (std::size_t i = 0; i < 3; ++i)
          longest += double{(mesh->positions[t[i]] - mesh->positions[t[(i + 1) % 3]]).length()};
      nodes += static_cast<double>(mesh->triangles.size()) + 2 * longest / distance +
               10 * surface_area(*mesh) / square(distance);
    }
  return nodes;
}

ExitanceField::ExitanceField(std::vector<const Mesh*> meshes, const Exitance& exitance, double distance)
    : exitance_(exitance), meshes_(std::move(meshes)) {
  std::size_t triangles = 0;
  for (const Mesh* const mesh : meshes_) {
    first_triangle_.push_back(static_cast<std::uint32_t>(triangles));
    if (mesh) triangles += mesh->triangles.size();
  }
  parts_.resize(triangles);
  patches_.reserve(triangles);
  Builder builder(*this, distance, triangles);
  std::vector<std::uint32_t> node_of_vertex;
  for (std::size_t m = 0; m < meshes_.size(); ++m) {
    if (!meshes_[m]) continue;
    node_of_vertex.clear();
    for (const Vec3& p : meshes_[m]->positions) node_of_vertex.push_back(builder.add_node(p));
    for (std::size_t i = 0; i < meshes_[m]->triangles.size(); ++i) {
      const Triangle& t = meshes_[m]->triangles[i];
      const std::uint32_t part =
          builder.divide({node_of_vertex[t[0]], node_of_vertex[t[1]], node_of_vertex[t[2]]}, 0);
      parts_[first_triangle_[m] + i] = part;
    }
  }

  // Nodes of one block side by side, in the order in which the sum is cheapest.
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(positions_.size());
  parallel_for(order.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      order[i] = {exitance.cell_code(positions_[i]), static_cast<std::uint32_t>(i)};
  });
  parallel_sort(order.begin(), order.end(), std::less<>());
  std::vector<std::uint32_t> renumbered(order.size());
  std::vector<Vec3> sorted(order.size());
  block_of_.resize(order.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    renumbered[order[i].second] = i;
    sorted[i] = positions_[order[i].second];
    if (i == 0 || block_of_cell(order[i].first) != block_of_cell(order[i - 1].first))
      block_begin_.push_back(i);
    block_of_[i] = static_cast<std::uint32_t>(block_begin_.size() - 1);
  }
  positions_.swap(sorted);
  const std::size_t blocks = block_begin_.size();
  block_begin_.push_back(static_cast<std::uint32_t>(order.size()));
  parallel_for(patches_.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      for (std::uint32_t& node : patches_[i].nodes)
        if (node != kNone) node = renumbered[node];
  });
  values_.resize(positions_.size());
  block_state_ = std::make_unique<std::atomic<std::uint8_t>[]>(blocks);
  patch_state_ = std::make_unique<std::atomic<std::uint8_t>[]>(patches_.size());
}

// The patch that a hit lies in, and its weights there.
std::uint32_t ExitanceField::find_patch(const Hit& hit, float& u, float& v) const noexcept {
  u = hit.u;
  v = hit.v;
  std::uint32_t part = parts_[first_triangle_[hit.mesh] + hit.triangle];
  while (part & kSplitBit) {
    const Split& split = splits_[part & ~kSplitBit];
    part = parts_[split.first + find_part(split.pattern, u, v)];
  }
  return part;
}

// Evaluates the nodes of blocks that this thread has claimed, all at once, so that they share what is far.
void ExitanceField::fill_blocks(std::span<const std::uint32_t> blocks, std::uint64_t& evaluations) const {
  std::vector<Vec3> positions;
  for (const std::uint32_t block : blocks)
    positions.insert(positions.end(), positions_.begin() + block_begin_[block],
                     positions_.begin() + block_begin_[block + 1]);
  std::vector<Rgb> values(positions.size());
  exitance_.eval_whole(positions, values, evaluations);
  auto value = values.begin();
  for (const std::uint32_t block : blocks) {
    const auto count = static_cast<std::ptrdiff_t>(block_begin_[block + 1] - block_begin_[block]);
    std::copy(value, value + count, values_.begin() + block_begin_[block]);
    value += count;
    block_state_[block].store(kFull, std::memory_order_release);
    block_state_[block].notify_all();
  }
}

bool ExitanceField::is_steep(const Patch& patch) const noexcept {
  for (std::size_t i = 0; i < 3; ++i) {
    const Rgb &a = values_[patch.nodes[i]], &b = values_[patch.nodes[(i + 1) % 3]];
    const Rgb mean = (a + b) * 0.5f;
    const bool bends = patch.nodes[3 + i] != kNone;
    const Rgb bend = bends ? values_[patch.nodes[3 + i]] - mean : Rgb(0, 0, 0);
    for (int k = 0; k < 3; ++k) {
      const float size = bends ? std::max(mean[k], values_[patch.nodes[3 + i]][k]) : mean[k];
      if (std::abs(bend[k]) > kMostBend * size || (!bends && std::abs(a[k] - b[k]) > kMostChange * size))
        return true;
    }
  }
  return false;
}

Rgb ExitanceField::interpolate(const Patch& patch, float u, float v) const noexcept {
  const float w = 1 - u - v;
  const Rgb &a = values_[patch.nodes[0]], &b = values_[patch.nodes[1]], &c = values_[patch.nodes[2]];
  Rgb value = a * w + b * u + c * v;
  const std::array<float, 3> bumps{4 * w * u, 4 * u * v, 4 * v * w};
  const std::array<const Rgb*, 4> corners{&a, &b, &c, &a};
  for (std::size_t i = 0; i < 3; ++i)
    if (patch.nodes[3 + i] != kNone)
      value += (values_[patch.nodes[3 + i]] - (*corners[i] + *corners[i + 1]) * 0.5f) * bumps[i];
  // A parabola may undershoot where light ends.
  return {std::max(value.x, 0.0f), std::max(value.y, 0.0f), std::max(value.z, 0.0f)};
}

void ExitanceField::eval(std::span<const Hit> hits, std::span<Rgb> exitance,
                         std::uint64_t& evaluations) const {
  struct Place {
    std::uint32_t patch;
    float u, v;
  };
  std::vector<Place> places(hits.size());
  std::vector<std::uint32_t> missing, blocks, claimed, awaited;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    places[i].patch = find_patch(hits[i], places[i].u, places[i].v);
    if (!patch_state_[places[i].patch].load(std::memory_order_acquire)) missing.push_back(places[i].patch);
  }
  for (const std::uint32_t patch : missing)
    for (const std::uint32_t node : patches_[patch].nodes)
      if (node != kNone && block_state_[block_of_[node]].load(std::memory_order_acquire) != kFull)
        blocks.push_back(block_of_[node]);
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  for (const std::uint32_t block : blocks) {
    std::uint8_t state = kEmpty;
    if (block_state_[block].compare_exchange_strong(state, kBusy))
      claimed.push_back(block);
    else if (state == kBusy)
      awaited.push_back(block);
  }
  if (!claimed.empty()) fill_blocks(claimed, evaluations);
  for (const std::uint32_t block : awaited) block_state_[block].wait(kBusy, std::memory_order_acquire);
  for (const std::uint32_t patch : missing)
    patch_state_[patch].store(is_steep(patches_[patch]) ? kSteep : kSmooth, std::memory_order_release);
  std::vector<std::uint32_t> steep;
  for (std::uint32_t i = 0; i < hits.size(); ++i) {
    if (patch_state_[places[i].patch].load(std::memory_order_acquire) == kSteep)
      steep.push_back(i);
    else
      exitance[i] = interpolate(patches_[places[i].patch], places[i].u, places[i].v);
  }
  if (steep.empty()) return;
  std::vector<Vec3> positions;
  for (const std::uint32_t i : steep) positions.push_back(hit_position(*meshes_[hits[i].mesh], hits[i]));
  std::vector<Rgb> values(steep.size());
  exitance_.eval(positions, values, evaluations);
  for (std::size_t i = 0; i < steep.size(); ++i) exitance[steep[i]] = values[i];
}

}  // namespace nacre
