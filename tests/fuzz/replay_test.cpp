// label: golden
// What fuzzers start from, what they have found, and thousands of inputs with a little damage, for every
// reader: each is read, or refused in one line, within bounded memory.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "fuzz/targets.h"
#include "nacre/base/error.h"
#include "nacre/base/random.h"

namespace nacre {
namespace {

namespace fs = std::filesystem;
using testing_support::FuzzTarget;

constexpr rlim_t kMostMemory = rlim_t{4} << 30;  // of addresses, libraries and threads included
constexpr std::size_t kMostDamagedBytes = 20000, kVariants = 40;

// Folders of seeds are those of tools/fuzz.sh.
std::vector<std::string> seeds_of(const std::string& target) {
  const std::string tests = std::string(NACRE_SOURCE_DIR) + "/tests/";
  std::vector<std::string> folders{tests + "fuzz/corpus/" + target};
  if (target == "scene") folders.push_back(tests + "golden/scenes");
  if (target == "cache") folders.push_back(tests + "golden/cache");
  if (target == "obj" || target == "ply" || target == "stl" || target == "off")
    folders.push_back(tests + "golden/meshes");
  std::vector<std::string> seeds;
  for (const std::string& folder : folders)
    if (fs::is_directory(folder))
      for (const auto& entry : fs::directory_iterator(folder))
        if (entry.is_regular_file()) seeds.push_back(entry.path());
  std::sort(seeds.begin(), seeds.end());
  return seeds;
}

// A few bytes changed, a piece taken out, doubled, or cut off.
std::string damage(std::string bytes, Rng& rng) {
  if (bytes.empty()) return bytes;
  const auto any = [&](std::size_t count) { return static_cast<std::size_t>(rng.next_bits() % count); };
  const std::size_t at = any(bytes.size()), length = any(std::min<std::size_t>(bytes.size() - at, 64)) + 1;
  switch (any(5)) {
    case 0:
      bytes.erase(at, length);
      break;
    case 1:
      bytes.insert(at, bytes.substr(at, length));
      break;
    case 2:
      bytes.resize(at);
      break;
    default:
      for (std::size_t n = any(4) + 1; n > 0; --n)
        bytes[any(bytes.size())] = static_cast<char>(any(2) ? rng.next_bits() : 0xff * any(2));
  }
  return bytes;
}

class Replay : public testing::TestWithParam<FuzzTarget> {
 protected:
  static void SetUpTestSuite() {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // which take all addresses
    const rlimit most{kMostMemory, kMostMemory};
    ASSERT_EQ(setrlimit(RLIMIT_AS, &most), 0);
#endif
  }
  Replay() : folder_(testing::TempDir() + "nacre-replay-XXXXXX") {
    if (!mkdtemp(folder_.data())) throw std::runtime_error("no temporary folder");
  }
  ~Replay() override { fs::remove_all(folder_); }
  void read(const std::string& bytes) {
    const std::string path = folder_ + "/input" + GetParam().extension;
    std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    try {
      GetParam().read(path);
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
      EXPECT_FALSE(error.reason().empty());
    }
  }
  std::string folder_;
};

TEST_P(Replay, ReadsOrRefuses) {
  const std::vector<std::string> seeds = seeds_of(GetParam().name);
  ASSERT_FALSE(seeds.empty());
  for (const std::string& seed : seeds) {
    SCOPED_TRACE(seed);
    std::ifstream in(seed, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    ASSERT_NO_THROW(read(bytes));
    if (bytes.size() > kMostDamagedBytes) continue;
    for (std::size_t variant = 0; variant < kVariants; ++variant) {
      Rng rng(hash_words(variant, bytes.size()));
      ASSERT_NO_THROW(read(damage(bytes, rng))) << "variant " << variant;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Every, Replay,
                         testing::ValuesIn(testing_support::fuzz_targets().begin(),
                                           testing_support::fuzz_targets().end()),
                         [](const auto& of) { return std::string(of.param.name); });

}  // namespace
}  // namespace nacre
