// Writing cache files.
#include <algorithm>

#include "cache/cache_layout.h"
#include "nacre/cache/cache_file.h"

namespace nacre {
namespace {

bool knows_lights(const CacheGroup& group) { return !group.lights.empty() || group.eta > 0; }

std::string group_texts(const CacheGroup& group, std::uint32_t version) {
  KeyValues entries{{"name", group.name}, {"area", fmt::format("{:.17g}", group.surface_area)}};
  if (version > 1) {
    entries.emplace_back("eta", fmt::format("{:.9g}", group.eta));
    for (const LightPlane& light : group.lights) entries.emplace_back("light", light.name);
  }
  return layout::encode_texts(entries);
}

// Planes of all lights lie one after the other in memory, as in the file.
template <class T>
layout::Section section_of_lights(layout::Kind kind, std::uint32_t index, std::span<const T> first,
                                  std::size_t planes) {
  return {kind, index, first.data(), first.size_bytes() * planes};
}

}  // namespace

void save_cache(const Cache& cache, const std::string& path) {
  const std::uint32_t version = std::ranges::any_of(cache.groups, knows_lights) ? 2 : 1;
  const std::string fingerprint = layout::encode_texts(cache.fingerprint),
                    info = layout::encode_texts(cache.info);
  std::vector<std::string> texts;
  for (const CacheGroup& group : cache.groups) texts.push_back(group_texts(group, version));

  std::vector<layout::Section> sections{{layout::kFingerprint, 0, fingerprint.data(), fingerprint.size()},
                                        {layout::kInfo, 0, info.data(), info.size()}};
  for (std::size_t g = 0; g < cache.groups.size(); ++g) {
    const CacheGroup& group = cache.groups[g];
    const auto index = static_cast<std::uint32_t>(g);
    sections.push_back({layout::kGroup, index, texts[g].data(), texts[g].size()});
    for (std::size_t k = 0; k < kPlaneCount; ++k)
      sections.push_back({layout::kPlanes[k], index, group.planes[k].data(), group.planes[k].size_bytes()});
    sections.push_back({layout::kNodes, index, group.nodes.data(), group.nodes.size_bytes()});
    if (version == 1) continue;
    const std::size_t count = group.lights.size();
    const LightPlane first = count > 0 ? group.lights[0] : LightPlane{};
    sections.push_back(
        section_of_lights(layout::kLights, index, first.irradiance[0], count > 1 ? 3 * count : 0));
    sections.push_back(section_of_lights(layout::kErrors, index, first.errors, count));
    sections.push_back(section_of_lights(layout::kRatios, index, first.ratios, count));
  }
  layout::write_sections(path, layout::kCacheFiles[version - 1], sections,
                         static_cast<std::uint32_t>(cache.groups.size()));
}

}  // namespace nacre
