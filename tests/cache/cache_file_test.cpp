// label: golden
// Cache files: round trips, golden files, and every way in which a file can be broken.
#include "nacre/cache/cache_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cache/cache_bytes.h"
#include "nacre/base/error.h"

namespace nacre {
namespace {

using namespace testing_support;

const std::string kGolden = NACRE_SOURCE_DIR "/tests/golden/cache/";

class CacheFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "nacre-cache-XXXXXX";
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name + "/";
    path_ = folder_ + "a.nacre";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Bytes good() const {
    save_cache(make_golden_cache(), path_);
    return read_bytes(path_);
  }
  // The error of reading these bytes; fails the test if there is none.
  Error error_of(const Bytes& bytes) const {
    write_bytes(path_, bytes);
    return error_of(path_);
  }
  static Error error_of(const std::string& path) {
    try {
      load_cache(path);
    } catch (const Error& error) {
      return error;
    }
    ADD_FAILURE() << path << " was read";
    return {ErrorCode::kMismatch, "", ""};
  }
  // Expects damage that names the section.
  void expect_damaged(const Bytes& bytes, const std::string& kind, std::uint32_t group,
                      const std::string& what) const {
    const Error error = error_of(bytes);
    EXPECT_EQ(error.code(), ErrorCode::kDamaged) << what;
    EXPECT_NE(std::string(error.what()).find(fmt::format("section {} of group {} is damaged", kind, group)),
              std::string::npos)
        << what << ": " << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }

  std::string folder_, path_;
};

void expect_equal(const Cache& a, const Cache& b) {
  EXPECT_EQ(a.fingerprint, b.fingerprint);
  EXPECT_EQ(a.info, b.info);
  ASSERT_EQ(a.groups.size(), b.groups.size());
  for (std::size_t g = 0; g < a.groups.size(); ++g) {
    EXPECT_EQ(a.groups[g].name, b.groups[g].name);
    EXPECT_EQ(a.groups[g].surface_area, b.groups[g].surface_area);
    for (std::size_t k = 0; k < kPlaneCount; ++k) {
      ASSERT_EQ(a.groups[g].planes[k].size(), b.groups[g].planes[k].size());
      if (a.groups[g].size() > 0) {
        EXPECT_EQ(std::memcmp(a.groups[g].planes[k].data(), b.groups[g].planes[k].data(),
                              a.groups[g].planes[k].size_bytes()),
                  0);
      }
    }
    ASSERT_EQ(a.groups[g].nodes.size(), b.groups[g].nodes.size());
    if (!a.groups[g].nodes.empty()) {
      EXPECT_EQ(
          std::memcmp(a.groups[g].nodes.data(), b.groups[g].nodes.data(), a.groups[g].nodes.size_bytes()), 0);
    }
  }
}

TEST_F(CacheFile, RoundTripKeepsEveryBit) {
  Cache cache = make_golden_cache();
  const OwnedGroup large = make_group(make_sphere(64, side_light), "Kerze für \"Ü\"\n");
  cache.groups.push_back(large.group);
  cache.groups.back().surface_area = 0.1;  // needs 17 digits
  cache.fingerprint.push_back({"", std::string("a\0b", 3)});
  save_cache(cache, path_);
  expect_equal(load_cache(path_), cache);
  const Bytes first = read_bytes(path_);
  save_cache(load_cache(path_), folder_ + "b.nacre");
  EXPECT_EQ(read_bytes(folder_ + "b.nacre"), first);
}

TEST_F(CacheFile, WithoutGroupsIsACache) {
  save_cache(Cache{}, path_);
  EXPECT_TRUE(load_cache(path_).groups.empty());
}

TEST_F(CacheFile, OutlivesItsFile) {
  Cache copy;
  {
    good();
    const Cache cache = load_cache(path_);
    copy = cache;
  }
  std::filesystem::remove(path_);
  EXPECT_EQ(copy.groups[1].irradiance(0), Rgb(0.5f, 0.25f, 4));
}

TEST_F(CacheFile, SectionsAreAligned) {
  const Bytes bytes = good();
  EXPECT_EQ(bytes.size() % 64, 0u);
  for (std::size_t i = 0; i < count_sections(bytes); ++i) EXPECT_EQ(entry_at(bytes, i).offset % 64, 0u);
}

// What was written once is read for ever.
TEST_F(CacheFile, GoldenFileHoldsWhatItHeld) {
  const Cache cache = load_cache(kGolden + "good-v1.nacre");
  ASSERT_EQ(cache.groups.size(), 3u);
  const CacheGroup& wax = cache.groups[0];
  EXPECT_EQ(wax.name, "wax");
  EXPECT_EQ(wax.surface_area, 1.5);
  ASSERT_EQ(wax.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i) {  // in Morton order, which is x here
    const auto x = static_cast<float>(i);
    EXPECT_EQ(wax.position(i), Vec3(x, 0.5f, i < 6 ? 0.0f : 0.25f));
    EXPECT_EQ(wax.normal(i), Vec3(0, 0, 1));
    EXPECT_EQ(wax.area(i), 0.125f);
    EXPECT_EQ(wax.irradiance(i), Rgb(1, 0.5f * x, 0));
  }
  ASSERT_EQ(wax.nodes.size(), 3u);
  EXPECT_EQ(wax.nodes[0].power[0], 1.5f);
  EXPECT_EQ(wax.nodes[0].power[1], 4.125f);
  EXPECT_EQ(wax.nodes[0].power[2], 0);
  EXPECT_EQ(wax.nodes[0].child_count(), 2u);
  EXPECT_EQ(wax.nodes[1].sample_count(), 6u);
  EXPECT_EQ(cache.groups[1].name, "milk");
  EXPECT_EQ(cache.groups[1].irradiance(0), Rgb(0.5f, 0.25f, 4));
  EXPECT_EQ(cache.groups[2].name, "medium 3");
  EXPECT_EQ(cache.groups[2].size(), 0u);
  EXPECT_EQ(cache.fingerprint[2].second, "0 1 2.5");
  EXPECT_EQ(cache.info[1], (std::pair<std::string, std::string>{"seed", "7"}));
  expect_equal(cache, make_golden_cache());
  EXPECT_EQ(good(), read_bytes(kGolden + "good-v1.nacre"));
}

struct BadFile {
  const char* name;
  ErrorCode code;
  const char* text;
};

TEST_F(CacheFile, GoldenBadFilesAreRefused) {
  const BadFile files[] = {
      {"bad-text-transfer.nacre", ErrorCode::kNotACache, "is not a nacre cache"},
      {"bad-newer-version.nacre", ErrorCode::kNewerVersion, "format version 2"},
      {"bad-truncated.nacre", ErrorCode::kTruncated, "the cache ends here"},
      {"bad-header.nacre", ErrorCode::kDamaged, "the header is damaged"},
      {"bad-irradiance.nacre", ErrorCode::kDamaged, "section IRRG of group 0 is damaged: its checksum"},
      {"bad-cycle.nacre", ErrorCode::kDamaged, "section NODE of group 0 is damaged: a child link"},
      {"bad-nan.nacre", ErrorCode::kDamaged, "section POSX of group 1 is damaged: a value is not finite"},
  };
  for (const BadFile& file : files) {
    ASSERT_TRUE(std::filesystem::exists(kGolden + file.name)) << file.name;
    const Error error = error_of(kGolden + file.name);
    EXPECT_EQ(error.code(), file.code) << error.what();
    EXPECT_NE(std::string(error.what()).find(file.text), std::string::npos) << error.what();
  }
}

TEST_F(CacheFile, EveryFlippedBitOfHeaderAndTableIsRefused) {
  const Bytes bytes = good();
  const std::size_t end = sizeof(layout::Header) + count_sections(bytes) * sizeof(layout::SectionEntry);
  for (std::size_t i = 0; i < end; ++i) {
    Bytes flipped = bytes;
    flipped[i] ^= static_cast<unsigned char>(1u << (i % 8));
    EXPECT_EQ(error_of(flipped).code(), i < 8 ? ErrorCode::kNotACache : ErrorCode::kDamaged) << i;
  }
}

TEST_F(CacheFile, FlippedBytesAreFoundInTheirSection) {
  const Bytes bytes = good();
  for (std::size_t i = 0; i < count_sections(bytes); ++i) {
    const auto entry = entry_at(bytes, i);
    for (std::uint64_t at = 0; at < entry.size; at += 3) {
      Bytes flipped = bytes;
      flipped[entry.offset + at] ^= 0x10;
      expect_damaged(flipped, std::string(entry.kind.data(), 4), entry.group, fmt::format("byte {}", at));
    }
  }
}

TEST_F(CacheFile, PaddingDoesNotMatter) {
  Bytes bytes = good();
  const auto entry = entry_at(bytes, 0);
  ASSERT_NE(entry.size % 64, 0u);
  bytes[entry.offset + entry.size] = 0xff;
  write_bytes(path_, bytes);
  expect_equal(load_cache(path_), make_golden_cache());
}

TEST_F(CacheFile, TruncationAtAnyLengthIsTruncation) {
  const Bytes bytes = good();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    const Error error = error_of(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)));
    EXPECT_EQ(error.code(), size < 8 ? ErrorCode::kNotACache : ErrorCode::kTruncated) << size;
  }
}

TEST_F(CacheFile, WhatFollowsTheEndIsRefused) {
  Bytes bytes = good();
  bytes.push_back(0);
  EXPECT_EQ(error_of(bytes).code(), ErrorCode::kDamaged);
  bytes.resize(bytes.size() + 63);
  put(bytes, offsetof(layout::Header, file_size), std::uint64_t{bytes.size()});
  seal(bytes);
  EXPECT_EQ(error_of(bytes).code(), ErrorCode::kDamaged);
}

TEST_F(CacheFile, NewerVersionsAreToldFromDamage) {
  Bytes bytes = good();
  put(bytes, offsetof(layout::Header, version), std::uint32_t{2});
  EXPECT_EQ(error_of(bytes).code(), ErrorCode::kDamaged);
  seal(bytes);
  EXPECT_EQ(error_of(bytes).code(), ErrorCode::kNewerVersion);
  // Whatever a newer version has behind the header.
  bytes.resize(100);
  EXPECT_EQ(error_of(bytes).code(), ErrorCode::kNewerVersion);
  put(bytes, offsetof(layout::Header, version), std::uint32_t{0});
  seal(bytes);
  EXPECT_EQ(error_of(bytes).code(), ErrorCode::kDamaged);
}

// Checksums are right in all that follow: what they protect is hostile.
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
    for (const std::uint64_t at : {0, 4})  // number of entries, length of the first key
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

TEST_F(CacheFile, OtherThingsAreNotCaches) {
  const std::string text = "<scene version=\"0.6.0\">\n</scene>\n";
  EXPECT_EQ(error_of(Bytes(text.begin(), text.end())).code(), ErrorCode::kNotACache);
  EXPECT_FALSE(is_cache_file(path_));
  EXPECT_EQ(error_of(Bytes{}).code(), ErrorCode::kNotACache);
  EXPECT_EQ(error_of(folder_).code(), ErrorCode::kNotACache);
  EXPECT_FALSE(is_cache_file(folder_));
  EXPECT_EQ(error_of("/dev/null").code(), ErrorCode::kNotACache);
  EXPECT_EQ(error_of(folder_ + "missing.nacre").code(), ErrorCode::kNotFound);
  EXPECT_EQ(error_of(folder_ + "missing/a.nacre").code(), ErrorCode::kNotFound);
  EXPECT_FALSE(is_cache_file(folder_ + "missing.nacre"));
  good();
  EXPECT_TRUE(is_cache_file(path_));
}

// Nobody writes to it: to wait for it would be to wait for ever.
TEST_F(CacheFile, PipesAreNotWaitedFor) {
  const std::string pipe = folder_ + "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(error_of(pipe).code(), ErrorCode::kNotACache);
  EXPECT_FALSE(is_cache_file(pipe));
}

std::size_t count_files(const std::string& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder), {}));
}
ErrorCode save_error(const std::string& path) {
  try {
    save_cache(make_golden_cache(), path);
  } catch (const Error& error) {
    return error.code();
  }
  return ErrorCode::kMismatch;
}

TEST_F(CacheFile, WhatCannotBeWrittenLeavesNothingBehind) {
  EXPECT_EQ(save_error(folder_ + "missing/a.nacre"), ErrorCode::kIo);
  std::filesystem::create_directory(folder_ + "taken");
  EXPECT_EQ(save_error(folder_ + "taken"), ErrorCode::kIo);
  EXPECT_EQ(count_files(folder_), 1u);
  EXPECT_EQ(count_files(folder_ + "taken"), 0u);
  if (geteuid() != 0) {  // root may write anywhere
    std::filesystem::permissions(folder_ + "taken", std::filesystem::perms::owner_read);
    EXPECT_EQ(save_error(folder_ + "taken/a.nacre"), ErrorCode::kIo);
    std::filesystem::permissions(folder_ + "taken", std::filesystem::perms::owner_all);
    EXPECT_EQ(count_files(folder_ + "taken"), 0u);
  }
  EXPECT_EQ(save_error(path_), ErrorCode::kMismatch);  // that one works
  EXPECT_EQ(count_files(folder_), 2u);
}

TEST_F(CacheFile, IsReplacedWhole) {
  write_bytes(path_, Bytes(100000, 'x'));
  good();
  expect_equal(load_cache(path_), make_golden_cache());
}

}  // namespace
}  // namespace nacre
