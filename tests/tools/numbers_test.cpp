// label: cli
// Numbers at and beyond the end of what makes sense: a finite picture, or one line that names the culprit.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tools/cli.h"

namespace nacre::testing_support {
namespace {

class Numbers : public testing::Test {
 protected:
  // The small scene, bigger or smaller, with one thing changed.
  static std::string edited(const std::string& from, const std::string& to) {
    std::string text = kSmallScene;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
  }
  ProgramResult render(const std::string& scene, const std::string& quality = "--points 200 --spp 1") const {
    folder_.write("s.xml", scene);
    std::filesystem::remove(folder_.file("a.exr"));
    return run_nacre(folder_, "render s.xml -o a.exr --irradiance-samples 1 --size 24x18 --quiet " + quality);
  }
  void expect_picture(const std::string& scene, const std::string& what) const {
    const ProgramResult result = render(scene);
    EXPECT_EQ(result.exit_code, 0) << what << "\n" << result.output;
    const ProgramResult info = run_nacre(folder_, "info --check a.exr");
    EXPECT_EQ(info.exit_code, 0) << what << "\n" << info.output;
  }
  void expect_error(const std::string& scene, const std::string& text, const std::string& what) const {
    const ProgramResult result = render(scene);
    EXPECT_EQ(result.exit_code, 1) << what << "\n" << result.output;
    EXPECT_NE(result.output.find("nacre: error: s.xml:"), std::string::npos) << what << "\n" << result.output;
    EXPECT_NE(result.output.find(text), std::string::npos) << what << "\n" << result.output;
    EXPECT_EQ(result.lines(), 1) << what << "\n" << result.output;
    EXPECT_FALSE(std::filesystem::exists(folder_.file("a.exr")));
  }
  TemporaryFolder folder_;
};

struct Place {
  const char *name, *from, *before, *after;
};

const std::vector<Place> kPlaces{
    {"sigmaS", "value=\"3, 2.5, 2\"", "value=\"", "\""},
    {"sigmaA", "value=\"$sigma_a, 0.02, 0.03\"", "value=\"", "\""},
    {"scale", "<float name=\"scale\" value=\"1\"/>", "<float name=\"scale\" value=\"", "\"/>"},
    {"intensity", "value=\"2000, 2000, 1800\"", "value=\"", "\""},
    {"radiance", "value=\"8, 8, 9\"", "value=\"", "\""},
    {"reflectance", "value=\"0.4, 0.4, 0.4\"", "value=\"", "\""},
    {"fov", "name=\"fov\" value=\"35\"", "name=\"fov\" value=\"", "\""},
    {"radius", "name=\"radius\" value=\"5\"", "name=\"radius\" value=\"", "\""},
};

TEST_F(Numbers, WhatIsNoNumberIsRefusedByName) {
  for (const Place& place : kPlaces)
    for (const char* const value : {"nan", "-inf", "1e39", "-1", "1e38"})
      expect_error(
          edited(place.from, std::string(place.before) + value + place.after),
          place.name == std::string("radius") && std::string(value) == "1e38" ? "reaches out" : place.name,
          std::string(place.name) + " " + value);
}

TEST_F(Numbers, TinyOnesMakePictures) {
  for (const Place& place : kPlaces)
    for (const char* const value : {"1e-30", "1e-45"})
      if (place.name != std::string("radius"))  // 1e-30: no area
        expect_picture(edited(place.from, std::string(place.before) + value + place.after),
                       std::string(place.name) + " " + value);
  for (const char* const name : {"sigmaS", "sigmaA", "intensity", "radiance", "reflectance"})
    for (const Place& place : kPlaces)
      if (place.name == std::string(name))
        expect_picture(edited(place.from, std::string(place.before) + "0" + place.after),
                       std::string(name) + " 0");
}

TEST_F(Numbers, LightsAndCamerasInOddPlaces) {
  const std::string spark = "x=\"$light_x\" y=\"30\" z=\"10\"", eye = "origin=\"0, 12, 40\"";
  expect_picture(edited(spark, "x=\"0\" y=\"10\" z=\"0\""), "a light on the surface");
  expect_picture(edited(spark, "x=\"0\" y=\"5\" z=\"0\""), "a light inside");
  expect_picture(edited(spark, "x=\"0\" y=\"0\" z=\"0\""), "a light where two surfaces meet");
  expect_picture(edited(eye, "origin=\"0.1, 5, 0\""), "a camera inside");
  expect_picture(edited(eye, "origin=\"0, 10, 0.01\""), "a camera on the surface");
  expect_picture(edited(eye, "origin=\"20, 30, 10\""), "a camera where a light is");
  expect_picture(edited("origin=\"-15, 25, -15\"", "origin=\"0, 10, 0.01\""), "an area light that touches");
  std::string dark = edited("value=\"2000, 2000, 1800\"", "value=\"0\"");
  dark.replace(dark.find("value=\"8, 8, 9\""), 15, "value=\"0\"");
  expect_picture(dark, "black lights");
}

TEST_F(Numbers, TrianglesWithoutArea) {
  folder_.write("m.obj",
                "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0.5 0 0\n"
                "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\nf 1 5 2\nf 1 1 2\nf 3 3 3\n");
  expect_picture(
      edited("<shape type=\"sphere\" id=\"ball\">\n    <point name=\"center\" x=\"0\" y=\"5\" z=\"0\"/>\n"
             "    <float name=\"radius\" value=\"5\"/>",
             "<shape type=\"obj\" id=\"ball\"><string name=\"filename\" value=\"m.obj\"/>"
             "<transform name=\"toWorld\"><scale value=\"5\"/></transform>"),
      "degenerate");
}

// The whole scene in other units is the same picture.
TEST_F(Numbers, SmallAndLargeUnits) {
  const auto scene = [](double unit) {
    const auto n = [&](double x) { return std::to_string(x * unit * 1e6) + "e-6"; };
    return "<scene version=\"0.6.0\"><sensor type=\"perspective\"><float name=\"fov\" value=\"35\"/><float "
           "name=\"nearClip\" value=\"" +
           n(0.1) + "\"/><float name=\"farClip\" value=\"" + n(1000) +
           "\"/><transform name=\"toWorld\"><lookat origin=\"0, " + n(12) + ", " + n(40) + "\" target=\"0, " +
           n(5) +
           ", 0\" up=\"0, 1, 0\"/></transform></sensor><shape type=\"sphere\"><point name=\"center\" x=\"0\" "
           "y=\"" +
           n(5) + "\" z=\"0\"/><float name=\"radius\" value=\"" + n(5) +
           "\"/><subsurface type=\"dipole\"><string name=\"material\" value=\"Marble\"/><float "
           "name=\"scale\" value=\"" +
           std::to_string(2 / unit) +
           "\"/></subsurface></shape><shape type=\"rectangle\"><transform name=\"toWorld\"><scale value=\"" +
           n(60) +
           "\"/><rotate x=\"1\" angle=\"-90\"/></transform></shape><emitter type=\"directional\"><vector "
           "name=\"direction\" x=\"-1\" y=\"-2\" z=\"-1\"/></emitter></scene>";
  };
  // Coordinates of powers of ten differ in their last bits, and so do random samples: means have to agree.
  const auto mean = [&](double unit) {
    EXPECT_EQ(render(scene(unit), "--points 4000 --spp 16").exit_code, 0) << unit;
    const std::string text = run_nacre(folder_, "info a.exr").output;
    const std::size_t at = text.find("mean", text.find("diffusion.R"));
    return std::stod(text.substr(at + 5));
  };
  const double wanted = mean(1);
  EXPECT_GT(wanted, 0.01);
  for (const double unit : {1e-6, 1e-3, 1e3, 1e6}) EXPECT_NEAR(mean(unit), wanted, 0.01 * wanted) << unit;
}

}  // namespace
}  // namespace nacre::testing_support
