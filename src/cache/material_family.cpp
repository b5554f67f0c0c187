// Which materials have lists in common, and which of them the lists are made for.
#include "nacre/cache/material_family.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "nacre/cache/fingerprint.h"
#include "nacre/optics/profile.h"

namespace nacre {
namespace {

constexpr float kAbsorbing = 0.8f;  // albedo below which much is absorbed

auto family_key(const Medium& medium) {
  const double octaves = std::log2(shortest_length(std::span(&medium, 1)));
  const auto half_octaves = static_cast<int>(std::floor(std::clamp(2 * octaves, -4000.0, 4000.0)));
  return std::tuple(half_octaves, absorbs_much(medium), medium.profile, medium.eta(), medium.lambert,
                    medium.convention);
}

}  // namespace

double shortest_length(std::span<const Medium> media) {
  double length = std::numeric_limits<double>::infinity();
  for (const Medium& medium : media)
    length = std::min(length, double{smallest_mean_free_path(medium)} / double{medium.scale});
  return length;
}

bool absorbs_much(const Medium& medium) { return min_channel(reduce(medium).alpha_prime) < kAbsorbing; }

MaterialFamilies sort_materials(std::span<const Medium> media) {
  MaterialFamilies result;
  std::map<decltype(family_key(media[0])), std::uint32_t> families;
  for (const Medium& medium : media) {
    const auto next = static_cast<std::uint32_t>(result.families.size());
    const std::uint32_t family = families.try_emplace(family_key(medium), next).first->second;
    if (family == next) result.families.push_back({{}, {}});
    std::vector<Medium>& members = result.families[family].media;
    result.places.push_back({family, static_cast<std::uint32_t>(members.size())});
    members.push_back(medium);
  }
  for (const MaterialFamily& family : result.families) result.digests.push_back(family_digest(family));
  return result;
}

std::vector<ChannelChoice> find_extremes(std::span<const Medium> media) {
  std::vector<std::array<Profile, 3>> profiles;
  profiles.reserve(media.size());
  for (const Medium& medium : media) profiles.push_back(make_profiles(medium));
  std::vector<ChannelChoice> choices;
  const auto choose = [&](const auto& measure) {
    ChannelChoice choice{};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t i = 1; i < profiles.size(); ++i) {
        const Profile &best = profiles[choice[k]][k], &other = profiles[i][k];
        if (other.total > 0 && (!(best.total > 0) || measure(other) > measure(best))) choice[k] = i;
      }
    if (std::ranges::find(choices, choice) == choices.end()) choices.push_back(choice);
  };
  choose([](const Profile& profile) { return -profile.width; });
  choose([](const Profile& profile) { return profile.width; });
  choose([](const Profile& profile) { return profile.decay(); });
  choose([](const Profile& profile) { return -profile.decay(); });
  return choices;
}

std::array<Rgb, 2> find_extinctions(std::span<const Medium> media) {
  constexpr float kInfinite = std::numeric_limits<float>::infinity();
  std::array<Rgb, 2> range{Rgb(kInfinite), Rgb(0.0f)};
  for (const Medium& medium : media) {
    const Rgb sigma_t = (medium.sigma_s + medium.sigma_a) * medium.scale;
    for (int k = 0; k < 3; ++k) {
      range[0][k] = std::min(range[0][k], sigma_t[k]);
      range[1][k] = std::max(range[1][k], sigma_t[k]);
    }
  }
  return range;
}

std::string family_digest(const MaterialFamily& family) {
  KeyValues values;
  for (const ChannelChoice& choice : find_extremes(family.media))
    for (int k = 0; k < 3; ++k) {
      const Medium& medium = family.media[choice[static_cast<std::size_t>(k)]];
      const Reduced reduced = reduce(medium);
      values.emplace_back(fmt::format("channel {}", k),
                          fmt::format("{} {} {} {} {}", reduced.sigma_s_prime[k], reduced.sigma_t_prime[k],
                                      medium.scale, medium.eta(), static_cast<int>(medium.profile)));
    }
  for (const Rgb& sigma_t : find_extinctions(family.media))
    values.emplace_back("sigma_t", fmt::format("{} {} {}", sigma_t.x, sigma_t.y, sigma_t.z));
  return fingerprint_digest(values);
}

}  // namespace nacre
