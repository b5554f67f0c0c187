// label: golden
// Cache files: round trips, golden files, and every way in which a file can be broken.
#include "nacre/cache/cache_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "cache/cache_file_fixture.h"

namespace nacre {
namespace {

using namespace testing_support;

const std::string kGolden = NACRE_SOURCE_DIR "/tests/golden/cache/";

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
    EXPECT_EQ(a.groups[g].eta, b.groups[g].eta);
    ASSERT_EQ(a.groups[g].lights.size(), b.groups[g].lights.size());
    for (std::size_t l = 0; l < a.groups[g].lights.size(); ++l) {
      const LightPlane &one = a.groups[g].lights[l], &other = b.groups[g].lights[l];
      EXPECT_EQ(one.name, other.name);
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_TRUE(std::ranges::equal(one.irradiance[k], other.irradiance[k]));
      EXPECT_TRUE(std::ranges::equal(one.errors, other.errors));
      EXPECT_TRUE(std::ranges::equal(one.ratios, other.ratios));
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

TEST_F(CacheFile, GoldenFileOfVersion2HoldsWhatItHeld) {
  const Cache cache = load_cache(kGolden + "good-v2.nacre");
  expect_equal(cache, make_golden_cache_2());
  save_cache(make_golden_cache_2(), path_);
  EXPECT_EQ(read_bytes(path_), read_bytes(kGolden + "good-v2.nacre"));
  save_cache(cache, path_);
  EXPECT_EQ(read_bytes(path_), read_bytes(kGolden + "good-v2.nacre"));
}

struct BadFile {
  const char* name;
  ErrorCode code;
  const char* text;
};

TEST_F(CacheFile, GoldenBadFilesAreRefused) {
  const BadFile files[] = {
      {"bad-text-transfer.nacre", ErrorCode::kNotACache, "is not a nacre cache"},
      {"bad-newer-version.nacre", ErrorCode::kNewerVersion, "format version 99"},
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

std::vector<Bytes> every_version() {
  return {read_bytes(kGolden + "good-v1.nacre"), read_bytes(kGolden + "good-v2.nacre")};
}

TEST_F(CacheFile, EveryFlippedBitOfHeaderAndTableIsRefused) {
  for (const Bytes& bytes : every_version()) {
    const std::size_t end = sizeof(layout::Header) + count_sections(bytes) * sizeof(layout::SectionEntry);
    for (std::size_t i = 0; i < end; ++i) {
      Bytes flipped = bytes;
      flipped[i] ^= static_cast<unsigned char>(1u << (i % 8));
      EXPECT_EQ(error_of(flipped).code(), i < 8 ? ErrorCode::kNotACache : ErrorCode::kDamaged) << i;
    }
  }
}

TEST_F(CacheFile, FlippedBytesAreFoundInTheirSection) {
  for (const Bytes& bytes : every_version())
    for (std::size_t i = 0; i < count_sections(bytes); ++i) {
      const auto entry = entry_at(bytes, i);
      for (std::uint64_t at = 0; at < entry.size; at += 3) {
        Bytes flipped = bytes;
        flipped[entry.offset + at] ^= 0x10;
        expect_damaged(flipped, std::string(entry.kind.data(), 4), entry.group, fmt::format("byte {}", at));
      }
    }
}

// Two sections that have changed places, or their entries in the table.
TEST_F(CacheFile, SwappedSectionsAreRefused) {
  for (const Bytes& bytes : every_version()) {
    const std::size_t sections = count_sections(bytes);
    int contents = 0;
    for (std::size_t i = 0; i < sections; ++i)
      for (std::size_t k = 0; k < i; ++k) {
        const auto one = entry_at(bytes, i), other = entry_at(bytes, k);
        const auto table = [](std::size_t entry) {
          return static_cast<std::ptrdiff_t>(sizeof(layout::Header) + entry * sizeof(layout::SectionEntry));
        };
        Bytes swapped = bytes;
        std::swap_ranges(swapped.begin() + table(i), swapped.begin() + table(i + 1),
                         swapped.begin() + table(k));
        EXPECT_EQ(error_of(swapped).code(), ErrorCode::kDamaged);
        swapped = bytes;
        if (one.size != other.size || one.checksum == other.checksum) continue;
        std::swap_ranges(swapped.begin() + static_cast<std::ptrdiff_t>(one.offset),
                         swapped.begin() + static_cast<std::ptrdiff_t>(one.offset + one.size),
                         swapped.begin() + static_cast<std::ptrdiff_t>(other.offset));
        EXPECT_EQ(error_of(swapped).code(), ErrorCode::kDamaged);
        ++contents;
      }
    EXPECT_GE(contents, 20);
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
  for (const Bytes& bytes : every_version())
    for (std::size_t size = 0; size < bytes.size(); size += size < 512 ? 1 : 7) {
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
  put(bytes, offsetof(layout::Header, version), kCacheVersion + 1);
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
