// A folder with a cache file in it, and what is expected of reading it.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "cache/cache_bytes.h"
#include "nacre/base/error.h"
#include "nacre/cache/cache_file.h"

namespace nacre::testing_support {

class CacheFile : public testing::Test {
 protected:
  void SetUp() override {
    std::string name = testing::TempDir() + "nacre-cache-XXXXXX";
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name + "/";
    path_ = folder_ + "a.nacre";
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  Bytes good() const {
    save_cache(make_golden_cache(), path_);
    return read_bytes(path_);
  }
  // The error of reading these bytes; fails the test if there is none.
  Error error_of(const Bytes& bytes) const {
    write_bytes(path_, bytes);
    return error_of(path_);
  }
  static Error error_of(const std::string& path) {
    try {
      load_cache(path);
    } catch (const Error& error) {
      return error;
    }
    ADD_FAILURE() << path << " was read";
    return {ErrorCode::kMismatch, "", ""};
  }
  // Expects damage that names the section.
  void expect_damaged(const Bytes& bytes, const std::string& kind, std::uint32_t group,
                      const std::string& what) const {
    const Error error = error_of(bytes);
    EXPECT_EQ(error.code(), ErrorCode::kDamaged) << what;
    EXPECT_NE(std::string(error.what()).find(fmt::format("section {} of group {} is damaged", kind, group)),
              std::string::npos)
        << what << ": " << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }

  std::string folder_, path_;
};

}  // namespace nacre::testing_support
