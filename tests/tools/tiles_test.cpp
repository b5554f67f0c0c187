// label: cli
// A picture rendered in parts and merged is the picture rendered whole; what does not fit together is
// refused.
#include <gtest/gtest.h>

#include <algorithm>

#include "nacre/render/image_file.h"
#include "tools/cli.h"

namespace nacre {
namespace {

using testing_support::read_file;
using testing_support::run_nacre;
using testing_support::TemporaryFolder;

class Tiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_.write("s.xml", testing_support::kSmallScene);
    run("bake s.xml -o c.nacre --quiet --points 4000");
  }
  std::string run(const std::string& arguments, int expected = 0) {
    const auto result = run_nacre(folder_, arguments);
    EXPECT_EQ(result.exit_code, expected) << arguments << "\n" << result.output;
    return result.output;
  }
  void render(const std::string& arguments) { run("render s.xml --cache c.nacre --quiet " + arguments); }
  void expect_refusal(const std::string& arguments, int code, const std::string& text) {
    const std::string output = run(arguments, code);
    EXPECT_NE(output.find(text), std::string::npos) << output;
    EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 1) << output;
  }
  // Every channel, bit for bit, and all that the header says but the command, and what seals that.
  void expect_same(const std::string& a, const std::string& b) {
    Image first = load_exr(folder_.file(a)), second = load_exr(folder_.file(b));
    for (Image* const image : {&first, &second})
      for (const char* const own : {"nacre:command", kDigestKey}) image->metadata.erase(own);
    EXPECT_EQ(first.metadata, second.metadata);
    for (const std::string& layer : layer_names(second))
      EXPECT_TRUE(compare_images(first, second, layer).identical) << layer;
  }
  TemporaryFolder folder_;
};

TEST_F(Tiles, MergeToTheWholePicture) {
  render("-o whole.exr");
  render("-o 1.exr --tile 1/5 --threads 1");
  for (int k = 2; k <= 5; ++k) render("-o " + std::to_string(k) + ".exr --tile " + std::to_string(k) + "/5");
  run("merge 4.exr 1.exr 5.exr 2.exr 3.exr -o merged.exr --png --quiet");
  expect_same("merged.exr", "whole.exr");
  EXPECT_TRUE(std::filesystem::exists(folder_.file("merged.png")));
}

TEST_F(Tiles, MayBeAnyRectangles) {
  render("-o whole.exr --camera other --method exact");
  const char* const crops[] = {"0,0,20x12", "20,0,12x30", "0,12,20x20", "20,30,12x2"};
  for (const char* const crop : crops)
    render(std::string("--camera other --method exact --crop ") + crop + " -o " + crop + ".exr");
  run("merge 0,0,20x12.exr 20,0,12x30.exr 0,12,20x20.exr 20,30,12x2.exr -o merged.exr --quiet");
  expect_same("merged.exr", "whole.exr");
}

TEST_F(Tiles, BelongToAFrameOfAFilm) {
  for (const char* const k : {"1", "2"})
    render(std::string("--turntable 8 --frames 2:3 -o f.####.") + k + ".exr --tile " + k + "/2");
  render("--turntable 8 --frames 2 -o whole.####.exr");
  run("merge f.0002.1.exr f.0002.2.exr -o merged.exr --quiet");
  Image merged = load_exr(folder_.file("merged.exr")), whole = load_exr(folder_.file("whole.0002.exr"));
  EXPECT_TRUE(compare_images(merged, whole, "").identical);
  expect_refusal("merge f.0002.1.exr f.0003.2.exr -o x.exr", 1, "nacre:settings differs");
}

TEST_F(Tiles, RefuseWhatDoesNotFit) {
  render("-o 1.exr --tile 1/2");
  render("-o 2.exr --tile 2/2");
  expect_refusal("merge 1.exr -o x.exr", 1,
                 "1.exr: 1536 of the 64 x 48 pixels of the picture are in no part");
  expect_refusal("merge 1.exr 2.exr 1.exr -o x.exr", 1, "1.exr: overlaps 1.exr");
  expect_refusal("merge 1.exr 2.exr -o 2.exr", 2, "2.exr");
  std::string changed = read_file(folder_.file("2.exr"));
  changed[changed.find("diffusion.R")] = 'x';
  folder_.write("changed.exr", changed);
  expect_refusal("merge 1.exr changed.exr -o x.exr", 1, "changed.exr: is not as nacre wrote it");
  const auto expect_foreign = [&](const std::string& options, const std::string& text) {
    render("-o other.exr --tile 2/2 " + options);
    expect_refusal("merge 1.exr other.exr -o x.exr", 1, "other.exr: " + text);
  };
  expect_foreign("--spp 5", "is no part of the same picture as 1.exr: nacre:settings differs");
  expect_foreign("-D sigma_a=0.5", "is no part of the same picture as 1.exr: nacre:settings differs");
  expect_foreign("--seed 1", "is no part of the same picture as 1.exr: nacre:seed differs");
  expect_foreign("--aov none", "has other channels than 1.exr");
  expect_foreign("--size 64x50", "is of a frame of 64 x 50 pixels, 1.exr of one of 64 x 48");
  EXPECT_FALSE(std::filesystem::exists(folder_.file("x.exr")));
  expect_refusal("render s.xml --cache c.nacre -o x.exr --tile 3/2", 2, "K/N");
  expect_refusal("render s.xml --cache c.nacre -o x.exr --tile 1/49", 2, "48 rows");
  expect_refusal("render s.xml --cache c.nacre -o x.exr --tile 1/2 --crop 0,0,2x2", 2, "--crop");
}

}  // namespace
}  // namespace nacre
