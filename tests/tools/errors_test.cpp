// label: cli
// Everything that can be wrong: one line that names it, the right exit code, nothing left behind.
#include <gtest/gtest.h>
#include <unistd.h>

#include "tools/cli.h"

namespace nacre {
namespace {

using testing_support::kSmallScene;
using testing_support::read_file;
using testing_support::run_nacre;
using testing_support::TemporaryFolder;

class Errors : public testing::Test {
 protected:
  void SetUp() override { folder_.write("s.xml", kSmallScene); }

  // One line on the screen that holds `text`, the exit code, and no file more than before.
  void expect_refusal(const std::string& arguments, int code, const std::string& text) {
    const std::size_t before = folder_.count();
    const auto result = run_nacre(folder_, arguments + " --quiet");
    EXPECT_EQ(result.exit_code, code) << arguments << "\n" << result.output;
    EXPECT_EQ(result.lines(), 1) << result.output;
    EXPECT_EQ(result.output.rfind("nacre: error: ", 0), 0u) << result.output;
    EXPECT_NE(result.output.find(text), std::string::npos) << result.output;
    EXPECT_EQ(folder_.count(), before) << arguments;
  }
  void edit(const std::string& name, const std::string& from, const std::string& to) {
    std::string text = kSmallScene;
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos);
    folder_.write(name, text.replace(at, from.size(), to));
  }
  TemporaryFolder folder_;
};

TEST_F(Errors, MissingScene) { expect_refusal("render none.xml -o a.exr", 1, "none.xml"); }

TEST_F(Errors, MissingMesh) {
  edit("b.xml", "<shape type=\"sphere\" id=\"ball\">",
       "<shape type=\"obj\"><string name=\"filename\" value=\"none.obj\"/>");
  expect_refusal("render b.xml -o a.exr", 1, "none.obj");
}

TEST_F(Errors, UnknownElement) {
  edit("b.xml", "<integrator type=\"direct\">", "<gizmo/><integrator type=\"direct\">");
  expect_refusal("render b.xml -o a.exr", 1, "b.xml:4");
}

TEST_F(Errors, WrongType) {
  edit("b.xml", "<float name=\"fov\" value=\"35\"/>", "<float name=\"fov\" value=\"wide\"/>");
  expect_refusal("render b.xml -o a.exr", 1, "b.xml:6");
}

TEST_F(Errors, NegativeCoefficient) { expect_refusal("render s.xml -o a.exr -D sigma_a=-1", 1, "s.xml:20"); }

TEST_F(Errors, EmptyMesh) {
  folder_.write("empty.obj", "# nothing\n");
  expect_refusal("render empty.obj -o a.exr", 1, "empty.obj");
}

TEST_F(Errors, TruncatedCache) {
  ASSERT_EQ(run_nacre(folder_, "bake s.xml -o c.nacre --quiet").exit_code, 0);
  const std::string whole = read_file(folder_.file("c.nacre"));
  folder_.write("cut.nacre", whole.substr(0, whole.size() / 2));
  expect_refusal("render s.xml --cache cut.nacre -o a.exr", 1,
                 "cut.nacre: byte " + std::to_string(whole.size() / 2));
  std::string damaged = whole;
  damaged[whole.size() / 2] = static_cast<char>(damaged[whole.size() / 2] ^ 1);
  folder_.write("bad.nacre", damaged);
  expect_refusal("render s.xml --cache bad.nacre -o a.exr", 1, "damaged");
  expect_refusal("render s.xml --cache s.xml -o a.exr", 1, "not a nacre cache");
}

TEST_F(Errors, UnwritableOutput) {
  expect_refusal("render s.xml -o no/such/folder/a.exr", 1, "no/such/folder/a.exr");
  expect_refusal("bake s.xml -o no/such/folder/c.nacre", 1, "no/such/folder/c.nacre");
  expect_refusal("bake s.xml -o .", 1, "cannot write");
}

// What a scene names is as dear as the scene.
TEST_F(Errors, NothingReplacesWhatTheSceneIsMadeOf) {
  folder_.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  folder_.write("part.xml", "<scene version=\"0.6.0\"/>");
  edit("b.xml", "<shape type=\"sphere\" id=\"ball\">",
       "<include filename=\"part.xml\"/>"
       "<shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/></shape>"
       "<shape type=\"sphere\" id=\"ball\">");
  expect_refusal("bake b.xml -o ./m.obj", 2, "m.obj is what this command reads");
  expect_refusal("render b.xml -o part.xml", 2, "part.xml is what this command reads");
  expect_refusal("render b.xml -o a.exr --exitance m.obj", 1, "m.obj");
  EXPECT_EQ(run_nacre(folder_, "render b.xml -o a.exr --quiet").exit_code, 0);
}

TEST_F(Errors, ReportsReplaceReportsOnly) {
  expect_refusal("info s.xml --report s.xml", 1, "s.xml: is there and is no report");
  folder_.write("r.json", "{}");
  EXPECT_EQ(run_nacre(folder_, "info s.xml --report r.json").exit_code, 0);
}

TEST_F(Errors, AbsurdScale) {
  edit("b.xml", "<float name=\"scale\" value=\"1\"/>", "<float name=\"scale\" value=\"10000\"/>");
  expect_refusal("bake b.xml -o c.nacre", 1, "scale");
}

TEST_F(Errors, Usage) {
  expect_refusal("render s.xml", 2, "--output");
  expect_refusal("bake s.xml -o ./s.xml", 2, "reads");
  expect_refusal("render s.xml -o a.png --png", 2, "a.png");
  expect_refusal("render s.xml -o a.exr --size big", 2, "--size big");
  expect_refusal("render s.xml -o a.exr --crop 60,40,20x20", 2, "outside");
  expect_refusal("render s.xml -o a.exr --crop nonsense", 2, "--crop nonsense");
  expect_refusal("render s.xml -o a.exr --aov depth,deepness", 2, "deepness");
  expect_refusal("render s.xml -o a.exr --method magic", 2, "magic");
  expect_refusal("render s.xml -o a.exr --exposure bright", 2, "bright");
  expect_refusal("render s.xml -o a.exr --tolerance -1", 2, "tolerance");
  expect_refusal("bake s.xml -o c.nacre --points 10 --spacing 1", 2, "excludes");
  expect_refusal("bake s.xml -o c.nacre --points -5", 2, "points");
  expect_refusal("render s.xml -o a.exr -D sigma_a", 2, "name=value");
  expect_refusal("render s.xml -o a.exr --frobnicate", 2, "frobnicate");
  for (const char* seed : {"-1", "''", "1.5", "18446744073709551616", "0x10"})
    expect_refusal("bake s.xml -o c.nacre --seed " + std::string(seed), 2, "--seed");
  expect_refusal("render s.xml -o a.exr --camera ''", 2, "--camera");
  expect_refusal("render s.xml -o a.exr --height 0", 2, "--height goes with a mesh file");
}

// What stands where an interrupted bake would be kept is not replaced unless it is one.
TEST_F(Errors, AnotherFileInThePlaceOfAnInterruptedBake) {
  folder_.write("c.nacre.part", "my own notes");
  expect_refusal("bake s.xml -o c.nacre --points 500", 1,
                 "c.nacre.part: is not what an interrupted bake leaves");
  EXPECT_EQ(read_file(folder_.file("c.nacre.part")), "my own notes");
}

}  // namespace
}  // namespace nacre
