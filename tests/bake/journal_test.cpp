// label: unit
// Bakes that were interrupted, and lights that are added later.
#include "bake/journal.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "nacre/bake/bake.h"
#include "nacre/base/error.h"
#include "nacre/base/parallel.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/relight.h"
#include "tools/cli.h"
#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

Scene lit_scene() {
  Scene scene;
  Medium medium = make_medium(*find_preset("Marble"));
  medium.scale = 5;
  add_shape(scene, make_rectangle(), kNone, add_medium(scene, medium));
  add_shape(scene, placed(make_sphere(), 0.5f, {0, 0, 1}), kNone, add_medium(scene, medium));
  add_area_light(scene, flipped(placed(make_rectangle(), 0.4f, {0.5f, 0, 2.5f})), Rgb(3, 2, 1));
  scene.lights.back().id = "lamp";
  add_constant_light(scene, Rgb(0.3f, 0.3f, 0.4f));
  scene.lights.back().id = "sky";
  return scene;
}

BakeParams params_for(const std::string& journal) {
  BakeParams params;
  params.points = 4000;
  params.irradiance_samples = 6;
  params.bounces = 1;
  params.irradiance_error = 0.1;
  params.per_light = true;
  params.journal = journal;
  params.journal_after = 0;
  return params;
}

Cache run(const Scene& scene, const BakeParams& params) {
  Progress progress;
  Report report;
  return bake(make_world(scene, params.shadows), plan_bake(scene, params), params, progress, report);
}

class JournalFile : public testing::Test {
 protected:
  std::string bytes_of(const Cache& cache) {
    save_cache(cache, folder_.file("c.nacre"));
    return read_file(folder_.file("c.nacre"));
  }
  void write(const std::string& bytes) { std::ofstream(path_, std::ios::binary) << bytes; }
  TemporaryFolder folder_;
  std::string path_ = folder_.file("a.part");
};

// Wherever the file was cut off, whatever it holds: the same cache, and what was there is not done again.
TEST_F(JournalFile, InterruptedBakesEndAlike) {
  const Scene scene = lit_scene();
  const std::string expected = bytes_of(run(scene, params_for("")));
  EXPECT_EQ(bytes_of(run(scene, params_for(path_))), expected);
  const std::string whole = read_file(path_);
  ASSERT_GT(whole.size(), 50000u);
  Rng rng(1);
  for (int i = 0; i < 12; ++i) {
    const auto cut = static_cast<std::size_t>(rng.next_double() * static_cast<double>(whole.size()));
    std::string bytes = whole.substr(0, i == 0 ? 10 : cut);
    if (i % 3 == 2) bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 0x10);
    write(bytes);
    EXPECT_EQ(bytes_of(run(scene, params_for(path_))), expected) << i;
    EXPECT_EQ(read_file(path_).size(), whole.size()) << i;
  }
}

TEST_F(JournalFile, HoldsForInterreflectionToo) {
  const Scene scene = lit_scene();
  BakeParams params = params_for("");
  params.interreflect = true;
  params.per_light = false;
  const std::string expected = bytes_of(run(scene, params));
  params.journal = path_;
  run(scene, params);
  const std::string whole = read_file(path_);
  write(whole.substr(0, whole.size() / 2));
  EXPECT_EQ(bytes_of(run(scene, params)), expected);
}

TEST_F(JournalFile, OfAnotherBakeIsNotUsed) {
  const Scene scene = lit_scene();
  run(scene, params_for(path_));
  BakeParams other = params_for(path_);
  other.seed = 5;
  const std::string with = bytes_of(run(scene, other));
  other.journal.clear();
  EXPECT_EQ(with, bytes_of(run(scene, other)));
  Scene brighter = scene;
  scale_light(brighter.lights[0], Rgb(2, 2, 2));
  EXPECT_EQ(bytes_of(run(brighter, params_for(path_))), bytes_of(run(brighter, params_for(""))));
}

// Whoever interrupted it is told, once, that it is lost.
TEST_F(JournalFile, OfAnotherBakeIsNotReplacedInSilence) {
  const Scene scene = lit_scene();
  const auto said = [&](const BakeParams& params, ProgressStyle style) {
    Progress progress(style);
    Report report;
    testing::internal::CaptureStderr();
    bake(make_world(scene, params.shadows), plan_bake(scene, params), params, progress, report);
    return testing::internal::GetCapturedStderr();
  };
  EXPECT_EQ(said(params_for(path_), ProgressStyle::kWarnings), "");
  EXPECT_EQ(said(params_for(path_), ProgressStyle::kWarnings), "");
  BakeParams other = params_for(path_);
  other.seed = 5;
  EXPECT_EQ(said(other, ProgressStyle::kWarnings),
            "nacre: warning: " + path_ +
                ": it is of an interrupted bake of another scene or other options, "
                "which this one replaces\n");
  EXPECT_EQ(said(params_for(path_), ProgressStyle::kSilent), "");
}

TEST_F(JournalFile, OtherFilesAreLeftAlone) {
  for (const char* notes : {"my own notes", "short"}) {
    write(notes);
    EXPECT_THROW(run(lit_scene(), params_for(path_)), Error);
    EXPECT_EQ(read_file(path_), notes);
  }
  // Of one that was cut off before its first bytes were there, nothing is lost.
  write("\x89NC");
  run(lit_scene(), params_for(path_));
}

TEST_F(JournalFile, AShortBakeLeavesNoTrace) {
  BakeParams params = params_for(path_);
  params.journal_after = 1000;
  run(lit_scene(), params);
  EXPECT_FALSE(std::filesystem::exists(path_));
}

TEST_F(JournalFile, RecordsComeBackWhole) {
  std::array<std::byte, 5> a{std::byte{1}, std::byte{2}};
  std::array<std::byte, 3> b{std::byte{7}};
  const std::array<std::span<const std::byte>, 2> parts{a, b};
  {
    Journal journal(path_, "key", 0);
    journal.keep({3, 512}, parts);
    EXPECT_THROW(Journal(path_, "key", 0), Error);
  }
  Journal journal(path_, "key", 0);
  EXPECT_EQ(journal.found(), 1u);
  std::array<std::byte, 5> c{};
  std::array<std::byte, 3> d{};
  const std::array<std::span<std::byte>, 2> into{c, d};
  EXPECT_TRUE(journal.restore({3, 512}, into));
  EXPECT_EQ(a, c);
  EXPECT_EQ(b, d);
  EXPECT_FALSE(journal.restore({3, 0}, into));
  EXPECT_FALSE(journal.restore({3, 512}, std::span(into).first(1)));
}

// Nothing else is computed, and nothing of it changes.
TEST_F(JournalFile, AddedLightsAreAsIfBakedWithTheOthers) {
  const Scene scene = lit_scene();
  Scene before = scene;
  before.lights.pop_back();
  Cache cache = run(before, params_for(""));
  BakeParams params = params_for("");
  params.only_lights = {"sky"};
  append_lights(cache, run(scene, params), "c.nacre");
  const Cache expected = run(scene, params_for(""));
  EXPECT_EQ(cache.fingerprint, expected.fingerprint);
  for (std::size_t g = 0; g < cache.groups.size(); ++g) {
    const CacheGroup &a = cache.groups[g], &b = expected.groups[g];
    ASSERT_EQ(a.lights.size(), 2u);
    for (std::size_t l = 0; l < 2; ++l) {
      EXPECT_EQ(a.lights[l].name, b.lights[l].name);
      EXPECT_TRUE(std::ranges::equal(a.lights[l].ratios, b.lights[l].ratios));
      EXPECT_TRUE(std::ranges::equal(a.lights[l].errors, b.lights[l].errors));
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_TRUE(std::ranges::equal(a.lights[l].irradiance[k], b.lights[l].irradiance[k]));
    }
    for (std::size_t k = 0; k < kPlaneCount; ++k) EXPECT_TRUE(std::ranges::equal(a.planes[k], b.planes[k]));
  }
  EXPECT_EQ(bytes_of(cache), bytes_of(expected));
}

TEST_F(JournalFile, LightsAreNotAddedToOtherSamples) {
  const Scene scene = lit_scene();
  Scene before = scene;
  before.lights.pop_back();
  BakeParams params = params_for("");
  params.only_lights = {"sky"};
  Cache cache = run(before, params_for(""));
  params.seed = 9;
  EXPECT_THROW(append_lights(cache, run(scene, params), "c.nacre"), Error);
  BakeParams together = params_for("");
  together.per_light = false;
  Cache without = run(before, together);
  params.seed = 0;
  EXPECT_THROW(append_lights(without, run(scene, params), "c.nacre"), Error);
}

}  // namespace
}  // namespace nacre
