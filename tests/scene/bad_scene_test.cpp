// label: golden
// Every bad scene in tests/golden/scenes is refused with the code and the one line that its first line
// states.
#include <algorithm>
#include <vector>

#include "nacre/base/file.h"
#include "scene/scene_text.h"

namespace nacre {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> bad_scenes() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(NACRE_SOURCE_DIR "/tests/golden/scenes"))
    if (entry.path().extension() == ".xml") names.push_back(entry.path().stem().string());
  std::ranges::sort(names);
  return names;
}

std::string code_name(ErrorCode code) {
  switch (code) {
    case ErrorCode::kNotFound:
      return "kNotFound";
    case ErrorCode::kSyntax:
      return "kSyntax";
    case ErrorCode::kUnsupported:
      return "kUnsupported";
    case ErrorCode::kValue:
      return "kValue";
    case ErrorCode::kLimit:
      return "kLimit";
    default:
      return "another code";
  }
}

void replace_all(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
}

class BadScene : public testing::TestWithParam<std::string> {};

TEST_P(BadScene, IsRefusedWithItsLine) {
  const std::string folder = NACRE_SOURCE_DIR "/tests/golden/scenes/";
  const std::string path = folder + GetParam() + ".xml";
  const std::string text = read_text_file(path);
  const std::string first_line = text.substr(0, text.find('\n'));
  ASSERT_TRUE(first_line.starts_with("<!-- ") && first_line.ends_with(" -->")) << first_line;
  std::string said = "nothing: it was accepted";
  try {
    load_scene(path);
  } catch (const Error& error) {
    said = code_name(error.code()) + ": " + error.what();
  }
  replace_all(said, folder, "");
  EXPECT_EQ(said, first_line.substr(5, first_line.size() - 9));
}

INSTANTIATE_TEST_SUITE_P(Golden, BadScene, testing::ValuesIn(bad_scenes()),
                         [](const auto& parameter) { return parameter.param; });

TEST(BadScenes, AreThere) { EXPECT_GE(bad_scenes().size(), 60u); }

}  // namespace
}  // namespace nacre
