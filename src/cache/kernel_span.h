// A few kernels whose combinations are those of many materials.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "nacre/cache/material_family.h"
#include "nacre/optics/profile.h"

namespace nacre {

/// What a material makes of light: R_d by channel, and the share of light from each of some angles that
/// enters it. Those without angles let in all alike.
struct Response {
  std::array<Profile, 3> profiles;
  std::vector<double> entering;
};

/// R_d of a material times what enters is the sum over `basis` of its weight times that of those. As sums
/// over samples are linear in both, so are they, and what tables and series make of them.
struct KernelSpan {
  std::vector<ChannelChoice> basis;     // whose profiles these are, by channel,
  std::array<std::size_t, 3> counts{};  // and how many of them each channel has
  /// `weights[m][j]` is what the j-th of them counts for material m, by channel.
  std::vector<std::vector<std::array<float, 3>>> weights;
};

/// The fewest materials of each channel that span the responses of all to a relative error of at most `error`
/// at every angle (all have the same number) and every distance up to `farthest`; beyond where R_d is a
/// ten-millionth of its mean over the disc that reaches there, relative to that. A channel takes all where
/// that would be no fewer, or more than kMostInSpan; nothing if all channels do.
inline constexpr std::size_t kMostInSpan = 32;
std::optional<KernelSpan> find_span(std::span<const Response> responses, double farthest, double error);

}  // namespace nacre
