// label: image
// A few random scenes; tools/soak.sh goes on for as long as one likes.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "soak/trial.h"

namespace nacre::soak {
namespace {

TEST(Soak, RandomScenesHoldWhatIsPromised) {
  std::string folder = testing::TempDir() + "nacre-soak-XXXXXX";
  ASSERT_NE(::mkdtemp(folder.data()), nullptr);
  int rendered = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const Trial trial = run_trial(seed, folder);
    EXPECT_EQ(trial.violation, "") << "seed " << seed << ": " << trial.options;
    rendered += trial.refusal.empty();
  }
  std::filesystem::remove_all(folder);
  EXPECT_GE(rendered, 8);
}

}  // namespace
}  // namespace nacre::soak
