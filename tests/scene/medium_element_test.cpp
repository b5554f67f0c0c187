// label: unit
// <subsurface>: coefficients, presets, indices of refraction.
#include "nacre/base/error.h"
#include "nacre/optics/profile.h"
#include "scene/scene_text.h"

namespace nacre {
namespace {

void expect_color(const Rgb& a, const Rgb& b) {
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(a[k], b[k], 1e-6f * (1 + std::abs(b[k]))) << k;
}

constexpr const char* kManual =
    R"(<rgb name="sigmaS" value="1 2 3"/><rgb name="sigmaA" value="0.1 0.2 0.3"/>)";

TEST(SubsurfaceElement, DefaultsToSkin1WithItsEta) {
  const Medium medium = medium_of("");
  EXPECT_EQ(medium.material, "Skin1");
  expect_color(medium.sigma_s, {0.74f, 0.88f, 1.01f});
  expect_color(medium.sigma_a, {0.032f, 0.17f, 0.48f});
  EXPECT_FLOAT_EQ(medium.eta(), 1.3f);
  EXPECT_EQ(medium.scale, 1);
  EXPECT_EQ(medium.profile, ProfileKind::kDipole);
  EXPECT_EQ(medium.convention, Convention::kPublished);
}

TEST(SubsurfaceElement, EveryPresetIsFoundUnderItsName) {
  for (const Preset& preset : presets()) {
    std::string name(preset.name);
    if (const auto at = name.find('&'); at != std::string::npos) name.replace(at, 1, "&amp;");
    const Medium medium = medium_of("<string name=\"material\" value=\"" + name + "\"/>");
    EXPECT_EQ(medium.material, preset.name);
    expect_color(reduce(medium).sigma_s_prime, preset.sigma_s_prime);
    EXPECT_FLOAT_EQ(medium.eta(), preset.eta);
  }
}

TEST(SubsurfaceElement, CoefficientsInBothWays) {
  const Medium manual = medium_of(kManual);
  EXPECT_EQ(manual.material, "");
  expect_color(manual.sigma_s, {1, 2, 3});
  expect_color(manual.sigma_a, {0.1f, 0.2f, 0.3f});
  EXPECT_EQ(manual.int_ior, 1.5046f);
  EXPECT_EQ(manual.ext_ior, 1.000277f);
  const Medium total =
      medium_of(R"(<rgb name="sigmaT" value="1 2 4"/><spectrum name="albedo" value="0.75"/>)");
  expect_color(total.sigma_s, {0.75f, 1.5f, 3});
  expect_color(total.sigma_a, {0.25f, 0.5f, 1});
}

TEST(SubsurfaceElement, SnakeCaseIsTheSame) {
  const Medium medium = medium_of(
      R"(<rgb name="sigma_s" value="1"/><rgb name="sigma_a" value="2"/><float name="int_ior" value="1.4"/>
         <string name="ext_ior" value="water"/>)");
  expect_color(medium.sigma_a, {2, 2, 2});
  EXPECT_EQ(medium.int_ior, 1.4f);
  EXPECT_EQ(medium.ext_ior, 1.333f);
}

TEST(SubsurfaceElement, IfOneIorIsGivenTheOtherIsGlassInsideAndAirOutside) {
  const Medium inside =
      medium_of(R"(<string name="material" value="Marble"/><float name="intIOR" value="1.4"/>)");
  EXPECT_EQ(inside.int_ior, 1.4f);
  EXPECT_EQ(inside.ext_ior, 1.000277f);
  const Medium outside =
      medium_of(R"(<string name="material" value="Marble"/><float name="extIOR" value="1.2"/>)");
  EXPECT_EQ(outside.int_ior, 1.5046f);
  EXPECT_EQ(outside.ext_ior, 1.2f);
  EXPECT_EQ(medium_of(R"(<float name="intIOR" value="1"/><float name="extIOR" value="1.5"/>)").eta(),
            1 / 1.5f);
}

TEST(SubsurfaceElement, GIsANumberOrATripleAndLeavesPresetsTheirReducedScattering) {
  const Medium number = medium_of(std::string(kManual) + R"(<float name="g" value="0.5"/>)");
  expect_color(number.sigma_s, {1, 2, 3});
  expect_color(number.g, {0.5f, 0.5f, 0.5f});
  const Medium marble =
      medium_of(R"(<string name="material" value="Marble"/><rgb name="g" value="0.1 -0.2 0.9"/>)");
  expect_color(marble.g, {0.1f, -0.2f, 0.9f});
  expect_color(reduce(marble).sigma_s_prime, {2.19f, 2.62f, 3.0f});
}

TEST(SubsurfaceElement, ScaleProfileConventionAndSettings) {
  const Scene scene = scene_of(R"(<shape type="rectangle"><subsurface type="dipole" id="m">
      <float name="scale" value="25.4"/><string name="profile" value="betterDipole"/>
      <string name="convention" value="conserving"/><integer name="irrSamples" value="7"/>
      <boolean name="irrIndirect" value="false"/><float name="sampleMultiplier" value="2"/>
      </subsurface></shape>)");
  EXPECT_EQ(scene.media[0].scale, 25.4f);
  EXPECT_EQ(scene.media[0].profile, ProfileKind::kBetterDipole);
  EXPECT_EQ(scene.media[0].convention, Convention::kConserving);
  EXPECT_EQ(scene.subsurface[0].irradiance_samples, 7);
  EXPECT_FALSE(scene.subsurface[0].indirect);
  EXPECT_EQ(scene.subsurface[0].sample_multiplier, 2);
  EXPECT_EQ(medium_name(scene, 0), "m");
}

TEST(SubsurfaceElement, APresetWithoutScaleAndQualityAreNoted) {
  const auto warnings = [](const std::string& parameters, const std::string& text) {
    return count_warnings(scene_of("<shape type=\"rectangle\"><subsurface type=\"dipole\">" + parameters +
                                   "</subsurface></shape>"),
                          text);
  };
  EXPECT_EQ(warnings("", "in 1/mm"), 1);
  EXPECT_EQ(warnings(R"(<float name="scale" value="1"/>)", "in 1/mm"), 0);
  EXPECT_EQ(warnings(kManual, "in 1/mm"), 0);
  EXPECT_EQ(warnings(R"(<float name="quality" value="0.2"/>)", "quality has no effect"), 1);
}

TEST(SubsurfaceElement, CoefficientsFromReflectanceAndMeanFreePath) {
  for (const std::string profile : {"dipole", "betterdipole", "normalized"})
    for (const std::string g : {"0", "0.8"}) {
      const Medium medium = medium_of(
          R"(<rgb name="diffuseReflectance" value="0.9 0.5 0.05"/><rgb name="meanFreePath" value="2 1 0.5"/>
             <float name="scale" value="10"/><float name="intIOR" value="1.4"/><float name="g" value=")" +
          g + R"("/><string name="profile" value=")" + profile + "\"/>");
      const auto profiles = make_profiles(medium);
      EXPECT_NEAR(profiles[0].total, 0.9, 1e-5) << profile;
      EXPECT_NEAR(profiles[1].total, 0.5, 1e-5) << profile;
      EXPECT_NEAR(profiles[2].total, 0.05, 1e-5) << profile;
      expect_color(reduce(medium).mean_free_path, {2, 1, 0.5f});  // mm, whatever the scale
    }
}

TEST(SubsurfaceElement, ReflectanceErrors) {
  const auto message = [](const std::string& parameters) -> std::string {
    try {
      medium_of(parameters);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const std::string path = R"(<float name="meanFreePath" value="1"/>)";
  const std::string grey = R"(<rgb name="diffuseReflectance" value="0.5"/>)";
  for (const char* value : {"0.5 1.01 0.5", "0.5 0.5 -0.1"}) {
    const std::string text =
        message(R"(<rgb name="diffuseReflectance" value=")" + std::string(value) + "\"/>" + path);
    EXPECT_NE(text.find("scene.xml:2: "), std::string::npos) << text;
    EXPECT_NE(text.find("give values from 0 to 1"), std::string::npos) << text;
  }
  EXPECT_NE(message(grey).find("meanFreePath is missing"), std::string::npos);
  EXPECT_NE(message(path).find("diffuseReflectance is missing"), std::string::npos);
  EXPECT_NE(message(grey + R"(<float name="meanFreePath" value="0"/>)").find("meanFreePath"),
            std::string::npos);
  EXPECT_NE(message(grey + path + R"(<string name="material" value="Marble"/>)")
                .find("here are material, diffuseReflectance, meanFreePath"),
            std::string::npos);
  EXPECT_NE(message(grey + path + kManual).find("here are sigmaS, sigmaA, diffuseReflectance"),
            std::string::npos);
}

}  // namespace
}  // namespace nacre
