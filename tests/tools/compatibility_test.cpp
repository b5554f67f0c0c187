// label: cli
// What an earlier version has written or read serves this one: a scene with every kind of element, and its
// cache.
#include <gtest/gtest.h>

#include <vector>

#include "tools/cli.h"

namespace nacre::testing_support {
namespace {

const std::vector<std::string> kVersions{"0.1"};

class Compatibility : public testing::Test {
 protected:
  void SetUp() override {
    const std::filesystem::path golden = NACRE_SOURCE_DIR "/tests/golden";
    std::filesystem::copy(golden / "compatibility", folder_.path() / "compatibility");
    std::filesystem::copy(golden / "meshes", folder_.path() / "meshes");
  }
  std::string run(const std::string& arguments) const {
    const ProgramResult result =
        run_shell(folder_, "(cd compatibility && '" NACRE_PROGRAM "' " + arguments + ")");
    EXPECT_EQ(result.exit_code, 0) << arguments << "\n" << result.output;
    return result.output;
  }
  TemporaryFolder folder_;
};

TEST_F(Compatibility, ScenesMeanWhatTheyMeant) {
  for (const std::string& version : kVersions) {
    const std::string now = run("info scene-" + version + ".xml 2>/dev/null | grep -v '^bake\\|^cache'");
    EXPECT_EQ(now, read_file(folder_.file("compatibility/scene-" + version + ".txt")));
  }
}

TEST_F(Compatibility, CachesServeTheirScenes) {
  for (const std::string& version : kVersions) {
    const std::string name = "scene-" + version;
    EXPECT_NE(run("info --check " + name + ".nacre").find("sound"), std::string::npos);
    run("render " + name + ".xml --cache " + name + ".nacre --spp 1 -o a.exr");
    run("info --check a.exr");
  }
}

}  // namespace
}  // namespace nacre::testing_support
