// label: unit
// Image files as others rely on them: every bit comes back, and nothing broken is written or believed.
#include "nacre/render/image_file.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "nacre/base/file.h"
#include "nacre/base/parallel.h"
#include "nacre/base/random.h"

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#include <stb/stb_image.h>

namespace nacre {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

class ImageFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "nacre_image_XXXXXX";
    ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path(name), std::ios::binary) << bytes;
  }
  std::size_t count_files() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder_), std::filesystem::directory_iterator()));
  }

  std::filesystem::path folder_;
};

Image make_image(int width, int height, const std::vector<std::string>& names) {
  Image image{width, height, 0, 0, width, height, {}, {}};
  Rng rng(7);
  for (const std::string& name : names) {
    Channel channel{name, {}};
    for (int i = 0; i < width * height; ++i) channel.values.push_back(rng.next_float());
    image.channels.push_back(channel);
  }
  return image;
}

// The error that `action` throws; fails the test if there is none.
template <class Action>
Error error_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no Error was thrown";
  return Error(ErrorCode::kIo, "", "");
}

std::map<std::string, std::string> without_seal(const Image& image) {
  std::map<std::string, std::string> metadata = image.metadata;
  EXPECT_EQ(metadata.erase(kDigestKey), 1u);
  return metadata;
}

void expect_same_bits(const Image& a, const Image& b) {
  ASSERT_EQ(a.channels.size(), b.channels.size());
  for (const Channel& channel : a.channels) {
    const Channel* other = find_channel(b, channel.name);
    ASSERT_NE(other, nullptr) << channel.name;
    ASSERT_EQ(channel.values.size(), other->values.size());
    EXPECT_EQ(0, std::memcmp(channel.values.data(), other->values.data(), channel.values.size() * 4))
        << channel.name;
  }
}

TEST_F(ImageFile, RoundTripKeepsEveryBit) {
  Image image = make_image(67, 45, {"R", "G", "B", "A", "diffusion.R", "depth.Z"});
  image.channels[0].values = std::vector<float>(67 * 45, -0.0f);
  image.channels[1].values[3] = std::numeric_limits<float>::denorm_min();
  image.channels[2].values[4] = std::numeric_limits<float>::max();
  image.metadata = {{"nacre:seed", "42"}, {"nacre:command", "render a.xml -o b.exr"}, {"empty", ""}};
  save_exr(image, path("a.exr"));
  const Image back = load_exr(path("a.exr"));
  expect_same_bits(image, back);
  EXPECT_EQ(without_seal(back), image.metadata);
  EXPECT_EQ(count_files(), 1u);
}

TEST_F(ImageFile, RoundTripKeepsTheCropAndItsPlaceInTheFrame) {
  Image image = make_image(11, 7, {"R", "G", "B"});
  image.full_width = 100;
  image.full_height = 80;
  image.x = 40;
  image.y = 73;
  save_exr(image, path("crop.exr"));
  const Image back = load_exr(path("crop.exr"));
  EXPECT_EQ(back.full_width, 100);
  EXPECT_EQ(back.full_height, 80);
  EXPECT_EQ(back.x, 40);
  EXPECT_EQ(back.y, 73);
  EXPECT_EQ(back.width, 11);
  EXPECT_EQ(back.height, 7);
  expect_same_bits(image, back);
}

TEST_F(ImageFile, RoundTripOfMoreRowsThanAreDecodedAtOnce) {
  const Image image = make_image(512, 1100, {"a.R", "a.G", "a.B", "b.R", "b.G", "b.B", "c.R", "c.G"});
  save_exr(image, path("large.exr"));
  expect_same_bits(image, load_exr(path("large.exr")));
}

TEST_F(ImageFile, NumberOfThreadsDoesNotChangeTheFile) {
  const Image image = make_image(200, 100, {"R", "G", "B"});
  save_exr(image, path("all.exr"));
  const ThreadLimit one(1);
  save_exr(image, path("one.exr"));
  EXPECT_EQ(read_text_file(path("all.exr")), read_text_file(path("one.exr")));
}

TEST_F(ImageFile, OverwritesAnOlderFile) {
  write("a.exr", "older");
  const Image image = make_image(4, 4, {"R"});
  save_exr(image, path("a.exr"));
  expect_same_bits(image, load_exr(path("a.exr")));
  EXPECT_EQ(count_files(), 1u);
}

TEST_F(ImageFile, RefusesValuesThatAreNoNumbers) {
  Image image = make_image(10, 8, {"R", "diffusion.G", "B"});
  image.full_width = 20;
  image.x = 5;
  image.channels[1].values[3 * 10 + 2] = kNan;
  image.channels[1].values[7 * 10 + 2] = kInf;
  image.channels[2].values[0] = -kInf;
  for (const bool png : {false, true}) {
    const Error error = error_of([&] { png ? save_png(image, path("a"), 0) : save_exr(image, path("a")); });
    EXPECT_EQ(error.code(), ErrorCode::kValue);
    EXPECT_EQ(error.place(), path("a"));
    EXPECT_NE(error.reason().find("3 of the image's values"), std::string::npos) << error.what();
    EXPECT_NE(error.reason().find("channel diffusion.G at pixel (7, 3)"), std::string::npos) << error.what();
  }
  EXPECT_EQ(count_files(), 0u);
}

TEST_F(ImageFile, RefusesMalformedImages) {
  const Image good = make_image(4, 3, {"R", "G", "B"});
  const auto code_of = [&](const auto& change) {
    Image image = good;
    change(image);
    return error_of([&] { save_exr(image, path("a.exr")); }).code();
  };
  EXPECT_EQ(code_of([](Image& i) { i.width = 0; }), ErrorCode::kValue);
  EXPECT_EQ(code_of([](Image& i) { i.full_height = -1; }), ErrorCode::kValue);
  EXPECT_EQ(code_of([](Image& i) { i.channels.clear(); }), ErrorCode::kValue);
  EXPECT_EQ(code_of([](Image& i) { i.channels[1].values.pop_back(); }), ErrorCode::kValue);
  EXPECT_EQ(code_of([](Image& i) { i.channels[1].name = "R"; }), ErrorCode::kValue);
  EXPECT_EQ(code_of([](Image& i) { i.channels[1].name = ""; }), ErrorCode::kValue);
  EXPECT_EQ(code_of([](Image& i) { i.metadata["dataWindow"] = "1"; }), ErrorCode::kValue);
  EXPECT_EQ(code_of([](Image& i) { i.metadata["type"] = "deepscanline"; }), ErrorCode::kValue);
  EXPECT_EQ(code_of([](Image& i) { i.width = i.height = 1 << 20; }), ErrorCode::kLimit);
  EXPECT_EQ(count_files(), 0u);
}

TEST_F(ImageFile, UnwritablePlaceIsAnError) {
  const Image image = make_image(4, 4, {"R", "G", "B"});
  for (const std::string& place : {path("missing/a.exr"), folder_.string(), std::string("/proc/a.exr")}) {
    EXPECT_EQ(error_of([&] { save_exr(image, place); }).code(), ErrorCode::kIo) << place;
    EXPECT_EQ(error_of([&] { save_png(image, place, 0); }).code(), ErrorCode::kIo) << place;
  }
  EXPECT_EQ(count_files(), 0u);
}

// Fails writes in the middle of a file, as a full disk does.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    ::signal(SIGXFSZ, handler_);
  }

 private:
  rlimit before_{};
  void (*handler_)(int);
};

TEST_F(ImageFile, FullDiskIsAnErrorAndLeavesNothing) {
  const Image image = make_image(256, 256, {"R", "G", "B"});
  for (const rlim_t bytes : {rlim_t{100}, rlim_t{20000}}) {
    const FileSizeLimit limit(bytes);
    const Error exr = error_of([&] { save_exr(image, path("a.exr")); });
    EXPECT_EQ(exr.code(), ErrorCode::kIo);
    EXPECT_EQ(exr.place(), path("a.exr"));
    EXPECT_EQ(error_of([&] { save_png(image, path("a.png"), 0); }).code(), ErrorCode::kIo);
  }
  EXPECT_EQ(count_files(), 0u);
}

TEST_F(ImageFile, MissingAndForeignFilesAreTold) {
  EXPECT_EQ(error_of([&] { load_exr(path("none.exr")); }).code(), ErrorCode::kNotFound);
  EXPECT_EQ(error_of([&] { load_exr(folder_.string()); }).code(), ErrorCode::kIo);
  for (const std::string& bytes : {std::string(), std::string("v/1"), std::string("solid cube\nfacet normal"),
                                   std::string(100000, '\0'), std::string("\x76\x2f\x31\x01\x02\0\0\0", 8)}) {
    write("garbage.exr", bytes);
    EXPECT_EQ(error_of([&] { load_exr(path("garbage.exr")); }).code(), ErrorCode::kSyntax);
  }
  write("multi.exr", std::string("\x76\x2f\x31\x01\x02\x10\0\0", 8));
  EXPECT_EQ(error_of([&] { load_exr(path("multi.exr")); }).code(), ErrorCode::kUnsupported);
}

TEST_F(ImageFile, EveryTruncationIsAnError) {
  save_exr(make_image(40, 50, {"R", "G", "B"}), path("a.exr"));
  const std::string whole = read_text_file(path("a.exr"));
  for (std::size_t length = 0; length < whole.size(); length += length < 500 ? 3 : 97) {
    write("cut.exr", whole.substr(0, length));
    const Error error = error_of([&] { load_exr(path("cut.exr")); });
    EXPECT_EQ(error.code(), ErrorCode::kSyntax) << length;
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

// Each byte of the header and of the table behind it, changed: an Error, or an image that is consistent, and
// the one that was written if it says so.
TEST_F(ImageFile, DamagedHeadersNeverCrash) {
  Image image = make_image(40, 50, {"R", "G", "B"});
  image.metadata["nacre:seed"] = "1";
  save_exr(image, path("a.exr"));
  const std::string whole = read_text_file(path("a.exr"));
  int refused = 0;
  for (std::size_t at = 0; at < 600; ++at)
    for (const int value : {0x00, 0x7f, 0xff}) {
      std::string bytes = whole;
      bytes[at] = static_cast<char>(value);
      write("damaged.exr", bytes);
      try {
        const Image back = load_exr(path("damaged.exr"));
        for (const Channel& channel : back.channels)
          ASSERT_EQ(channel.values.size(),
                    static_cast<std::size_t>(back.width) * static_cast<std::size_t>(back.height));
        if (check_seal(back) != Seal::kSound) continue;
        expect_same_bits(image, back);
        EXPECT_EQ(without_seal(back), image.metadata);
      } catch (const Error&) {
        ++refused;
      }
    }
  EXPECT_GT(refused, 200);
}

// OpenEXR pads a chunk that unpacks to less than it should.
TEST_F(ImageFile, SealsTellWhatWasChanged) {
  Image image = make_image(40, 50, {"R", "G", "B"});
  image.metadata["nacre:seed"] = "1";
  EXPECT_EQ(check_seal(image), Seal::kAbsent);
  save_exr(image, path("a.exr"));
  const Image back = load_exr(path("a.exr"));
  EXPECT_EQ(check_seal(back), Seal::kSound);
  const auto expect_broken = [&](const auto& change) {
    Image other = back;
    change(other);
    EXPECT_EQ(check_seal(other), Seal::kBroken);
  };
  expect_broken([](Image& i) { i.channels[2].values[1999] += 1e-6f; });
  expect_broken([](Image& i) { i.channels[0].name = "Y"; });
  expect_broken([](Image& i) { std::swap(i.channels[0].values, i.channels[1].values); });
  expect_broken([](Image& i) { i.channels.pop_back(); });
  expect_broken([](Image& i) { std::swap(i.width, i.height); });
  expect_broken([](Image& i) { i.x = 1; });
  expect_broken([](Image& i) { i.metadata["nacre:seed"] = "2"; });
  // Saved again it has a new one.
  image = back;
  image.channels[0].values[0] = 7;
  save_exr(image, path("b.exr"));
  EXPECT_EQ(check_seal(load_exr(path("b.exr"))), Seal::kSound);
}

TEST_F(ImageFile, PromisedSizesAreNotBelieved) {
  save_exr(make_image(16, 16, {"R"}), path("a.exr"));
  std::string bytes = read_text_file(path("a.exr"));
  const std::size_t window = bytes.find(std::string("dataWindow\0box2i\0", 17)) + 17 + 4;
  const auto refused_with = [&](int right, int bottom) {
    const int corner[2]{right, bottom};
    std::memcpy(&bytes[window + 8], corner, sizeof corner);
    write("large.exr", bytes);
    return error_of([&] { load_exr(path("large.exr")); }).code();
  };
  EXPECT_EQ(refused_with(1 << 14, 1 << 15), ErrorCode::kLimit);
  EXPECT_EQ(refused_with(1 << 28, 0), ErrorCode::kLimit);
  EXPECT_EQ(refused_with(0, (1 << 28) - 1), ErrorCode::kSyntax);
  EXPECT_EQ(refused_with((1 << 14) - 1, (1 << 14) - 1), ErrorCode::kSyntax);
  EXPECT_EQ(refused_with(-1, 10), ErrorCode::kSyntax);
  EXPECT_EQ(refused_with(std::numeric_limits<int>::max(), std::numeric_limits<int>::min()),
            ErrorCode::kSyntax);
}

TEST_F(ImageFile, PngHoldsTheSrgbBytes) {
  Image image = make_image(7, 1, {"G", "B", "R", "A"});
  // Linear values, twice as dark as the bytes they become at an exposure of 1.
  const std::vector<float> r{0.0f, 0.5f, 0.107f, 5.0f, -1.0f, 0.0015f, 0.0022f};
  image.channels[2].values = r;
  image.channels[0].values = std::vector<float>(7, 0.0f);
  image.channels[1].values = std::vector<float>(7, 0.25f);
  save_png(image, path("a.png"), 1);
  int width = 0, height = 0, channels = 0;
  unsigned char* bytes = stbi_load(path("a.png").c_str(), &width, &height, &channels, 0);
  ASSERT_NE(bytes, nullptr);
  EXPECT_EQ(width, 7);
  EXPECT_EQ(height, 1);
  ASSERT_EQ(channels, 3);
  // 0.214 is 127 of 255; 0.003 lies on the linear part, 0.0044 on the power; 0.5 is 188.
  const int expected[7]{0, 255, 127, 255, 0, 10, 14};
  for (int i = 0; i < 7; ++i) {
    EXPECT_EQ(bytes[3 * i], expected[i]) << i;
    EXPECT_EQ(bytes[3 * i + 1], 0) << i;
    EXPECT_EQ(bytes[3 * i + 2], 188) << i;
  }
  stbi_image_free(bytes);
  EXPECT_EQ(count_files(), 1u);
}

TEST_F(ImageFile, PngRowsGoDownwards) {
  Image image = make_image(2, 3, {"R", "G", "B"});
  for (Channel& channel : image.channels) channel.values = {0, 0, 0, 1, 1, 1};
  save_png(image, path("a.png"), 0);
  int width = 0, height = 0, channels = 0;
  unsigned char* bytes = stbi_load(path("a.png").c_str(), &width, &height, &channels, 0);
  ASSERT_NE(bytes, nullptr);
  const unsigned char expected[18]{0, 0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 255, 255, 255, 255, 255, 255, 255};
  EXPECT_EQ(0, std::memcmp(bytes, expected, sizeof expected));
  stbi_image_free(bytes);
}

TEST_F(ImageFile, PngNeedsColourAndAFiniteExposure) {
  EXPECT_EQ(error_of([&] {
              save_png(make_image(2, 2, {"R", "G"}), path("a.png"), 0);
            }).code(),
            ErrorCode::kValue);
  const Image image = make_image(2, 2, {"R", "G", "B"});
  EXPECT_EQ(error_of([&] { save_png(image, path("a.png"), 1e9); }).code(), ErrorCode::kValue);
  EXPECT_EQ(error_of([&] { save_png(image, path("a.png"), kNan); }).code(), ErrorCode::kValue);
  EXPECT_EQ(count_files(), 0u);
}

TEST(AutoExposure, PutsTheBrightCoveredPixelsAtFourFifths) {
  Image image = make_image(101, 1, {"R", "G", "B", "A"});
  for (std::size_t i = 0; i < 101; ++i) {
    image.channels[0].values[i] = 0.002f * static_cast<float>(i);  // 0 to 0.2: the 99th percentile is 0.198
    image.channels[1].values[i] = 0.001f * static_cast<float>(i);
    image.channels[2].values[i] = 0;
    image.channels[3].values[i] = 1;
  }
  EXPECT_NEAR(auto_exposure(image), std::log2(0.8 / 0.198), 1e-5);
  // Uncovered pixels do not count, however bright.
  for (std::size_t i = 51; i < 101; ++i) image.channels[3].values[i] = 0;
  EXPECT_NEAR(auto_exposure(image), std::log2(0.8 / 0.098), 1e-5);
  image.channels.pop_back();
  EXPECT_NEAR(auto_exposure(image), std::log2(0.8 / 0.198), 1e-5);
}

TEST(AutoExposure, IsZeroForABlackPicture) {
  Image image = make_image(4, 4, {"R", "G", "B", "A"});
  for (std::size_t c = 0; c < 3; ++c) image.channels[c].values.assign(16, 0);
  EXPECT_EQ(auto_exposure(image), 0);
  image = make_image(4, 4, {"R", "G", "B", "A"});
  image.channels[3].values.assign(16, 0);
  EXPECT_EQ(auto_exposure(image), 0);
}

}  // namespace
}  // namespace nacre
