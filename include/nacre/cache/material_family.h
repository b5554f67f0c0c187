// Materials whose diffusion is summed up together.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "nacre/optics/medium.h"

namespace nacre {

/// Materials whose sums are made of the same nodes, refined for the strictest of them; and which of them are
/// wanted, by index. A sum depends on the family's extremes, and on all of more than kFewMaterials, so that
/// runs that share it agree, whichever they want.
struct MaterialFamily {
  std::vector<Medium> media;
  std::vector<std::uint32_t> wanted{0};
};

/// As many are summed up one by one, side by side; more, as combinations of fewer (KernelSpan).
inline constexpr std::size_t kFewMaterials = 8;

/// The families that `media` fall into, each with all its members and none wanted. Alike are a profile, an
/// eta unless they may be mixed, whether it is an opaque surface, whether the body's samples are sparse for
/// them, and a mean free path to two octaves: up to there it costs less to refine once, for the strictest,
/// than to do so for several families. Of those that are interpolated, what absorbs three times as fast is
/// apart where that makes a part of the body dark: there nodes are by far the smallest.
struct MaterialFamilies {
  std::vector<MaterialFamily> families;
  std::vector<std::string> digests;  // of each, see family_digest
  struct Place {
    std::uint32_t family, index;  // of a medium in MaterialFamily::media
  };
  std::vector<Place> places;  // parallel to `media`
};
/// The distance of a body's samples and the radius of a ball around it, in scene units.
struct Body {
  double spacing = 0, radius = 0;
};
MaterialFamilies sort_materials(std::span<const Medium> media, const Body& body, bool mixes_eta = false);

/// The smallest mean free path of any channel of the media, in scene units.
double shortest_length(std::span<const Medium> media);

/// True if samples `spacing` apart are further apart than a mean free path: then M_o has detail at each of
/// them, and is not interpolated.
bool is_sparse(const Medium& medium, double spacing);

/// In each channel, the members that are the narrowest, the widest, and that fall fastest and slowest far
/// away: a choice for each channel, none twice. What lies between them is no stricter. All members, where
/// they are fewer.
using ChannelChoice = std::array<std::size_t, 3>;
std::vector<ChannelChoice> find_extremes(std::span<const Medium> media);

/// The least and the largest relative index of refraction of the members.
struct EtaRange {
  float least, most;
  bool is_mixed() const { return least < most; }
};
EtaRange eta_range(const MaterialFamily& family);

/// By channel, the least and the largest extinction coefficient sigma_t of the members, per scene unit.
std::array<Rgb, 2> find_extinctions(std::span<const Medium> media);

/// The members, by index, in groups of one eta in which no channel's extinction coefficient differs by more
/// than half an octave from that of the group's first: distances that light goes before it scatters serve all
/// of them.
std::vector<std::vector<std::uint32_t>> group_by_extinction(std::span<const Medium> media);

/// True if a fifth of the light or more is absorbed at a scattering, in some channel: M_o falls faster then.
bool absorbs_much(const Medium& medium);

/// A 32-digit hash of what sums depend on.
std::string family_digest(const MaterialFamily& family);

}  // namespace nacre
