// label: unit
// Caches as point clouds: there and back, from other programs, and what is wrong with a file.
#include "nacre/cache/point_cloud.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "cache/sample_sets.h"
#include "nacre/base/error.h"
#include "nacre/base/file.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/octree.h"
#include "tools/cli.h"

namespace nacre {
namespace {

using namespace testing_support;

Cache make_cache() {
  Cache cache;
  cache.fingerprint = {{"light key/position", "0 1 2"}, {"shape a\\b/geometry", "tab\tand\nline\r"}};
  cache.info = {{"version", "0.1.0"}, {"empty", ""}};
  std::vector<std::shared_ptr<const void>> storage;
  cache.groups.push_back(build_group("marble", 4, make_plane(24, &coloured_light), storage));
  cache.groups.push_back(build_group("milk", 12.566, make_sphere(9, &side_light), storage));
  cache.storage = std::make_shared<const std::vector<std::shared_ptr<const void>>>(std::move(storage));
  return cache;
}

void write_file(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

// In which order the octree has them is not that of the file.
std::vector<float> sorted_plane(const CacheGroup& group, Plane plane) {
  std::vector<float> values(group.plane(plane).begin(), group.plane(plane).end());
  std::ranges::sort(values);
  return values;
}

TEST(PointCloud, ThereAndBackIsTheSameFile) {
  const TemporaryFolder folder;
  const Cache cache = make_cache();
  save_cache(cache, folder.file("a.nacre"));
  export_cloud(cache, folder.file("a.ply"));
  const Cache back = import_cloud(folder.file("a.ply"));
  save_cache(back, folder.file("b.nacre"));
  EXPECT_EQ(read_text_file(folder.file("a.nacre")), read_text_file(folder.file("b.nacre")));
  EXPECT_EQ(folder.count(), 3u);  // nothing temporary is left
}

TEST(PointCloud, CsvHasAHeaderAndALineForEachSample) {
  const TemporaryFolder folder;
  const Cache cache = make_cache();
  export_cloud(cache, folder.file("a.csv"));
  std::ifstream file(folder.file("a.csv"));
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line, "x,y,z,nx,ny,nz,area,er,eg,eb,group");
  for (std::size_t g = 0; g < cache.groups.size(); ++g)
    for (std::size_t i = 0; i < cache.groups[g].size(); ++i) {
      ASSERT_TRUE(std::getline(file, line));
      std::array<float, kPlaneCount> v;
      int group = -1;
      ASSERT_EQ(std::sscanf(line.c_str(), "%f,%f,%f,%f,%f,%f,%f,%f,%f,%f,%d", &v[0], &v[1], &v[2], &v[3],
                            &v[4], &v[5], &v[6], &v[7], &v[8], &v[9], &group),
                11)
          << line;
      for (std::size_t k = 0; k < kPlaneCount; ++k) EXPECT_EQ(v[k], cache.groups[g].planes[k][i]) << line;
      EXPECT_EQ(group, static_cast<int>(g));
    }
  EXPECT_FALSE(std::getline(file, line));
}

// Other programs sort columns, add their own, write doubles, text, or the other order of bytes.
TEST(PointCloud, OtherProgramsMayHaveSavedIt) {
  const TemporaryFolder folder;
  const Cache cache = make_cache();
  std::string text =
      "ply\nformat ascii 1.0\ncomment saved by another program\n"
      "element vertex 2\nproperty double z\nproperty uchar red\nproperty float x\nproperty float y\n"
      "property float eb\nproperty float eg\nproperty float er\nproperty float area\nproperty float nx\n"
      "property float ny\nproperty float nz\nproperty int group\nelement face 0\n"
      "property list uchar int vertex_indices\nend_header\n"
      "3 255 1 2 0.3 0.2 0.1 12.5 0 0 1 1\n4 0 1.5 2 6 5 4 3.5 0 1 0 0\n";
  write_file(folder.file("b.ply"), text);
  const Cache back = import_cloud(folder.file("b.ply"), &cache);
  EXPECT_EQ(back.fingerprint, cache.fingerprint);
  ASSERT_EQ(back.groups.size(), 2u);
  EXPECT_EQ(back.groups[1].name, "milk");
  ASSERT_EQ(back.groups[1].size(), 1u);
  EXPECT_EQ(back.groups[1].position(0), Vec3(1, 2, 3));
  EXPECT_EQ(back.groups[1].irradiance(0), Rgb(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(back.groups[0].normal(0), Vec3(0, 1, 0));
  EXPECT_EQ(back.groups[0].area(0), 3.5f);

  export_cloud(cache, folder.file("a.ply"));
  std::string bytes = read_text_file(folder.file("a.ply"));
  const std::string little = "binary_little_endian";
  bytes.replace(bytes.find(little), little.size(), "binary_big_endian");
  const std::size_t body = bytes.find("end_header\n") + 11;
  for (std::size_t i = body; i < bytes.size(); i += 4) std::reverse(&bytes[i], &bytes[i] + 4);
  write_file(folder.file("c.ply"), bytes);
  const Cache big = import_cloud(folder.file("c.ply"));
  for (std::size_t g = 0; g < 2; ++g)
    for (std::size_t k = 0; k < kPlaneCount; ++k)
      EXPECT_EQ(sorted_plane(big.groups[g], static_cast<Plane>(k)),
                sorted_plane(cache.groups[g], static_cast<Plane>(k)));
}

TEST(PointCloud, SaysWhatIsWrong) {
  const TemporaryFolder folder;
  const Cache cache = make_cache();
  const std::string path = folder.file("a.ply");
  export_cloud(cache, path);
  const std::string good = read_text_file(path);
  const auto error_of = [&](const std::string& text, const Cache* like = nullptr) {
    write_file(path, text);
    try {
      import_cloud(path, like);
    } catch (const Error& error) {
      EXPECT_EQ(error.place(), path);
      return error.reason();
    }
    ADD_FAILURE() << "no error";
    return std::string();
  };
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    return text.replace(text.find(from), from.size(), to);
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos ? testing::AssertionSuccess()
                                                : testing::AssertionFailure() << text;
  };
  EXPECT_TRUE(has(error_of(good.substr(0, good.size() - 1)), "promises"));
  EXPECT_TRUE(has(error_of(replaced("float area", "float size")), "no property area"));
  EXPECT_TRUE(has(error_of(replaced("nacre fingerprint\t", "nacre fingerprint ")), "was changed"));
  EXPECT_TRUE(has(error_of(replaced("group\tmilk\t", "group\tmilk\t-")), "area of the group"));
  EXPECT_TRUE(has(error_of(replaced("element vertex", "element face")), "element vertex"));
  std::string bare = good;
  for (std::size_t at; (at = bare.find("comment nacre")) != std::string::npos;)
    bare.replace(at, 13, "comment other");
  EXPECT_TRUE(has(error_of(bare), "--like"));

  const auto point = [&](const std::string& values) {
    std::string text = "ply\nformat ascii 1.0\nelement vertex 1\n";
    for (const char* column : {"x", "y", "z", "nx", "ny", "nz", "area", "er", "eg", "eb", "group"})
      text += "property float " + std::string(column) + "\n";
    return error_of(text + "end_header\n" + values + "\n", &cache);
  };
  EXPECT_TRUE(has(point("0 0 0 0 0 1 -1 1 1 1 0"), "area of point 0 is -1"));
  EXPECT_TRUE(has(point("0 0 0 0 0 1 1 1 1 1 2"), "point 0 is of group 2; there are 2"));
  EXPECT_TRUE(has(point("0 0 0 0 0 1 1 1 1 1 0.5"), "group 0.5"));
  EXPECT_TRUE(has(point("nan 0 0 0 0 1 1 1 1 1 0"), "not a finite number"));
  EXPECT_TRUE(has(point("0 0 0 0 0 1 1 1 1 1 -1"), "group -1;"));
  EXPECT_TRUE(has(point("0 0 0 0 0 1 1.000 1.000000"), "missing"));
  EXPECT_TRUE(has(point("0 0 0 0 0 1 4 1 1 1 0 7"), "more numbers than the 11"));
  EXPECT_TRUE(has(point("0 1e16 0 0 0 1 4 1 1 1 0"), "y of point 0 is 1e+16, more than 1e+15"));
  EXPECT_TRUE(has(point("0 0 0 0 0 0 4 1 1 1 0"), "normal of point 0"));
  EXPECT_TRUE(has(point("0 0 0 0 0 1 4 1 1 1 0\n0 0 0"), "6 bytes follow the last of the 1 points"));
  EXPECT_TRUE(has(error_of(good + "x"), "1 bytes follow"));
  // Of a binary file the group is an int.
  std::string negative = good;
  negative.replace(negative.size() - 4, 4, std::string(4, '\xff'));
  EXPECT_TRUE(has(error_of(negative), "is of group -1;"));
  EXPECT_THROW(export_cloud(cache, folder.file("a.xyz")), Error);
}

// Two points of the group marble (4 units^2) and one of milk (12.566).
std::string make_cloud(const std::string& first, const std::string& second) {
  std::string text = "ply\nformat ascii 1.0\nelement vertex 3\n";
  for (const char* column : {"x", "y", "z", "nx", "ny", "nz", "area", "er", "eg", "eb", "group"})
    text += "property float " + std::string(column) + "\n";
  return text + "end_header\n" + first + "\n" + second + "\n5 5 5 0 0 1 12.5 1 1 1 1\n\n";
}

TEST(PointCloud, IsHeldToItsSurface) {
  const TemporaryFolder folder;
  const Cache cache = make_cache();
  const std::string path = folder.file("a.ply");
  const auto refusal = [&](const std::string& first, const std::string& second) {
    write_file(path, make_cloud(first, second));
    try {
      import_cloud(path, &cache);
      return std::string();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kValue);
      return error.reason();
    }
  };
  const std::string tail = " 1 1 1 0";
  // Areas up to a factor of 2.
  for (const char* area : {"1.01", "2", "3.99"})
    EXPECT_EQ(refusal("0 0 0 0 0 1 " + std::string(area) + tail, "1 0 0 0 0 1 " + std::string(area) + tail),
              "");
  for (const char* area : {"0.99", "4.01"})
    EXPECT_NE(refusal("0 0 0 0 0 1 " + std::string(area) + tail, "1 0 0 0 0 1 " + std::string(area) + tail)
                  .find("the areas of group \"marble\" add up"),
              std::string::npos);
  EXPECT_NE(refusal("0 0 0 0 0 1 2" + tail, "0 0 0 0 1 0 2" + tail)
                .find("1 of the 2 points of group \"marble\" lie where others are"),
            std::string::npos);
}

TEST(PointCloud, EndingsMayBeInUpperCase) {
  const TemporaryFolder folder;
  const Cache cache = make_cache();
  for (const char* ending : {"ply", "csv"}) {
    std::string upper = ending;
    for (char& c : upper) c = static_cast<char>(c - 'a' + 'A');
    export_cloud(cache, folder.file(std::string("a.") + ending));
    export_cloud(cache, folder.file("b." + upper));
    EXPECT_EQ(read_text_file(folder.file(std::string("a.") + ending)),
              read_text_file(folder.file("b." + upper)));
  }
  EXPECT_EQ(import_cloud(folder.file("b.PLY")).sample_count(), cache.sample_count());
}

// Infinite power would not be a number in a picture.
TEST(PointCloud, PowersAreFinite) {
  const TemporaryFolder folder;
  const Cache cache = make_cache();
  std::string text = "ply\nformat ascii 1.0\nelement vertex 1\n";
  for (const char* column : {"x", "y", "z", "nx", "ny", "nz", "area", "er", "eg", "eb"})
    text += "property float " + std::string(column) + "\n";
  write_file(folder.file("a.ply"), text + "end_header\n0 0 0 0 0 1 1e30 1e30 1 1\n");
  EXPECT_THROW(import_cloud(folder.file("a.ply"), &cache), Error);
}

}  // namespace
}  // namespace nacre
