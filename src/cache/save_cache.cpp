// Writing cache files.
#include "cache/cache_layout.h"
#include "nacre/cache/cache_file.h"

namespace nacre {

void save_cache(const Cache& cache, const std::string& path) {
  const std::string fingerprint = layout::encode_texts(cache.fingerprint),
                    info = layout::encode_texts(cache.info);
  std::vector<std::string> group_texts;
  for (const CacheGroup& group : cache.groups)
    group_texts.push_back(
        layout::encode_texts({{"name", group.name}, {"area", fmt::format("{:.17g}", group.surface_area)}}));

  std::vector<layout::Section> sections{{layout::kFingerprint, 0, fingerprint.data(), fingerprint.size()},
                                        {layout::kInfo, 0, info.data(), info.size()}};
  for (std::size_t g = 0; g < cache.groups.size(); ++g) {
    const CacheGroup& group = cache.groups[g];
    const auto index = static_cast<std::uint32_t>(g);
    sections.push_back({layout::kGroup, index, group_texts[g].data(), group_texts[g].size()});
    for (std::size_t k = 0; k < kPlaneCount; ++k)
      sections.push_back({layout::kPlanes[k], index, group.planes[k].data(), group.planes[k].size_bytes()});
    sections.push_back({layout::kNodes, index, group.nodes.data(), group.nodes.size_bytes()});
  }
  layout::write_sections(path, layout::kCacheFile, sections, static_cast<std::uint32_t>(cache.groups.size()));
}

}  // namespace nacre
