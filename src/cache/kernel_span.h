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

/// R_d of a material is the sum over `basis` of its weight times R_d of that one. As sums over samples are
/// linear in R_d, so are they, and what tables and series make of them.
struct KernelSpan {
  std::vector<ChannelChoice> basis;  // whose profiles these are, by channel
  /// `weights[m][j]` is what the j-th of them counts for material m, by channel.
  std::vector<std::vector<std::array<float, 3>>> weights;
};

/// The fewest materials, rounded up to a multiple of `step`, that span the profiles of all to a relative
/// error of at most `error` at every distance up to `farthest`; beyond where R_d is a ten-millionth of its
/// mean over the disc that reaches there, relative to that. Nothing if they would be no fewer than all.
std::optional<KernelSpan> find_span(std::span<const std::array<Profile, 3>> profiles, double farthest,
                                    double error, std::size_t step);

}  // namespace nacre
