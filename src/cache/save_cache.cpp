// Writing cache files.
#include <xxhash.h>

#include <bit>
#include <cstring>

#include "cache/cache_layout.h"
#include "nacre/base/file.h"
#include "nacre/cache/cache_file.h"

namespace nacre {
namespace {

static_assert(std::endian::native == std::endian::little, "cache files are little-endian and used in place");

struct Section {
  std::array<char, 4> kind;
  std::uint32_t group;
  const void* data;
  std::uint64_t size;
};

void append_u32(std::string& out, std::size_t value) {
  const auto v = static_cast<std::uint32_t>(value);
  char bytes[4];
  std::memcpy(bytes, &v, 4);
  out.append(bytes, 4);
}

std::string encode(const KeyValues& entries) {
  std::string out;
  append_u32(out, entries.size());
  for (const auto& [key, value] : entries) {
    append_u32(out, key.size());
    out += key;
    append_u32(out, value.size());
    out += value;
  }
  return out;
}

}  // namespace

void save_cache(const Cache& cache, const std::string& path) {
  const std::string fingerprint = encode(cache.fingerprint), info = encode(cache.info);
  std::vector<std::string> group_texts;
  for (const CacheGroup& group : cache.groups)
    group_texts.push_back(
        encode({{"name", group.name}, {"area", fmt::format("{:.17g}", group.surface_area)}}));

  std::vector<Section> sections{{layout::kFingerprint, 0, fingerprint.data(), fingerprint.size()},
                                {layout::kInfo, 0, info.data(), info.size()}};
  for (std::size_t g = 0; g < cache.groups.size(); ++g) {
    const CacheGroup& group = cache.groups[g];
    const auto index = static_cast<std::uint32_t>(g);
    sections.push_back({layout::kGroup, index, group_texts[g].data(), group_texts[g].size()});
    for (std::size_t k = 0; k < kPlaneCount; ++k)
      sections.push_back({layout::kPlanes[k], index, group.planes[k].data(), group.planes[k].size_bytes()});
    sections.push_back({layout::kNodes, index, group.nodes.data(), group.nodes.size_bytes()});
  }

  std::vector<layout::SectionEntry> table;
  std::uint64_t offset =
      layout::align(sizeof(layout::Header) + sections.size() * sizeof(layout::SectionEntry));
  for (const Section& section : sections) {
    table.push_back(
        {section.kind, section.group, offset, section.size, XXH3_64bits(section.data, section.size)});
    offset = layout::align(offset + section.size);
  }
  layout::Header header{};
  header.magic = layout::kMagic;
  header.version = kCacheVersion;
  header.endian_mark = layout::kEndianMark;
  header.file_size = offset;
  header.section_count = static_cast<std::uint32_t>(sections.size());
  header.group_count = static_cast<std::uint32_t>(cache.groups.size());
  header.table_checksum = XXH3_64bits(table.data(), table.size() * sizeof(layout::SectionEntry));
  header.header_checksum = XXH3_64bits(&header, offsetof(layout::Header, header_checksum));

  AtomicFile file(path);
  std::uint64_t at = 0;
  const std::array<char, layout::kAlignment> zeros{};
  const auto write = [&](const void* data, std::uint64_t size) {
    if (size) file.write(data, size);
    at += size;
    if (at % layout::kAlignment) {
      const std::uint64_t padding = layout::kAlignment - at % layout::kAlignment;
      file.write(zeros.data(), padding);
      at += padding;
    }
  };
  write(&header, sizeof header);
  write(table.data(), table.size() * sizeof(layout::SectionEntry));
  for (const Section& section : sections) write(section.data, section.size);
  file.commit();
}

}  // namespace nacre
