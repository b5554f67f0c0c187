// Interpolation within patches, and filling of their nodes.
#include "nacre/cache/exitance_field.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <numeric>

#include "cache/patch_split.h"
#include "nacre/base/parallel.h"

namespace nacre {
namespace {

enum BlockState : std::uint8_t { kEmpty, kBusy, kFull };
enum PatchState : std::uint8_t { kUnknown, kSmooth, kSteep };

// A patch over which M_o bends by more than this share of itself, or changes so much along an edge, may err
// by more than the tolerance: light there is as narrow as a mean free path.
constexpr float kMostBend = 0.08f, kMostChange = 0.4f;

}  // namespace

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

ExitanceField::Patch ExitanceField::patch(std::uint32_t index) const noexcept {
  if (index >= corners_.size()) return patches_[index - corners_.size()];
  const auto& t = corners_[index];
  return {{t[0], t[1], t[2], kNone, kNone, kNone}};
}

void ExitanceField::fetch_nodes(std::uint32_t index) const noexcept {
  if (index < corners_.size()) {
    for (const std::uint32_t node : corners_[index]) __builtin_prefetch(&values_[node]);
  } else {
    for (const std::uint32_t node : patches_[index - corners_.size()].nodes)
      __builtin_prefetch(&values_[node != kNone ? node : 0]);
  }
}

// Evaluates the nodes of blocks that this thread has claimed, all at once, so that they share what is far.
void ExitanceField::fill_blocks(std::span<const std::uint32_t> blocks, std::uint64_t& evaluations) const {
  std::vector<Vec3> positions;
  for (const std::uint32_t block : blocks)
    for (std::uint32_t i = block_begin_[block]; i < block_begin_[block + 1]; ++i)
      positions.push_back(positions_[block_nodes_[i]]);
  std::vector<Rgb> values(positions.size());
  exitance_.eval_whole(positions, values, evaluations);
  auto value = values.begin();
  for (const std::uint32_t block : blocks) {
    for (std::uint32_t i = block_begin_[block]; i < block_begin_[block + 1]; ++i)
      values_[block_nodes_[i]] = *value++;
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
  parallel_for(corners_.size() + patches_.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) judge(static_cast<std::uint32_t>(i));
  });
}

KeptExitance ExitanceField::keep() const {
  const XXH128_hash_t hash = XXH3_128bits(positions_.data(), positions_.size() * sizeof(Vec3));
  KeptExitance kept;
  kept.key = {{"nodes", fmt::format("{:016x}{:016x}", hash.high64, hash.low64)}};
  kept.filled.resize(block_begin_.size() - 1);
  kept.values.resize(values_.size(), Rgb(0, 0, 0));
  for (std::size_t block = 0; block < kept.filled.size(); ++block) {
    if (block_state_[block].load(std::memory_order_acquire) != kFull) continue;
    kept.filled[block] = 1;
    for (std::uint32_t i = block_begin_[block]; i < block_begin_[block + 1]; ++i)
      kept.values[block_nodes_[i]] = values_[block_nodes_[i]];
  }
  return kept;
}

void ExitanceField::restore(const KeptExitance& kept) const {
  for (std::size_t block = 0; block < kept.filled.size(); ++block) {
    if (!kept.filled[block]) continue;
    for (std::uint32_t i = block_begin_[block]; i < block_begin_[block + 1]; ++i)
      values_[block_nodes_[i]] = kept.values[block_nodes_[i]];
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
void ExitanceField::judge(std::uint32_t index) const noexcept {
  patch_state_[index].store(is_steep(patch(index)) ? kSteep : kSmooth, std::memory_order_release);
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
  // What a value is made of lies all over the memory: a few hits together fetch it while others are at work.
  constexpr std::size_t kTogether = 32;
  std::vector<Place> places(hits.size());
  std::vector<std::uint32_t> missing, blocks;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const Hit& ahead = hits[std::min(i + kTogether, hits.size() - 1)];
    __builtin_prefetch(&parts_[first_triangle_[ahead.mesh] + ahead.triangle]);
    places[i].patch = find_patch(hits[i], places[i].u, places[i].v);
    const std::uint32_t patch = places[i].patch;
    __builtin_prefetch(&patch_state_[patch]);
    if (patch < corners_.size())
      __builtin_prefetch(&corners_[patch]);
    else
      __builtin_prefetch(&patches_[patch - corners_.size()]);
  }
  for (const Place& place : places)
    if (!patch_state_[place.patch].load(std::memory_order_acquire)) missing.push_back(place.patch);
  if (!missing.empty()) {
    std::sort(missing.begin(), missing.end());
    missing.erase(std::unique(missing.begin(), missing.end()), missing.end());
    for (const std::uint32_t index : missing)
      for (const std::uint32_t node : patch(index).nodes)
        if (node != kNone && block_state_[block_of_[node]].load(std::memory_order_acquire) != kFull)
          blocks.push_back(block_of_[node]);
    std::sort(blocks.begin(), blocks.end());
    blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
    await_blocks(blocks, evaluations);
    for (std::size_t i = 0; i < missing.size(); ++i) {
      fetch_nodes(missing[std::min(i + kTogether, missing.size() - 1)]);
      judge(missing[i]);
    }
  }
  std::vector<std::uint32_t> steep;
  for (std::size_t begin = 0; begin < hits.size(); begin += kTogether) {
    const std::size_t end = std::min(begin + kTogether, hits.size());
    for (std::size_t i = begin; i < end; ++i) fetch_nodes(places[i].patch);
    for (std::size_t i = begin; i < end; ++i) {
      const Place& place = places[i];
      if (patch_state_[place.patch].load(std::memory_order_acquire) == kSteep) {
        steep.push_back(static_cast<std::uint32_t>(i));
      } else if (place.patch < corners_.size()) {
        const auto& [a, b, c] = corners_[place.patch];
        exitance[i] = values_[a] * (1 - place.u - place.v) + values_[b] * place.u + values_[c] * place.v;
      } else {
        exitance[i] = interpolate(patches_[place.patch - corners_.size()], place.u, place.v);
      }
    }
  }
  if (steep.empty()) return;
  std::vector<Vec3> positions;
  for (const std::uint32_t i : steep) positions.push_back(hit_position(*meshes_[hits[i].mesh], hits[i]));
  std::vector<Rgb> values(steep.size());
  exitance_.eval(positions, values, evaluations);
  for (std::size_t i = 0; i < steep.size(); ++i) exitance[steep[i]] = values[i];
}

}  // namespace nacre
