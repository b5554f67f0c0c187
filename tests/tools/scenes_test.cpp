// label: cli
// Every example scene renders, to pictures without broken pixels whose layers add up.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <regex>
#include <vector>

#include "nacre/render/image_file.h"
#include "tools/cli.h"

namespace nacre {
namespace {

using testing_support::read_file;
using testing_support::run_nacre;
using testing_support::TemporaryFolder;

const std::filesystem::path kScenes = std::filesystem::path(NACRE_SOURCE_DIR) / "scenes";

// Meshes that tools/fetch_meshes.sh has to bring and that are not there.
bool lacks_mesh(const std::string& scene) {
  const std::regex mesh("value=\"(meshes/[^\"]+)\"");
  return std::any_of(
      std::sregex_iterator(scene.begin(), scene.end(), mesh), std::sregex_iterator(),
      [](const std::smatch& found) { return !std::filesystem::exists(kScenes / found[1].str()); });
}

std::vector<std::string> scene_names() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(kScenes))
    if (entry.path().extension() == ".xml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

class ExampleScene : public testing::TestWithParam<std::string> {};

TEST_P(ExampleScene, RendersCleanLayersThatAddUp) {
  const std::filesystem::path scene = kScenes / (GetParam() + ".xml");
  const std::string text = read_file(scene.string());
  ASSERT_FALSE(text.empty());
  if (lacks_mesh(text)) GTEST_SKIP() << "its mesh is not there: tools/fetch_meshes.sh";
  const TemporaryFolder folder;
  // Few samples far apart: what is tested does not depend on them.
  std::string command = "render '" + scene.string() +
                        "' -o a.exr --size 48x27 --spp 1 --spacing 2 --irradiance-samples 2 --aov layers";
  if (text.find("--interreflect") != std::string::npos) command += " --interreflect";
  const auto result = run_nacre(folder, command);
  ASSERT_EQ(result.exit_code, 0) << result.output;

  const Image image = load_exr(folder.file("a.exr"));
  ASSERT_EQ(image.width * image.height, 48 * 27);
  double light = 0;
  for (const Channel& channel : image.channels)
    for (std::size_t i = 0; i < channel.values.size(); ++i) {
      ASSERT_TRUE(std::isfinite(channel.values[i])) << channel.name << " of pixel " << i;
      ASSERT_GE(channel.values[i], 0) << channel.name << " of pixel " << i;
      light += static_cast<double>(channel.values[i]);
    }
  EXPECT_GT(light, 0);
  for (const std::string k : {"R", "G", "B"}) {
    const Channel* beauty = find_channel(image, k);
    ASSERT_NE(beauty, nullptr);
    std::vector<float> sum(beauty->values.size(), 0.0f);
    for (const std::string layer : {"diffusion.", "single.", "specular.", "surface."}) {
      const Channel* channel = find_channel(image, layer + k);
      ASSERT_NE(channel, nullptr) << layer + k;
      for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += channel->values[i];
    }
    EXPECT_EQ(beauty->values, sum) << k;  // bit for bit
  }
}

INSTANTIATE_TEST_SUITE_P(All, ExampleScene, testing::ValuesIn(scene_names()),
                         [](const auto& scene) { return scene.param; });

}  // namespace
}  // namespace nacre
