// label: unit
// Exitance that outlives a command: round trips, extension by several at once, damage, other keys.
#include "nacre/cache/exitance_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "nacre/base/error.h"
#include "tools/cli.h"

namespace nacre {
namespace {

using testing_support::TemporaryFolder;

// Two media, the second of which keeps nothing; node i is in block i / 4.
constexpr std::size_t kBlocks = 8, kNodes = 32;
Rgb value_of(std::size_t node) { return {1.5f * static_cast<float>(node), 0.25f, 3}; }
std::vector<KeptExitance> make_kept(std::initializer_list<std::size_t> blocks) {
  std::vector<KeptExitance> kept(2);
  kept[0].key = {{"marble/sigma_s", "1 2 3"}, {"marble/tolerance", "0.01"}};
  kept[0].filled.assign(kBlocks, 0);
  kept[0].values.assign(kNodes, Rgb(0, 0, 0));
  for (const std::size_t b : blocks) {
    kept[0].filled[b] = 1;
    for (std::size_t i = 4 * b; i < 4 * b + 4; ++i) kept[0].values[i] = value_of(i);
  }
  return kept;
}
std::vector<std::vector<std::uint32_t>> block_of() {
  std::vector<std::uint32_t> blocks;
  for (std::uint32_t i = 0; i < kNodes; ++i) blocks.push_back(i / 4);
  return {blocks, {}};
}

ErrorCode code_of(const std::function<void()>& act) {
  try {
    act();
  } catch (const Error& error) {
    EXPECT_FALSE(std::string(error.what()).empty());
    return error.code();
  }
  ADD_FAILURE() << "no error";
  return ErrorCode::kIo;
}

TEST(ExitanceFile, GivesBackWhatWasKeptAndIsExtended) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exitance");
  extend_exitance(path, make_kept({1, 2}), block_of());
  EXPECT_TRUE(is_exitance_file(path));
  EXPECT_EQ(load_exitance(path), make_kept({1, 2}));
  extend_exitance(path, make_kept({2, 7}), block_of());
  EXPECT_EQ(load_exitance(path), make_kept({1, 2, 7}));
  const auto written = std::filesystem::last_write_time(path);
  extend_exitance(path, make_kept({7}), block_of());  // nothing new
  EXPECT_EQ(std::filesystem::last_write_time(path), written);
  EXPECT_EQ(folder.count(), 1u);  // neither locks nor temporary files are left
}

TEST(ExitanceFile, SeveralAtOnceLoseNothing) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exitance");
  for (int round = 0; round < 20; ++round) {
    std::filesystem::remove(path);
    std::vector<std::thread> threads;
    for (std::size_t b = 0; b < kBlocks; ++b)
      threads.emplace_back([&path, b] { extend_exitance(path, make_kept({b}), block_of()); });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(load_exitance(path), make_kept({0, 1, 2, 3, 4, 5, 6, 7}));
  }
}

TEST(ExitanceFile, EveryDamagedByteIsSeen) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exitance");
  extend_exitance(path, make_kept({1, 2}), block_of());
  std::ifstream in(path, std::ios::binary);
  const std::string good((std::istreambuf_iterator<char>(in)), {});
  const auto load_changed = [&](const std::string& bytes) {
    std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
    return load_exitance(path);
  };
  int harmless = 0;
  for (std::size_t i = 0; i < good.size(); ++i) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x40);
    try {
      EXPECT_EQ(load_changed(bad), make_kept({1, 2})) << i;
      ++harmless;  // padding, which nothing reads
    } catch (const Error& error) {
      EXPECT_TRUE(error.code() == ErrorCode::kDamaged || error.code() == ErrorCode::kNotACache) << i;
    }
  }
  EXPECT_LT(harmless, 64 * 8);
  for (std::size_t size = 0; size < good.size(); size += 13) {
    const ErrorCode code = code_of([&] { load_changed(good.substr(0, size)); });
    EXPECT_TRUE(code == ErrorCode::kTruncated || code == ErrorCode::kNotACache) << size;
  }
  // What is damaged is not extended, either.
  EXPECT_EQ(code_of([&] { extend_exitance(path, make_kept({3}), block_of()); }), ErrorCode::kTruncated);
}

TEST(ExitanceFile, OfSomethingElseIsRefusedByName) {
  const TemporaryFolder folder;
  const std::string path = folder.file("a.exitance");
  extend_exitance(path, make_kept({1}), block_of());
  auto other = make_kept({2});
  other[0].key[1].second = "0.02";
  try {
    extend_exitance(path, other, block_of());
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kMismatch);
    EXPECT_NE(std::string(error.what()).find("marble/tolerance was 0.01 and is 0.02"), std::string::npos)
        << error.what();
  }
  auto fewer = make_kept({2});
  fewer[0].values.pop_back();
  EXPECT_EQ(code_of([&] { check_exitance_keys(path, load_exitance(path), fewer); }), ErrorCode::kMismatch);
  fewer.pop_back();
  EXPECT_EQ(code_of([&] { check_exitance_keys(path, load_exitance(path), fewer); }), ErrorCode::kMismatch);
  EXPECT_EQ(load_exitance(path), make_kept({1}));
  EXPECT_EQ(code_of([&] { load_exitance(folder.file("none")); }), ErrorCode::kNotFound);
}

}  // namespace
}  // namespace nacre
