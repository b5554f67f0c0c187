// label: unit
// The house rules that a compiler does not know: which layer includes which, which library is seen where, how
// long a file may be.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <sstream>

#include "nacre/base/file.h"

namespace nacre {
namespace {

// A layer includes itself and those before it.
const std::vector<std::string> kLayers{"base",      "optics", "geometry", "scene",
                                       "transport", "cache",  "bake",     "render"};
// ... and these not even so.
const std::vector<std::pair<std::string, std::string>> kForbidden{{"render", "bake"}};

// Who may include a library, by the beginning of the header's name. Public headers are under include/.
struct Library {
  std::string header;
  std::vector<std::string> users;
};
const std::vector<Library> kLibraries{
    {"Imath", {"include/", "src/", "tools/"}},
    {"half.h", {"include/", "src/"}},
    {"fmt/", {"include/", "src/", "tools/"}},
    {"tbb/", {"include/", "src/"}},
    {"nlohmann/", {"src/base/", "tools/"}},
    {"embree3/", {"src/geometry/"}},
    {"OpenMesh/", {"src/geometry/"}},
    {"pugixml", {"src/scene/"}},
    {"zlib.h", {"src/geometry/serialized_file.cpp", "src/render/png_file.cpp"}},
    {"xxhash", {"src/cache/", "src/bake/journal.cpp"}},
    {"flann/", {"src/bake/"}},
    {"Eigen/", {"src/cache/kernel_span.cpp"}},
    {"hwy/",
     {"src/base/simd.cpp", "src/cache/lanes-inl.h", "src/cache/sum_lanes.cpp", "src/cache/set_lanes.cpp",
      "src/cache/sort_lanes.cpp"}},
    {"Imf", {"src/render/", "src/scene/bitmap_exr.cpp"}},
    {"Iex", {"src/render/"}},
    {"IlmThread", {"src/render/"}},
    {"OpenEXR/", {"src/render/"}},
    {"openexr", {"src/render/"}},
    {"stb", {"src/render/", "src/scene/bitmap.cpp", "tools/contact_sheet.cpp"}},
    {"CLI/", {"tools/"}},
};
const std::vector<std::string> kSystemHeaders{"sys/",     "fcntl.h",  "unistd.h",
                                              "signal.h", "dirent.h", "malloc.h"};

constexpr std::size_t kMaxLines = 400;

using Problems = std::vector<std::string>;

int rank_of(const std::string& layer) {
  const auto at = std::ranges::find(kLayers, layer);
  return at == kLayers.end() ? -1 : static_cast<int>(at - kLayers.begin());
}

std::string first_folder(const std::string& path) { return path.substr(0, path.find('/')); }

// The layer of a file of the project, "" if it belongs to none (tools).
std::string layer_of(const std::string& file) {
  for (const std::string root : {"include/nacre/", "src/"})
    if (file.starts_with(root)) return first_folder(file.substr(root.size()));
  return "";
}

void check_layer(const std::string& file, const std::string& included, const std::string& place,
                 Problems& problems) {
  const std::string from = layer_of(file);
  if (rank_of(included) < 0) problems.push_back(place + ": '" + included + "' is no layer");
  if (from.empty()) return;
  const bool forbidden = std::ranges::find(kForbidden, std::pair{from, included}) != kForbidden.end();
  if (rank_of(included) > rank_of(from) || forbidden)
    problems.push_back(place + ": layer " + from + " may not include layer " + included);
}

void check_quoted(const std::string& file, const std::string& header, const std::string& place,
                  Problems& problems) {
  if (header.starts_with("nacre/")) return check_layer(file, first_folder(header.substr(6)), place, problems);
  if (header.find('/') == std::string::npos) return;  // beside the file
  // A private header of a layer: for src alone.
  if (!file.starts_with("src/")) problems.push_back(place + ": \"" + header + "\" is private to src");
  check_layer(file, first_folder(header), place, problems);
}

void check_angled(const std::string& file, const std::string& header, const std::string& place,
                  Problems& problems) {
  const auto library =
      std::ranges::find_if(kLibraries, [&](const Library& l) { return header.starts_with(l.header); });
  if (library != kLibraries.end()) {
    if (std::ranges::none_of(library->users, [&](const std::string& user) { return file.starts_with(user); }))
      problems.push_back(place + ": <" + header + "> is not for this file");
    return;
  }
  const bool standard = header.find_first_of("./") == std::string::npos;
  const bool system = std::ranges::any_of(
      kSystemHeaders, [&](const std::string& prefix) { return header.starts_with(prefix); });
  if (!standard && !(system && !file.starts_with("include/")))
    problems.push_back(place + ": <" + header + "> is a library that the list in this test does not know");
}

Problems check_includes(const std::string& file, const std::string& text) {
  Problems problems;
  if (const std::string layer = layer_of(file); !layer.empty() && rank_of(layer) < 0)
    problems.push_back(file + ": '" + layer + "' is no layer");
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    const std::size_t hash = line.find_first_not_of(" \t");
    if (hash == std::string::npos || line[hash] != '#') continue;
    const std::size_t word = line.find_first_not_of(" \t", hash + 1);
    if (word == std::string::npos || !line.substr(word).starts_with("include")) continue;
    const std::size_t open = line.find_first_of("\"<", word);
    const std::size_t close = open == std::string::npos ? open : line.find_first_of("\">", open + 1);
    const std::string place = file + ":" + std::to_string(number);
    if (close == std::string::npos) {
      problems.push_back(place + ": an include that names no header");
      continue;
    }
    const std::string header = line.substr(open + 1, close - open - 1);
    if (line[open] == '<')
      check_angled(file, header, place, problems);
    else
      check_quoted(file, header, place, problems);
  }
  return problems;
}

Problems check_length(const std::string& file, const std::string& text) {
  const auto lines = static_cast<std::size_t>(std::ranges::count(text, '\n'));
  if (lines <= kMaxLines) return {};
  return {file + ": " + std::to_string(lines) + " lines, more than " + std::to_string(kMaxLines)};
}

// A clone has nothing beside it, so nothing may point there.
Problems check_mentions(const std::string& file, const std::string& text) {
  const std::string beside = std::string("../") + "shared";
  if (text.find(beside) == std::string::npos) return {};
  return {file + ": mentions " + beside};
}

// Every file below the folders, by its path from the root of the source.
std::map<std::string, std::string> read_files(const std::vector<std::string>& folders) {
  const std::filesystem::path root(NACRE_SOURCE_DIR);
  std::map<std::string, std::string> files;
  for (const std::string& folder : folders) {
    if (!std::filesystem::exists(root / folder)) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
      const std::string name = std::filesystem::relative(entry.path(), root).generic_string();
      const bool fetched = name.starts_with("scenes/meshes/") || name.starts_with("scenes/out/");
      if (entry.is_regular_file() && !fetched) files[name] = read_text_file(entry.path().string());
    }
  }
  return files;
}

std::string join(const Problems& problems) {
  std::string text;
  for (const std::string& problem : problems) text += problem + "\n";
  return text;
}

TEST(Layering, IncludesFollowTheLayers) {
  const auto files = read_files({"include", "src", "tools"});
  ASSERT_GT(files.size(), 20u);
  Problems problems;
  for (const auto& [file, text] : files)
    if (file.ends_with(".cpp") || file.ends_with(".h") || file.ends_with(".in"))
      std::ranges::copy(check_includes(file, text), std::back_inserter(problems));
  EXPECT_TRUE(problems.empty()) << join(problems);
}

TEST(Layering, NoFileIsTooLong) {
  Problems problems;
  for (const auto& [file, text] : read_files({"include", "src", "tools"}))
    std::ranges::copy(check_length(file, text), std::back_inserter(problems));
  EXPECT_TRUE(problems.empty()) << join(problems);
}

TEST(Layering, NoFilePointsOutsideTheClone) {
  Problems problems;
  auto files = read_files({"include", "src", "tools", "tests", "scenes", "cmake", ".ci"});
  const std::filesystem::path root(NACRE_SOURCE_DIR);
  for (const auto& entry : std::filesystem::directory_iterator(root))
    if (entry.is_regular_file())
      files[entry.path().filename().string()] = read_text_file(entry.path().string());
  ASSERT_TRUE(files.contains("CMakeLists.txt"));
  for (const auto& [file, text] : files)
    std::ranges::copy(check_mentions(file, text), std::back_inserter(problems));
  EXPECT_TRUE(problems.empty()) << join(problems);
}

// What the three tests above are made of finds what it is for.
TEST(Layering, FindsUpwardIncludes) {
  const auto count = [](const std::string& file, const std::string& text) {
    return check_includes(file, text).size();
  };
  EXPECT_EQ(count("src/optics/a.cpp", "#include \"nacre/scene/scene.h\"\n"), 1u);
  EXPECT_EQ(count("src/optics/a.cpp", "  # include \"nacre/scene/scene.h\"\n"), 1u);
  EXPECT_EQ(count("src/optics/a.cpp", "#include \"scene/private.h\"\n"), 1u);
  EXPECT_EQ(count("include/nacre/base/a.h", "#include \"nacre/optics/medium.h\"\n"), 1u);
  EXPECT_EQ(count("src/render/a.cpp", "#include \"nacre/bake/bake.h\"\n"), 1u);
  EXPECT_EQ(count("src/render/a.cpp", "#include \"nacre/elsewhere/bake.h\"\n"), 1u);
  EXPECT_EQ(count("src/elsewhere/a.cpp", ""), 1u);
  EXPECT_EQ(count("tools/a.cpp", "#include \"render/pixels.h\"\n"), 1u);
  EXPECT_EQ(count("src/base/a.cpp", "#include HEADER\n"), 1u);
  EXPECT_EQ(count("src/render/a.cpp", "#include \"nacre/cache/cache.h\"\n#include \"pixels.h\"\n"), 0u);
  EXPECT_EQ(count("src/bake/a.cpp", "#include \"nacre/base/error.h\"\n#include \"bake/a.h\"\n"), 0u);
  EXPECT_EQ(count("tools/a.cpp", "#include \"nacre/bake/bake.h\"\n#include \"command.h\"\n"), 0u);
}

TEST(Layering, FindsLibrariesInTheWrongPlace) {
  const auto count = [](const std::string& file, const std::string& header) {
    return check_includes(file, "#include <" + header + ">\n").size();
  };
  EXPECT_EQ(count("src/scene/a.cpp", "embree3/rtcore.h"), 1u);
  EXPECT_EQ(count("src/render/a.cpp", "flann/flann.hpp"), 1u);
  EXPECT_EQ(count("include/nacre/geometry/a.h", "OpenMesh/Core/Mesh/Traits.hh"), 1u);
  EXPECT_EQ(count("include/nacre/render/a.h", "ImfHeader.h"), 1u);
  EXPECT_EQ(count("src/bake/a.cpp", "CLI/CLI.hpp"), 1u);
  EXPECT_EQ(count("src/base/a.cpp", "unknown/library.h"), 1u);
  EXPECT_EQ(count("include/nacre/base/a.h", "unistd.h"), 1u);
  EXPECT_EQ(count("src/base/a.cpp", "unistd.h"), 0u);
  EXPECT_EQ(count("src/geometry/a.cpp", "embree3/rtcore.h"), 0u);
  EXPECT_EQ(count("include/nacre/base/a.h", "ImathVec.h"), 0u);
  EXPECT_EQ(count("include/nacre/base/a.h", "vector"), 0u);
}

TEST(Layering, FindsLongFilesAndMentions) {
  EXPECT_EQ(check_length("a", std::string(400, '\n')).size(), 0u);
  EXPECT_EQ(check_length("a", std::string(401, '\n')).size(), 1u);
  EXPECT_EQ(check_mentions("a", std::string("see ..") + "/shared/x").size(), 1u);
  EXPECT_EQ(check_mentions("a", "shared").size(), 0u);
}

}  // namespace
}  // namespace nacre
