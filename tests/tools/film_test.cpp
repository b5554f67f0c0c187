// label: cli
// Films: turntables, camera paths, numbers of frames, and going on where a film was.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "nacre/render/image_file.h"
#include "tools/cli.h"

namespace nacre {
namespace {

using testing_support::kSmallScene;
using testing_support::read_file;
using testing_support::run_nacre;
using testing_support::TemporaryFolder;

class FilmCommand : public testing::Test {
 protected:
  void SetUp() override {
    folder_.write("s.xml", kSmallScene);
    run("bake s.xml -o c.nacre --quiet --points 3000");
  }
  std::string run(const std::string& arguments, int expected = 0) {
    const auto result = run_nacre(folder_, arguments);
    EXPECT_EQ(result.exit_code, expected) << arguments << "\n" << result.output;
    return result.output;
  }
  std::string film(const std::string& arguments, int expected = 0) {
    return run("render s.xml --cache c.nacre --spp 1 " + arguments, expected);
  }
  void expect_refusal(const std::string& arguments, int code, const std::string& text) {
    const std::string output = film("-o x.exr " + arguments, code);
    EXPECT_NE(output.find(text), std::string::npos) << output;
    EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), 1) << output;
  }
  void expect_same(const std::string& a, const std::string& b) {
    EXPECT_NE(run("diff " + a + " " + b + " --fail-above 0").find("identical"), std::string::npos);
  }
  void expect_rendered(const std::string& output, int count) {
    EXPECT_NE(output.find(std::to_string(count) + " of "), std::string::npos) << output;
    int rendered = 0;
    for (std::size_t at = 0; (at = output.find("pixels in", at)) != std::string::npos; ++at) ++rendered;
    EXPECT_EQ(rendered, count) << output;
  }
  bool exists(const std::string& name) { return std::filesystem::exists(folder_.file(name)); }
  std::string bytes(const std::string& name) { return read_file(folder_.file(name)); }
  TemporaryFolder folder_;
};

TEST_F(FilmCommand, TurntableStartsAtTheCameraAndGoesRound) {
  film("--quiet -o t.####.exr --turntable 4");
  film("--quiet -o one.exr");
  expect_same("t.0001.exr", "one.exr");
  // From (0, 12, 40) round the middle of the ball, (0, 5, 0), to its right.
  std::string turned = kSmallScene;
  turned.replace(turned.find("0, 12, 40"), 9, "40, 12, 0");
  folder_.write("turned.xml", turned);
  run("render turned.xml --cache c.nacre --spp 1 --quiet -o right.exr");
  run("diff t.0002.exr right.exr --layer diffusion --fail-above 0.001");
  run("diff t.0002.exr t.0001.exr --layer diffusion --fail-above 0.001", 1);
  EXPECT_FALSE(exists("t.0005.exr"));
}

TEST_F(FilmCommand, AnyPartGivesTheSameFiles) {
  film("--quiet -o t.####.exr --turntable 5");
  std::filesystem::create_directory(folder_.file("part"));
  for (const char* part : {"5 --threads 1", "2:4:2", "1:3:2"})
    film(std::string("--quiet --turntable 5 -o part/t.%04d.exr --frames ") + part);
  for (const char* name : {"t.0001.exr", "t.0002.exr", "t.0003.exr", "t.0004.exr", "t.0005.exr"})
    EXPECT_EQ(bytes(name), bytes(std::string("part/") + name)) << name;
}

TEST_F(FilmCommand, NumbersGoWhereTheNameSays) {
  film("--quiet -o a.exr --turntable 3 --frames 2");
  film("--quiet -o b_##_x.exr --turntable 120 --frames 117:120:2 --png");
  film("--quiet -o %03dc.exr --turntable 3 --frames 3");
  for (const char* name : {"a.0002.exr", "b_117_x.exr", "b_119_x.exr", "b_117_x.png", "003c.exr"})
    EXPECT_TRUE(exists(name)) << name;
  EXPECT_FALSE(exists("a.exr"));
  EXPECT_NE(film("--turntable 3 -o a.##.##.exr", 2).find("one place"), std::string::npos);
}

TEST_F(FilmCommand, GoesOnWhereItWas) {
  const std::string command = "-o t.####.exr --turntable 4";
  expect_rendered(film(command), 4);
  const std::string third = bytes("t.0003.exr");
  expect_rendered(film(command), 0);
  std::filesystem::remove(folder_.file("t.0002.exr"));
  std::filesystem::resize_file(folder_.file("t.0003.exr"), third.size() / 2);
  folder_.write("t.0004.exr", "no picture");
  expect_rendered(film(command), 3);
  EXPECT_EQ(bytes("t.0003.exr"), third);
  // A name in the header that is another: the file is whole, the picture is not.
  std::string renamed = bytes("t.0001.exr");
  renamed[renamed.find("diffusion.R")] = 'x';
  folder_.write("t.0001.exr", renamed);
  EXPECT_NE(run_nacre(folder_, "info t.0001.exr --check").output.find("not as nacre wrote it"),
            std::string::npos);
  expect_rendered(film(command), 1);
  expect_rendered(film(command + " --seed 2"), 4);
  // The camera of frame 1 is the same in a film of other length.
  expect_rendered(film("-o t.####.exr --turntable 8 --seed 2"), 7);
}

TEST_F(FilmCommand, PathsHitTheirKeysAndOnlyWhatMovedIsRenderedAgain) {
  const auto write_path = [&](const std::string& last) {
    folder_.write("p.json", R"([{"frame": 11, "origin": [0, 12, 40], "target": [0, 5, 0], "fov": 35},
      {"frame": 13, "origin": [20, 15, 30], "target": [0, 5, 0]},
      {"frame": 14, "origin": [30, 12, 20], "target": [0, 5, 0], "up": [0, 2, 0]},
      {"frame": 15, "origin": [30, 12, 10], "target": [0, 5, 0]},
      {"frame": 16, "origin": [30, )" +
                                last + R"(, 0], "target": [0, 5, 0]}])");
  };
  write_path("12");
  expect_rendered(film("-o p.##.exr --camera-path p.json"), 6);
  film("--quiet -o main.exr");
  expect_same("p.11.exr", "main.exr");
  EXPECT_TRUE(exists("p.16.exr"));
  EXPECT_FALSE(exists("p.10.exr") || exists("p.17.exr"));
  // The slope at frame 15 changes, but there is no frame between its key and the next.
  write_path("14");
  expect_rendered(film("-o p.##.exr --camera-path p.json"), 1);
}

TEST_F(FilmCommand, PreviewsShareOneExposure) {
  const std::string command =
      "--turntable 3 --png --exposure auto --contact-sheet sheet.png -o t.exr --quiet --frames ";
  film(command + "1:2");
  EXPECT_FALSE(exists("t.0001.png") || exists("sheet.png"));
  film(command + "3");
  double lowest = 1e3;
  for (const char* name : {"t.0001.exr", "t.0002.exr", "t.0003.exr"})
    lowest = std::min(lowest, auto_exposure(load_exr(folder_.file(name))));
  for (const char* name : {"t.0001", "t.0002", "t.0003"}) {
    save_png(load_exr(folder_.file(std::string(name) + ".exr")), folder_.file("expected.png"), lowest);
    EXPECT_EQ(bytes(std::string(name) + ".png"), bytes("expected.png")) << name;
  }
  EXPECT_GT(bytes("sheet.png").size(), 1000u);
  // With an exposure that is given nothing has to wait for other frames.
  film("--turntable 9 --png --exposure 1 -o u.exr --quiet --frames 4 --contact-sheet u.png");
  save_png(load_exr(folder_.file("u.0004.exr")), folder_.file("expected.png"), 1);
  EXPECT_EQ(bytes("u.0004.png"), bytes("expected.png"));
  EXPECT_LT(bytes("u.png").size(), bytes("sheet.png").size());
}

TEST_F(FilmCommand, RefusesWhatIsNoFilm) {
  expect_refusal("--turntable 0", 2, "--turntable");
  expect_refusal("--frames 1:2", 2, "--turntable N");
  expect_refusal("--turntable 3 --camera main,other", 2, "one --camera");
  expect_refusal("--turntable 3 --camera-path p.json", 2, "either");
  expect_refusal("--turntable 3 --frames 2:4", 2, "frames 1 to 3");
  for (const char* frames : {"3:2", "1:2:0", "1-2", "1:", "x"})
    expect_refusal(std::string("--turntable 3 --frames ") + frames, 2, "FIRST:LAST");
  expect_refusal("--camera-path none.json", 1, "none.json");
  const auto path = [&](const std::string& text, const std::string& place, const std::string& reason) {
    folder_.write("p.json", text);
    expect_refusal("--camera-path p.json", 1, place);
    expect_refusal("--camera-path p.json", 1, reason);
  };
  const std::string first = R"({"frame": 1, "origin": [0, 0, 9], "target": [0, 0, 0]})";
  path("[" + first + ",\n{\"frame\": 2,, }]", "p.json:2", "not JSON");
  path("{}", "p.json", "list of key frames");
  path("[]", "p.json", "list of key frames");
  path("[7]", "key frame 1", "is no key frame");
  path(R"([{"frame": 1, "origin": [0, 0, 9]}])", "key frame 1", "no target");
  path("[" + first + "," + first + "]", "key frame 2", "does not come after frame 1");
  path(R"([{"frame": 1.5, "origin": [0, 0, 9], "target": [0, 0, 0]}])", "key frame 1", "whole number");
  path(R"([{"frame": 1, "origin": [0, 9], "target": [0, 0, 0]}])", "key frame 1", "three numbers");
  path(R"([{"frame": 1, "origin": [0, 0, 1e300], "target": [0, 0, 0]}])", "key frame 1", "three numbers");
  path(R"([{"frame": 1, "origin": [0, 0, 1e999], "target": [0, 0, 0]}])", "p.json", "too large");
  path(R"([{"frame": 1, "origin": [0, 0, 9], "target": [0, 0, 9]}])", "key frame 1", "have to differ");
  path(R"([{"frame": 1, "origin": [0, 9, 0], "target": [0, 0, 0]}])", "key frame 1", "up must not");
  path(R"([{"frame": 1, "origin": [0, 0, 9], "target": [0, 0, 0], "fov": 180}])", "key frame 1", "fov 180");
  path(R"([{"frame": 1, "origin": [0, 0, 9], "target": [0, 0, 0], "zoom": 2}])", "key frame 1", "'zoom'");
  path(R"([)" + first + R"(, {"frame": 200001, "origin": [0, 0, 9], "target": [0, 0, 0]}])", "p.json",
       "at most 100000 frames");
  EXPECT_FALSE(exists("x.exr") || exists("x.0001.exr"));
}

}  // namespace
}  // namespace nacre
