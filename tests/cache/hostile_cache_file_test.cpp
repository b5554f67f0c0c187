// label: golden
// Cache files whose checksums are right and whose content is hostile: every count, offset, link and number is
// refused.
#include "cache/cache_file_fixture.h"

namespace nacre {
namespace {

using namespace testing_support;

TEST_F(CacheFile, HostileHeadersAndTablesAreRefused) {
  const Bytes bytes = good();
  const auto refused = [&](const char* what, const auto& change) {
    Bytes changed = bytes;
    change(changed);
    seal(changed);
    EXPECT_EQ(error_of(changed).code(), ErrorCode::kDamaged) << what;
  };
  const auto header = [&](const char* what, std::size_t at, auto value) {
    refused(what, [&](Bytes& b) { put(b, at, value); });
  };
  header("endian", offsetof(layout::Header, endian_mark), std::uint32_t{0x0d0c0b0a});
  for (const std::uint32_t count : {0u, 1u, 37u, 39u, 0xffffffffu})
    header("sections", offsetof(layout::Header, section_count), count);
  for (const std::uint32_t count : {0u, 2u, 4u, 0xffffffffu, 0x15555555u})
    header("groups", offsetof(layout::Header, group_count), count);
  refused("more sections than fit", [](Bytes& b) {
    put(b, offsetof(layout::Header, group_count), std::uint32_t{0x15555555u});
    put(b, offsetof(layout::Header, section_count), static_cast<std::uint32_t>(2 + 12ull * 0x15555555u));
  });
  for (std::size_t i = 0; i < count_sections(bytes); ++i) {
    const std::size_t at = sizeof(layout::Header) + i * sizeof(layout::SectionEntry);
    const auto entry = entry_at(bytes, i);
    for (const std::uint64_t offset : {std::uint64_t{0}, entry.offset + 1, entry.offset + 64,
                                       std::uint64_t{1} << 63, ~std::uint64_t{0}, ~std::uint64_t{63}})
      header("offset", at + offsetof(layout::SectionEntry, offset), offset);
    for (const std::uint64_t size : {entry.size + 1000000, std::uint64_t{1} << 63, ~std::uint64_t{0},
                                     ~std::uint64_t{63}, ~std::uint64_t{0} - entry.offset + 1})
      header("size", at + offsetof(layout::SectionEntry, size), size);
    header("group", at + offsetof(layout::SectionEntry, group), entry.group + 1);
    header("kind", at, std::array<char, 4>{'\n', 'X', '\x7f', '\0'});
    if (i > 0) refused("twice", [&](Bytes& b) { std::memcpy(b.data() + at, b.data() + at - 32, 32); });
  }
}

TEST_F(CacheFile, HostileTextsAreRefused) {
  const Bytes bytes = good();
  for (const auto& [kind, group] :
       std::vector<std::pair<const char*, std::uint32_t>>{{"FING", 0}, {"INFO", 0}, {"GRUP", 1}}) {
    const auto entry = entry_at(bytes, find_section(bytes, kind, group));
    for (const std::uint64_t at : {0u, 4u})  // number of entries, length of the first key
      for (const std::uint32_t value : {0u, 1u, 1000u, 0x7fffffffu, 0xffffffffu}) {
        Bytes changed = bytes;
        put(changed, entry.offset + at, value);
        seal(changed);
        expect_damaged(changed, kind, group, fmt::format("{} at {}", value, at));
      }
  }
  const auto group = entry_at(bytes, find_section(bytes, "GRUP", 1));  // ends with the area, "2"
  for (const char area : {'x', '-', ' ', '\0'}) {
    Bytes changed = bytes;
    put(changed, group.offset + group.size - 1, area);
    seal(changed);
    expect_damaged(changed, "GRUP", 1, "area");
  }
  Bytes renamed = bytes;
  put(renamed, group.offset + 8, 'N');  // "Name"
  seal(renamed);
  expect_damaged(renamed, "GRUP", 1, "key");
}

TEST_F(CacheFile, SurfaceAreasThatAreNoneAreRefused) {
  for (const double area :
       {-1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    Cache cache = make_golden_cache();
    cache.groups[2].surface_area = area;
    save_cache(cache, path_);
    expect_damaged(read_bytes(path_), "GRUP", 2, fmt::format("{}", area));
  }
}

TEST_F(CacheFile, HostileNumbersAreRefused) {
  const Bytes bytes = good();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                  kInf = std::numeric_limits<float>::infinity();
  const auto refused = [&](const char* kind, std::size_t at, float value) {
    Bytes changed = bytes;
    put(changed, entry_at(bytes, find_section(bytes, kind, 0)).offset + at, value);
    seal(changed);
    expect_damaged(changed, kind, 0, fmt::format("{} at {}", value, at));
  };
  for (const char* kind : {"POSX", "POSY", "POSZ", "NRMX", "NRMY", "NRMZ", "AREA", "IRRR", "IRRG", "IRRB"})
    for (const float value : {kNan, kInf, -kInf}) refused(kind, 44, value);
  for (const char* kind : {"AREA", "IRRR", "IRRG", "IRRB"}) refused(kind, 0, -1.0f);
  for (std::size_t at = 0; at < 52; at += 4)  // centre, radius, power, moments of the second node
    for (const float value : {kNan, kInf, -1.0f})
      if (at >= 12 || value != -1.0f) refused("NODE", 64 + at, value);
}

// Sound by themselves, but further away than scenes reach, longer than directions are, not what nodes say.
TEST_F(CacheFile, NumbersThatDisagreeAreRefused) {
  const Bytes bytes = good();
  const auto refused = [&](const char* kind, float value, const char* where) {
    Bytes changed = bytes;
    put(changed, entry_at(bytes, find_section(bytes, kind, 0)).offset + 44, value);
    seal(changed);
    expect_damaged(changed, where, 0, fmt::format("{} {}", kind, value));
  };
  for (const char* kind : {"POSX", "POSY", "POSZ"}) refused(kind, -1e38f, kind);
  for (const char* kind : {"NRMX", "NRMY", "NRMZ"}) refused(kind, 1.5f, kind);
  for (const char* kind : {"POSX", "POSY", "POSZ"}) refused(kind, 1e4f, "NODE");
  for (const char* kind : {"AREA", "IRRR", "IRRG", "IRRB"}) refused(kind, 1e4f, "NODE");
}

TEST_F(CacheFile, HostileLightsAreRefused) {
  save_cache(make_golden_cache_2(), path_);
  const Bytes bytes = read_bytes(path_);
  EXPECT_NO_THROW(load_cache(path_));
  for (const char* kind : {"LITE", "IRRE"})
    for (const float value :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1.0f}) {
      Bytes changed = bytes;
      put(changed, entry_at(bytes, find_section(bytes, kind, 0)).offset + 8, value);
      seal(changed);
      expect_damaged(changed, kind, 0, fmt::format("{}", value));
    }
  // Any ratio is one.
  Bytes ratios = bytes;
  put(ratios, entry_at(bytes, find_section(bytes, "ETAR", 0)).offset, std::uint64_t{0xfffffffffffffffful});
  seal(ratios);
  write_bytes(path_, ratios);
  EXPECT_NO_THROW(load_cache(path_));
  // Lights under another name, an index that is no number.
  const auto texts = entry_at(bytes, find_section(bytes, "GRUP", 0));
  const std::string text(reinterpret_cast<const char*>(bytes.data()) + texts.offset, texts.size);
  for (const std::size_t at : {text.find("light"), text.find("eta"), text.find("1.5", text.find("eta"))}) {
    Bytes changed = bytes;
    put(changed, texts.offset + at, 'x');
    seal(changed);
    expect_damaged(changed, "GRUP", 0, fmt::format("at {}", at));
  }
}

// Sections that do not have a value for each light and sample.
TEST_F(CacheFile, LightsOfTheWrongSizeAreRefused) {
  const Cache good = make_golden_cache_2();
  const auto refused = [&](const Cache& cache, const char* kind) {
    save_cache(cache, path_);
    expect_damaged(read_bytes(path_), kind, 0, kind);
  };
  Cache errors = good;
  errors.groups[0].lights[0].errors = errors.groups[0].lights[0].errors.first(2);
  refused(errors, "IRRE");
  Cache ratios = good;
  ratios.groups[0].lights[0].ratios = ratios.groups[0].lights[0].ratios.first(1);
  refused(ratios, "ETAR");
  Cache irradiance = good;
  irradiance.groups[0].lights[0].irradiance[0] = {};
  refused(irradiance, "LITE");
}

// Each factor is a number; the product, a sample's power, is not, and would give NaN where R is 0.
TEST_F(CacheFile, InfinitePowersAreRefused) {
  Bytes bytes = good();
  put(bytes, entry_at(bytes, find_section(bytes, "AREA", 1)).offset, 3e38f);
  seal(bytes);
  expect_damaged(bytes, "IRRB", 1, "power");
}

TEST_F(CacheFile, HostileTreesAreRefused) {
  const Bytes bytes = good();
  const auto nodes = entry_at(bytes, find_section(bytes, "NODE", 0)).offset;
  const auto refused = [&](const char* what, std::size_t node, std::size_t member, std::uint32_t value) {
    Bytes changed = bytes;
    put(changed, nodes + 64 * node + member, value);
    seal(changed);
    expect_damaged(changed, "NODE", 0, what);
  };
  constexpr std::size_t kChild = offsetof(OctreeNode, first_child),
                        kFirst = offsetof(OctreeNode, first_sample),
                        kCounts = offsetof(OctreeNode, packed_counts);
  for (const std::uint32_t child : {0u, 2u, 3u, 0xffffffffu}) refused("the root's link", 0, kChild, child);
  refused("a leaf's link back", 1, kChild, 1);
  refused("a leaf's link to the root's", 2, kChild, 0xffffffff);
  refused("a leaf that says that it has children", 1, kCounts, 6 | 2u << 28);
  for (const std::uint32_t counts : {12u | 1u << 28, 12u | 3u << 28, 12u | 9u << 28, 12u | 15u << 28, 12u,
                                     11u | 2u << 28, 13u | 2u << 28, 0x0fffffffu | 2u << 28, 2u << 28})
    refused("the root's counts", 0, kCounts, counts);
  for (const std::uint32_t first : {1u, 12u, 0xffffffffu}) refused("the root's range", 0, kFirst, first);
  for (const std::uint32_t first : {0u, 5u, 7u, 0xffffffffu}) refused("a child's range", 2, kFirst, first);
  for (const std::uint32_t counts : {0u, 5u, 7u, 12u, 0x0fffffffu})
    refused("a child's count", 1, kCounts, counts);
}

// A chain of one child each, one node deeper than the format allows, and one that is just within.
TEST_F(CacheFile, DeepTreesAreRefused) {
  for (const std::size_t depth :
       {std::size_t{kMaxOctreeDepth}, std::size_t{kMaxOctreeDepth} + 1, std::size_t{5000}}) {
    Cache cache = make_golden_cache();
    std::vector<OctreeNode> chain(depth + 1, cache.groups[1].nodes[0]);
    for (std::size_t i = 0; i < depth; ++i) {
      chain[i].first_child = static_cast<std::uint32_t>(i + 1);
      chain[i].packed_counts = 1 | 1u << 28;
    }
    cache.groups[1].nodes = chain;
    save_cache(cache, path_);
    if (depth <= kMaxOctreeDepth)
      EXPECT_EQ(load_cache(path_).groups[1].nodes.size(), depth + 1);
    else
      expect_damaged(read_bytes(path_), "NODE", 1, "deep");
  }
}

TEST_F(CacheFile, SectionsThatDoNotMatchAreRefused) {
  const auto refused = [&](const char* kind, const auto& change) {
    Cache cache = make_golden_cache();
    change(cache.groups[0]);
    save_cache(cache, path_);
    expect_damaged(read_bytes(path_), kind, 0, kind);
  };
  for (std::size_t k = 1; k < kPlaneCount; ++k)
    refused(std::string(layout::kPlanes[k].data(), 4).c_str(),
            [&](CacheGroup& g) { g.planes[k] = g.planes[k].subspan(1); });
  refused("POSY", [](CacheGroup& g) { g.planes[0] = {}; });
  refused("NODE", [](CacheGroup& g) { g.nodes = {}; });
  refused("NODE", [](CacheGroup& g) { g.nodes = g.nodes.first(2); });
  refused("NODE", [](CacheGroup& g) {
    for (auto& plane : g.planes) plane = {};
  });
  static const std::vector<OctreeNode> kMore(4);
  refused("NODE", [](CacheGroup& g) { g.nodes = kMore; });
  // Sizes that are no multiples of an element's.
  Bytes bytes = good();
  put(bytes, sizeof(layout::Header) + find_section(bytes, "POSX", 0) * 32 + 16, std::uint64_t{47});
  seal(bytes);
  expect_damaged(bytes, "POSX", 0, "size");
  bytes = good();
  put(bytes, sizeof(layout::Header) + find_section(bytes, "NODE", 0) * 32 + 16, std::uint64_t{191});
  seal(bytes);
  expect_damaged(bytes, "NODE", 0, "size");
}

}  // namespace
}  // namespace nacre
