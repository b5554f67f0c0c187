// label: unit
// Numbers, colours, spectra and transforms as they are written in scene files.
#include "scene/values.h"

#include "scene/scene_text.h"
#include "scene/spectrum.h"

namespace nacre {
namespace {

XmlElement element(const std::string& tag, std::vector<std::pair<std::string, std::string>> attributes,
                   std::vector<XmlElement> children = {}) {
  return {tag, "test.xml", 1, std::move(attributes), std::move(children), ""};
}

Rgb color(const std::string& tag, const std::string& value) {
  return parse_color(element(tag, {{"name", "c"}, {"value", value}})).value();
}

Vec3d apply(std::vector<XmlElement> operations, const Vec3d& point) {
  return point * parse_transform(element("transform", {{"name", "toWorld"}}, std::move(operations)));
}

void expect_near(const Vec3d& a, const Vec3d& b, double tolerance = 1e-12) {
  EXPECT_LE((a - b).length(), tolerance) << a << " is not " << b;
}

TEST(Numbers, AreReadWholeAndInAnyLocale) {
  const XmlElement e = element("float", {});
  EXPECT_EQ(parse_number(" 1.5e-3\n", "x", e), 1.5e-3);
  EXPECT_EQ(parse_number("+2", "x", e), 2);
  EXPECT_EQ(parse_number("-.5", "x", e), -.5);
  for (const char* bad :
       {"", " ", "0.5abc", "1,5", "0x10", "inf", "nan", "-inf", "1e400", "1e39", "+-1", "--1"})
    EXPECT_THROW(parse_number(bad, "x", e), Error) << bad;
  EXPECT_EQ(parse_numbers("1, 2 ,3\t4\n5", "x", e).size(), 5u);
}

TEST(Colors, OneOrThreeNumbersWithCommasOrSpaces) {
  EXPECT_EQ(color("rgb", "0.1, 0.2,0.3"), Rgb(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(color("rgb", "0.1 0.2 0.3"), Rgb(0.1f, 0.2f, 0.3f));
  EXPECT_EQ(color("rgb", "0.7"), Rgb(0.7f));
  EXPECT_EQ(color("spectrum", "0.7"), Rgb(0.7f));
  EXPECT_EQ(color("float", "0.7"), Rgb(0.7f));
  EXPECT_EQ(color("rgb", "#ff8000"), Rgb(1, 128 / 255.0f, 0));
  EXPECT_THROW(color("rgb", "#ff80"), Error);
  EXPECT_THROW(color("rgb", "#ff80zz"), Error);
  EXPECT_THROW(color("rgb", "1 2"), Error);
  EXPECT_THROW(color("rgb", ""), Error);
}

// Values of IEC 61966-2-1: 0.5 encodes 0.21404114, 0.04045 is where the curve's two parts meet.
TEST(Colors, SrgbIsDecoded) {
  EXPECT_NEAR(color("srgb", "0.5").x, 0.21404114, 1e-7);
  const Rgb hex = color("srgb", "#ff8000");
  EXPECT_EQ(hex.x, 1);
  EXPECT_NEAR(hex.y, 0.21586050, 1e-6);
  EXPECT_EQ(hex.z, 0);
  EXPECT_NEAR(decode_srgb(0.04045), decode_srgb(0.040450001), 1e-7);
}

TEST(Spectra, AFlatSpectrumIsExactlyGrey) {
  EXPECT_EQ(color("spectrum", "400:0.3, 550:0.3 700:0.3"), Rgb(0.3f));
  EXPECT_EQ(color("spectrum", "500:0.3"), Rgb(0.3f));
}

// Gaussians fitted to the CIE 1931 functions. Source: Wyman et al. 2013, eq. 4.
Vec3d fitted_matching(double wavelength) {
  const auto lobe = [wavelength](double scale, double mean, double below, double above) {
    const double t = (wavelength - mean) / (wavelength < mean ? below : above);
    return scale * std::exp(-t * t / 2);
  };
  return {lobe(1.056, 599.8, 37.9, 31.0) + lobe(0.362, 442.0, 16.0, 26.7) + lobe(-0.065, 501.1, 20.4, 26.2),
          lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
          lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8)};
}

TEST(Spectra, BandsAgreeWithAnIndependentFitOfTheMatchingFunctions) {
  const auto rgb_of = [](const Vec3d& c) {
    return Vec3d(3.2405 * c.x - 1.5371 * c.y - 0.4985 * c.z, -0.9693 * c.x + 1.8760 * c.y + 0.0416 * c.z,
                 0.0556 * c.x - 0.2040 * c.y + 1.0572 * c.z);
  };
  for (double middle = 400; middle <= 720; middle += 20) {
    // A tent 60 nm wide on a floor that keeps every channel positive.
    const auto tent = [middle](double w) { return 1 + std::max(0.0, 1 - std::abs(w - middle) / 30); };
    Vec3d sum(0, 0, 0), white(0, 0, 0);
    for (double w = 380; w <= 780; w += 0.5) {
      sum += tent(w) * fitted_matching(w);
      white += fitted_matching(w);
    }
    const Vec3d expected = rgb_of(sum) / rgb_of(white);
    const Rgb rgb = spectrum_to_rgb({{middle - 30, 1.0}, {middle, 2.0}, {middle + 30, 1.0}});
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(rgb[k], expected[k], 0.012) << middle << " nm, channel " << k;
  }
}

TEST(Spectra, IntegrationIsLinearAndNarrowBandsAreSeen) {
  const Rgb a = spectrum_to_rgb({{500, 0.0}, {600, 1.0}, {700, 0.2}});
  const Rgb b = spectrum_to_rgb({{500, 0.0}, {600, 2.0}, {700, 0.4}});
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(b[k], 2 * a[k], 1e-6f);
  const Rgb line = spectrum_to_rgb({{559.99, 0.0}, {560, 1000.0}, {560.01, 0.0}});
  EXPECT_GT(line.y, 0);
  EXPECT_NEAR(line.y, spectrum_to_rgb({{559.5, 0.0}, {560, 20.0}, {560.5, 0.0}}).y, 1e-3);
}

TEST(Spectra, ColoursOutsideSrgbAreCutOffAtZero) {
  EXPECT_EQ(spectrum_to_rgb({{490, 0.0}, {500, 1.0}, {510, 0.0}}).x, 0);
}

TEST(Spectra, PairsHaveToBePairsWithIncreasingWavelengths) {
  EXPECT_THROW(color("spectrum", "400:1 500"), Error);
  EXPECT_THROW(color("spectrum", "400:1 400:2"), Error);
  EXPECT_THROW(color("spectrum", ":"), Error);
}

TEST(Transforms, ApplyInTheOrderOfTheFile) {
  const XmlElement move = element("translate", {{"x", "1"}}), grow = element("scale", {{"value", "2"}}),
                   turn = element("rotate", {{"z", "1"}, {"angle", "90"}});
  expect_near(apply({move, grow}, {1, 1, 1}), {4, 2, 2});
  expect_near(apply({grow, move}, {1, 1, 1}), {3, 2, 2});
  expect_near(apply({turn}, {1, 0, 0}), {0, 1, 0});
  expect_near(apply({move, turn}, {0, 0, 0}), {0, 1, 0});
}

TEST(Transforms, AcceptWhatMitsuba3Writes) {
  expect_near(apply({element("translate", {{"value", "1, 2, 3"}})}, {0, 0, 0}), {1, 2, 3});
  expect_near(apply({element("scale", {{"value", "1 2 3"}})}, {1, 1, 1}), {1, 2, 3});
  expect_near(apply({element("scale", {{"y", "3"}})}, {1, 1, 1}), {1, 3, 1});
  expect_near(apply({element("rotate", {{"value", "0 0 1"}, {"angle", "90"}})}, {1, 0, 0}), {0, 1, 0});
  EXPECT_THROW(apply({element("scale", {{"value", "1 2"}})}, Vec3d(0)), Error);
  EXPECT_THROW(apply({element("scale", {{"value", "1"}, {"x", "2"}})}, Vec3d(0)), Error);
  EXPECT_THROW(apply({element("scale", {})}, Vec3d(0)), Error);
}

TEST(Transforms, AMatrixIsWrittenInRowsForColumnVectors) {
  expect_near(apply({element("matrix", {{"value", "1 0 0 5  0 0 -1 6  0 1 0 7  0 0 0 1"}})}, {1, 2, 3}),
              {6, 3, 9});
}

TEST(Transforms, LookAtSpansMitsubasCameraSpace) {
  const XmlElement look = element("lookat", {{"origin", "0,0,5"}, {"target", "0,0,0"}, {"up", "0,1,0"}});
  expect_near(apply({look}, {0, 0, 0}), {0, 0, 5});
  expect_near(apply({look}, {0, 0, 1}), {0, 0, 4});  // looks along +z
  expect_near(apply({look}, {0, 1, 0}), {0, 1, 5});
  expect_near(apply({look}, {1, 0, 0}), {-1, 0, 5});  // +x is to the left of the picture
  EXPECT_FALSE(look_at({0, 0, 0}, {0, 0, 0}, {0, 1, 0}));
  EXPECT_FALSE(look_at({0, 0, 0}, {0, 1, 0}, {0, 1, 0}));
  EXPECT_FALSE(look_at({0, 0, 0}, {0, 0, 1}, {0, 0, 0}));
}

TEST(Iors, AreKnownByName) {
  EXPECT_EQ(find_ior("bk7"), 1.5046f);
  EXPECT_EQ(find_ior("Water Ice"), 1.31f);
  EXPECT_EQ(find_ior("diamond"), 2.419f);
  EXPECT_FALSE(find_ior("glass"));
}

}  // namespace
}  // namespace nacre
