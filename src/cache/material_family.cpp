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
// By what factors mean free paths differ within a family, how fast R_d falls, and extinction coefficients
// within a group.
constexpr double kLengths = 4.001, kDecays = 3, kExtinctions = 1.4143;
// How much of a body light goes through without anywhere being dark, in lengths over which R_d falls by e.
constexpr double kClear = 8;

auto family_key(const Medium& medium, bool mixes_eta) {
  const float eta = mixes_eta && !medium.lambert ? 0 : medium.eta();
  return std::tuple(medium.profile, eta, medium.lambert, medium.convention);
}

double length_of(const Medium& medium) { return shortest_length(std::span(&medium, 1)); }

using Indices = std::vector<std::size_t>;

// Parts within each of which a measure differs by at most `factor`, from the least on.
template <class Measure>
std::vector<Indices> split(const std::vector<Indices>& groups, double factor, const Measure& measure) {
  std::vector<Indices> parts;
  for (Indices group : groups) {
    std::ranges::stable_sort(group, {}, measure);
    double least = 0;
    for (const std::size_t i : group) {
      if (i == group[0] || !(measure(i) <= factor * least)) {
        parts.emplace_back();
        least = measure(i);
      }
      parts.back().push_back(i);
    }
  }
  return parts;
}

}  // namespace

double shortest_length(std::span<const Medium> media) {
  double length = std::numeric_limits<double>::infinity();
  for (const Medium& medium : media)
    length = std::min(length, double{smallest_mean_free_path(medium)} / double{medium.scale});
  return length;
}

bool is_sparse(const Medium& medium, double spacing) { return spacing > length_of(medium); }

bool absorbs_much(const Medium& medium) { return min_channel(reduce(medium).alpha_prime) < kAbsorbing; }

MaterialFamilies sort_materials(std::span<const Medium> media, const Body& body, bool mixes_eta) {
  const auto key_of = [&](const Medium& medium) {
    return std::pair(family_key(medium, mixes_eta), is_sparse(medium, body.spacing));
  };
  const auto decays = [&](std::size_t i) {
    double most = kClear;
    if (is_sparse(media[i], body.spacing)) return most;
    for (const Profile& profile : make_profiles(media[i]))
      if (profile.total > 0) most = std::max(most, profile.decay() * body.radius);
    return most;
  };
  std::map<decltype(key_of(media[0])), std::size_t> keys;
  std::vector<Indices> groups;
  for (std::size_t i = 0; i < media.size(); ++i) {
    const std::size_t at = keys.try_emplace(key_of(media[i]), groups.size()).first->second;
    if (at == groups.size()) groups.emplace_back();
    groups[at].push_back(i);
  }
  groups = split(groups, kDecays, decays);
  groups = split(groups, kLengths, [&](std::size_t i) { return length_of(media[i]); });
  MaterialFamilies result;
  result.places.resize(media.size());
  for (const Indices& group : groups) {
    std::vector<Medium>& members = result.families.emplace_back().media;
    result.families.back().wanted.clear();
    for (const std::size_t i : group) {
      result.places[i] = {static_cast<std::uint32_t>(result.families.size() - 1),
                          static_cast<std::uint32_t>(members.size())};
      members.push_back(media[i]);
    }
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
  if (media.size() < choices.size()) {
    choices.clear();
    for (std::size_t i = 0; i < media.size(); ++i) choices.push_back({i, i, i});
  }
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

EtaRange eta_range(const MaterialFamily& family) {
  EtaRange range{family.media[0].eta(), family.media[0].eta()};
  for (const Medium& medium : family.media) {
    range.least = std::min(range.least, medium.eta());
    range.most = std::max(range.most, medium.eta());
  }
  return range;
}

std::vector<std::vector<std::uint32_t>> group_by_extinction(std::span<const Medium> media) {
  const auto sigma_t = [&](std::size_t i) { return (media[i].sigma_s + media[i].sigma_a) * media[i].scale; };
  const auto is_near = [](const Rgb& a, const Rgb& b) {
    for (int k = 0; k < 3; ++k)
      if (!(std::max(a[k], b[k]) <= static_cast<float>(kExtinctions) * std::min(a[k], b[k]))) return false;
    return true;
  };
  std::vector<std::vector<std::uint32_t>> groups;
  for (std::uint32_t i = 0; i < media.size(); ++i) {
    const auto group = std::ranges::find_if(groups, [&](const auto& g) {
      return media[g[0]].eta() == media[i].eta() && is_near(sigma_t(g[0]), sigma_t(i));
    });
    if (group == groups.end())
      groups.push_back({i});
    else
      group->push_back(i);
  }
  return groups;
}

std::string family_digest(const MaterialFamily& family) {
  KeyValues values;
  const auto add = [&](const Medium& medium, int k) {
    const Reduced reduced = reduce(medium);
    values.emplace_back(fmt::format("channel {}", k),
                        fmt::format("{} {} {} {} {}", reduced.sigma_s_prime[k], reduced.sigma_t_prime[k],
                                    medium.scale, medium.eta(), static_cast<int>(medium.profile)));
  };
  for (const ChannelChoice& choice : find_extremes(family.media))
    for (int k = 0; k < 3; ++k) add(family.media[choice[static_cast<std::size_t>(k)]], k);
  const EtaRange etas = eta_range(family);
  values.emplace_back("eta", fmt::format("{} {}", etas.least, etas.most));
  if (family.media.size() > kFewMaterials)
    for (const Medium& medium : family.media)
      for (int k = 0; k < 3; ++k) add(medium, k);
  for (const std::vector<std::uint32_t>& group : group_by_extinction(family.media)) {
    std::vector<Medium> members(group.size());
    std::ranges::transform(group, members.begin(), [&](std::uint32_t i) { return family.media[i]; });
    for (const Rgb& sigma_t : find_extinctions(members))
      values.emplace_back("sigma_t", fmt::format("{} {} {}", sigma_t.x, sigma_t.y, sigma_t.z));
  }
  return fingerprint_digest(values);
}

}  // namespace nacre
