// Interpolation within patches, and filling of their nodes.
#include "nacre/cache/exitance_field.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <utility>

#include "cache/patch_split.h"
#include "nacre/base/parallel.h"

namespace nacre {
namespace {

enum BlockState : std::uint8_t { kEmpty, kBusy, kFull };

Float4 larger(Float4 a, Float4 b) noexcept { return a > b ? a : b; }
Float4 magnitude(Float4 x) noexcept { return larger(x, -x); }

// How many hits ahead memory is fetched.
constexpr std::size_t kAhead = 32;

// What is known of a part may be changed by others meanwhile, its kind may not.
template <class Part>
std::uint32_t load_mark(const Part& part, std::memory_order order) noexcept {
  return std::atomic_ref(const_cast<std::uint32_t&>(part.mark)).load(order);
}
template <class Part>
bool is_kind(const Part& part, std::uint32_t kind) noexcept {
  return (load_mark(part, std::memory_order_relaxed) & kind) != 0;
}
// Values at the nodes of a part that is known may be read.
template <class Part>
std::uint32_t mark_of(const Part& part) noexcept {
  return load_mark(part, std::memory_order_acquire);
}

// Filters out most of what was asked for before.
class Recent {
 public:
  Recent() { slots_.fill(0xffffffffu); }
  bool is_new(std::uint32_t index) noexcept {
    std::uint32_t& slot = slots_[index % slots_.size()];
    return std::exchange(slot, index) != index;
  }

 private:
  std::array<std::uint32_t, 1024> slots_;
};

}  // namespace

// The part that a hit lies in and that is not divided, and its weights there.
std::uint32_t ExitanceField::find_patch(const Hit& hit, float& u, float& v) const noexcept {
  u = hit.u;
  v = hit.v;
  std::uint32_t index = first_triangle_[hit.mesh] + hit.triangle;
  while (is_kind(parts_[index], kDivided))
    index = parts_[index].data[0] + find_part(parts_[index].data[1], u, v);
  return index;
}

ExitanceField::Patch ExitanceField::patch(const Part& part) const noexcept {
  const auto& t = part.data;
  return is_kind(part, kCurved) ? patches_[t[0]] : Patch{{t[0], t[1], t[2], kNone, kNone, kNone}};
}

void ExitanceField::fetch_nodes(const Part& part) const noexcept {
  constexpr std::size_t kLine = 64 / sizeof(Float4);
  const auto fetch = [&](std::uint32_t node) {
    for (std::size_t q = 0; q < quads_; q += kLine) __builtin_prefetch(values(node) + q);
  };
  if (!is_kind(part, kCurved)) {
    for (const std::uint32_t node : part.data) fetch(node);
  } else {
    for (const std::uint32_t node : patches_[part.data[0]].nodes) fetch(node != kNone ? node : 0);
  }
}

// What is beyond the last material is zero.
void ExitanceField::store(std::uint32_t node, const Rgb* materials) const noexcept {
  values(node)[quads_ - 1] = broadcast(0);
  std::memcpy(values(node), &materials->x, materials_ * sizeof(Rgb));
}

void ExitanceField::unpack(const Float4* packed, Rgb* materials) const noexcept {
  std::memcpy(&materials->x, packed, materials_ * sizeof(Rgb));
}

// Evaluates the nodes of blocks that this thread has claimed, all at once, so that they share what is far.
void ExitanceField::fill_blocks(std::span<const std::uint32_t> blocks, std::uint64_t& evaluations) const {
  std::vector<Vec3> positions;
  for (const std::uint32_t block : blocks)
    positions.insert(positions.end(), positions_.begin() + block_begin_[block],
                     positions_.begin() + block_begin_[block + 1]);
  std::vector<Rgb> results(positions.size() * materials_);
  exitance_.eval_whole(positions, results, evaluations);
  const Rgb* result = results.data();
  for (const std::uint32_t block : blocks) {
    for (std::uint32_t node = block_begin_[block]; node < block_begin_[block + 1]; ++node) {
      store(node, result);
      result += materials_;
    }
    block_state_[block].store(kFull, std::memory_order_release);
    block_state_[block].notify_all();
  }
}

// Fills blocks, or waits for the thread that does.
void ExitanceField::await_blocks(std::span<const std::uint32_t> blocks, std::uint64_t& evaluations) const {
  std::vector<std::uint32_t> claimed, awaited;
  for (const std::uint32_t block : blocks) {
    std::uint8_t state = kEmpty;
    if (block_state_[block].compare_exchange_strong(state, kBusy))
      claimed.push_back(block);
    else if (state == kBusy)
      awaited.push_back(block);
  }
  if (!claimed.empty()) fill_blocks(claimed, evaluations);
  for (const std::uint32_t block : awaited) block_state_[block].wait(kBusy, std::memory_order_acquire);
}

void ExitanceField::fill(std::uint64_t& evaluations) const {
  const std::size_t count = block_begin_.size() - 1;
  std::atomic<std::uint64_t> sum{0};
  parallel_for(count, 256, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> blocks(end - begin);
    std::iota(blocks.begin(), blocks.end(), static_cast<std::uint32_t>(begin));
    std::uint64_t own = 0;
    await_blocks(blocks, own);
    sum += own;
  });
  evaluations += sum;
  parallel_for(parts_.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (!is_kind(parts_[i], kDivided)) judge(parts_[i]);
  });
}

std::string ExitanceField::nodes_digest() const {
  const XXH128_hash_t hash = XXH3_128bits(positions_.data(), positions_.size() * sizeof(Vec3));
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

KeptExitance ExitanceField::keep() const {
  KeptExitance kept;
  kept.filled.resize(block_begin_.size() - 1);
  kept.values.resize(positions_.size() * materials_, Rgb(0, 0, 0));
  for (std::size_t block = 0; block < kept.filled.size(); ++block) {
    if (block_state_[block].load(std::memory_order_acquire) != kFull) continue;
    kept.filled[block] = 1;
    for (std::uint32_t node = block_begin_[block]; node < block_begin_[block + 1]; ++node)
      unpack(values(node), &kept.values[node * materials_]);
  }
  return kept;
}

void ExitanceField::restore(const KeptExitance& kept) const {
  for (std::size_t block = 0; block < kept.filled.size(); ++block) {
    if (!kept.filled[block]) continue;
    for (std::uint32_t node = block_begin_[block]; node < block_begin_[block + 1]; ++node)
      store(node, &kept.values[node * materials_]);
    block_state_[block].store(kFull, std::memory_order_release);
  }
}

std::size_t ExitanceField::filled_node_count() const {
  std::size_t count = 0;
  for (std::size_t block = 0; block + 1 < block_begin_.size(); ++block)
    if (block_state_[block].load(std::memory_order_acquire) == kFull)
      count += block_begin_[block + 1] - block_begin_[block];
  return count;
}

// Once its nodes are known, whether a patch may be interpolated.
void ExitanceField::judge(Part& part) const noexcept {
  const std::uint32_t kind = load_mark(part, std::memory_order_relaxed) & ~kKnown;
  std::atomic_ref(part.mark).store(kind | (is_steep(patch(part)) ? kSteep : kSmooth),
                                   std::memory_order_release);
}

ExitanceField::Lanes ExitanceField::steep_lanes(const Patch& patch, std::size_t quad) const noexcept {
  Lanes steep{};
  for (std::size_t i = 0; i < 3; ++i) {
    const Float4 a = values(patch.nodes[i])[quad], b = values(patch.nodes[(i + 1) % 3])[quad];
    const Float4 mean = (a + b) * broadcast(0.5f);
    steep |= magnitude(a - b) > mean * broadcast(most_change_);
    if (patch.nodes[3 + i] == kNone) continue;
    const Float4 middle = values(patch.nodes[3 + i])[quad];
    steep |= magnitude(middle - mean) > larger(mean, middle) * broadcast(most_bend_);
  }
  return steep;
}

// For any of the materials.
bool ExitanceField::is_steep(const Patch& patch) const noexcept {
  for (std::size_t q = 0; q < quads_; ++q) {
    const Lanes steep = steep_lanes(patch, q);
    if ((steep[0] | steep[1] | steep[2] | steep[3]) != 0) return true;
  }
  return false;
}

Float4 ExitanceField::interpolate(const Patch& patch, float u, float v, std::size_t quad) const noexcept {
  const float w = 1 - u - v;
  const auto at = [&](std::size_t i) { return values(patch.nodes[i])[quad]; };
  const Float4 a = at(0), b = at(1), c = at(2);
  Float4 value = a * broadcast(w) + b * broadcast(u) + c * broadcast(v);
  const auto bend = [&](std::size_t middle, Float4 from, Float4 to, float bump) {
    if (patch.nodes[middle] != kNone) value += (at(middle) - (from + to) * broadcast(0.5f)) * broadcast(bump);
  };
  bend(3, a, b, 4 * w * u);
  bend(4, b, c, 4 * u * v);
  bend(5, c, a, 4 * v * w);
  return larger(value, broadcast(0));  // a parabola may undershoot where light ends
}

Float4 ExitanceField::interpolate(const Place& place, std::size_t quad) const noexcept {
  const Part& part = parts_[place.part];
  const auto& [a, b, c] = part.data;
  const float u = place.u, v = place.v;
  if (is_kind(part, kCurved)) return interpolate(patches_[a], u, v, quad);
  return values(a)[quad] * broadcast(1 - u - v) + values(b)[quad] * broadcast(u) +
         values(c)[quad] * broadcast(v);
}

// The values at a place whose nodes are known; false if any has to be evaluated itself.
bool ExitanceField::look_up(const Place& place, Rgb* to) const noexcept {
  if (mark_of(parts_[place.part]) & kSteep) return false;
  float* out = &to->x;
  const std::size_t last = quads_ - 1;
  for (std::size_t q = 0; q < last; ++q, out += 4) {
    const Float4 value = interpolate(place, q);
    std::memcpy(out, &value, sizeof(value));
  }
  const Float4 value = interpolate(place, last);
  for (std::size_t lane = 0; lane < 3 * materials_ - 4 * last; ++lane) out[lane] = value[lane];
  return true;
}

// Where some materials have to be evaluated themselves, the values of the others: each is what it would be
// without them.
void ExitanceField::look_up_smooth(const Place& place, Rgb* to) const noexcept {
  const Patch nodes = patch(parts_[place.part]);
  std::size_t first = 0;  // lane of a material
  Lanes steep = steep_lanes(nodes, 0);
  for (std::size_t m = 0; m < materials_; ++m, first += 3) {
    int any = 0;
    for (std::size_t lane = first; lane < first + 3; ++lane) {
      if (lane % 4 == 0) steep = steep_lanes(nodes, lane / 4);
      any |= steep[lane % 4];
    }
    if (any) continue;
    for (std::size_t k = 0; k < 3; ++k)
      to[m][static_cast<int>(k)] = interpolate(place, (first + k) / 4)[(first + k) % 4];
  }
}

// Fills the blocks of parts that are looked at for the first time.
void ExitanceField::make_known(std::span<const std::uint32_t> parts, std::uint64_t& evaluations) const {
  std::vector<std::uint32_t> blocks;
  Recent recent;
  for (const std::uint32_t index : parts)
    for (const std::uint32_t node : patch(parts_[index]).nodes)
      if (node != kNone && recent.is_new(block_of_[node]) &&
          block_state_[block_of_[node]].load(std::memory_order_acquire) != kFull)
        blocks.push_back(block_of_[node]);
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  await_blocks(blocks, evaluations);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    fetch_nodes(parts_[parts[std::min(i + kAhead, parts.size() - 1)]]);
    judge(parts_[parts[i]]);
  }
}

void ExitanceField::eval(std::span<const Hit> hits, std::span<Rgb> exitance,
                         std::uint64_t& evaluations) const {
  struct Missing {
    std::uint32_t hit;
    Place place;
  };
  std::vector<Missing> missing, steep;
  std::vector<std::uint32_t> parts;
  Recent recent;
  // What a value is made of lies all over the memory: it is fetched while hits before are at work.
  std::array<Place, kAhead> ahead;
  for (std::size_t next = 0; next < hits.size() + kAhead; ++next) {
    Place& place = ahead[next % kAhead];
    if (next >= kAhead) {
      const auto i = static_cast<std::uint32_t>(next - kAhead);
      if (!(mark_of(parts_[place.part]) & kKnown)) {
        missing.push_back({i, place});
        if (recent.is_new(place.part)) parts.push_back(place.part);
      } else if (!look_up(place, &exitance[i * materials_])) {
        steep.push_back({i, place});
      }
    }
    if (next >= hits.size()) continue;
    const Hit& further = hits[std::min(next + kAhead, hits.size() - 1)];
    __builtin_prefetch(&parts_[first_triangle_[further.mesh] + further.triangle]);
    place.part = find_patch(hits[next], place.u, place.v);
    fetch_nodes(parts_[place.part]);
  }
  if (!missing.empty()) make_known(parts, evaluations);
  for (std::size_t i = 0; i < missing.size(); ++i) {
    fetch_nodes(parts_[missing[std::min(i + kAhead, missing.size() - 1)].place.part]);
    if (!look_up(missing[i].place, &exitance[missing[i].hit * materials_])) steep.push_back(missing[i]);
  }
  if (steep.empty()) return;
  std::vector<Vec3> positions;
  positions.reserve(steep.size());
  for (const Missing& one : steep)
    positions.push_back(hit_position(*meshes_[hits[one.hit].mesh], hits[one.hit]));
  std::vector<Rgb> results(steep.size() * materials_);
  exitance_.eval(positions, results, evaluations);
  for (std::size_t i = 0; i < steep.size(); ++i) {
    Rgb* const to = &exitance[steep[i].hit * materials_];
    std::copy_n(&results[i * materials_], materials_, to);
    if (materials_ > 1) look_up_smooth(steep[i].place, to);
  }
}

}  // namespace nacre
