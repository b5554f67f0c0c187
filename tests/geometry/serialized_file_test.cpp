// label: golden
// Files of Mitsuba 0.6 as this test writes them, sound and hostile.
#include "nacre/geometry/serialized_file.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "geometry/serialized_bytes.h"

namespace nacre {
namespace {

using namespace testing_support;

class SerializedFile : public testing::Test {
 protected:
  SerializedFile() : folder_(testing::TempDir() + "nacre-serialized-XXXXXX") {
    if (mkdtemp(folder_.data()) == nullptr) ADD_FAILURE() << "no temporary folder";
  }
  ~SerializedFile() override { std::filesystem::remove_all(folder_); }

  SerializedMesh load(const std::string& bytes, std::uint32_t index = 0) {
    const std::string path = folder_ + "/a.serialized";
    std::ofstream(path, std::ios::binary) << bytes;
    return load_serialized_mesh(path, index, warnings_);
  }
  // The error's code and what its reason says; the code of nothing is kIo.
  Error error_of(const std::string& bytes, std::uint32_t index = 0) {
    try {
      load(bytes, index);
    } catch (const Error& error) {
      EXPECT_EQ(error.place(), folder_ + "/a.serialized");
      return error;
    }
    ADD_FAILURE() << "it was accepted";
    return {ErrorCode::kIo, "", ""};
  }
  void expect_error(const std::string& bytes, ErrorCode code, const std::string& text,
                    std::uint32_t index = 0) {
    const Error error = error_of(bytes, index);
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_NE(error.reason().find(text), std::string::npos) << error.what();
  }

  std::string folder_;
  Warnings warnings_;
};

TEST_F(SerializedFile, BothVersionsAndPrecisions) {
  for (const std::uint16_t version : {std::uint16_t{3}, std::uint16_t{4}})
    for (const bool doubles : {false, true}) {
      SerializedContent content;
      content.doubles = doubles;
      content.positions[3] = 1.25;
      content.normals = {0, 0, 1, 0, 0, 1, 0, 0.6, 0.8, 0, 0, 1};
      content.uvs = {0, 0, 1, 0, 1, 1, 0, 0.75};
      content.colors = std::vector<double>(12, 0.5);
      const SerializedMesh read = load(file_of({content}, version));
      ASSERT_EQ(read.mesh.positions.size(), 4u);
      EXPECT_EQ(read.mesh.positions[1], Vec3(1.25f, 0, 0));
      EXPECT_EQ(read.mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}}));
      EXPECT_EQ(read.mesh.normals.at(2), Vec3(0, 0.6f, 0.8f));
      EXPECT_EQ(read.mesh.uvs.at(3), Vec2(0, 0.75f));
      EXPECT_FALSE(read.face_normals);
    }
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(SerializedFile, PicksTheMeshOfTheIndex) {
  SerializedContent first, second, third;
  second.positions[0] = -2;
  third.positions[0] = -3;
  for (const std::uint16_t version : {std::uint16_t{3}, std::uint16_t{4}}) {
    const std::string bytes = file_of({first, second, third}, version);
    EXPECT_EQ(load(bytes, 0).mesh.positions[0].x, 0);
    EXPECT_EQ(load(bytes, 1).mesh.positions[0].x, -2);
    EXPECT_EQ(load(bytes, 2).mesh.positions[0].x, -3);
    expect_error(bytes, ErrorCode::kValue, "no mesh of shapeIndex 3: there are 3", 3);
  }
}

TEST_F(SerializedFile, FlatMeshesHaveNoNormals) {
  SerializedContent content;
  content.flags = 0x10;
  content.normals = std::vector<double>(12, 0.5);
  const SerializedMesh read = load(file_of({content}, 4));
  EXPECT_TRUE(read.face_normals);
  EXPECT_TRUE(read.mesh.normals.empty());
}

TEST_F(SerializedFile, LeavesOutWhatIsDegenerate) {
  SerializedContent content;
  content.corners = {0, 1, 2, 0, 2, 2};
  const SerializedMesh read = load(file_of({content}, 4));
  EXPECT_EQ(read.mesh.triangles.size(), 1u);
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_NE(warnings_[0].find("degenerate faces: 1, vertices that no face uses: 1"), std::string::npos);
}

// Every beginning of a file, with the right dictionary behind it or without.
TEST_F(SerializedFile, TruncatedFilesAreRefused) {
  SerializedContent content;
  content.normals = std::vector<double>(12, 0.5);
  for (const std::uint16_t version : {std::uint16_t{3}, std::uint16_t{4}}) {
    const std::string whole = file_of({content}, version);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      const ErrorCode code = error_of(whole.substr(0, size)).code();
      EXPECT_TRUE(code == ErrorCode::kSyntax) << size;
    }
    const std::string stream = deflate_bytes(numbers_of(content, version));
    for (std::size_t size = 0; size < stream.size(); ++size)
      expect_error(file_of_streams({stream.substr(0, size)}, version), ErrorCode::kSyntax, "");
  }
}

TEST_F(SerializedFile, DamagedBytesAreRefusedOrHarmless) {
  const std::string whole = file_of({SerializedContent{}}, 4);
  int refused = 0;
  for (std::size_t at = 0; at < whole.size(); ++at)
    for (const int flip : {0x01, 0x80, 0xff}) {
      std::string bytes = whole;
      bytes[at] = static_cast<char>(bytes[at] ^ flip);
      try {
        load(bytes);
      } catch (const Error&) {
        ++refused;
      }
    }
  // All but a few bits of the zlib header that mean nothing.
  EXPECT_GE(refused, static_cast<int>(3 * whole.size()) - 6);
}

TEST_F(SerializedFile, WrongBeginnings) {
  expect_error("", ErrorCode::kSyntax, "too short");
  expect_error("solid something that is not of Mitsuba", ErrorCode::kSyntax, "no mesh of Mitsuba begins");
  expect_error(file_of({SerializedContent{}}, 2), ErrorCode::kUnsupported, "has version 2; 3 and 4 are read");
  try {
    load_serialized_mesh(folder_ + "/none.serialized", 0, warnings_);
    ADD_FAILURE() << "it was accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kNotFound);
  }
  EXPECT_THROW(load_serialized_mesh(folder_, 0, warnings_), Error);
}

TEST_F(SerializedFile, BadDictionaries) {
  const std::string stream = header(4) + deflate_bytes(numbers_of({}, 4));
  const auto with = [&](std::uint64_t offset, std::uint32_t count) {
    std::string bytes = stream;
    append(bytes, offset);
    append(bytes, count);
    return bytes;
  };
  EXPECT_EQ(load(with(0, 1)).mesh.triangles.size(), 2u);
  expect_error(with(0, 0), ErrorCode::kSyntax, "a count of 0 meshes");
  expect_error(with(0, 0xffffffff), ErrorCode::kSyntax, "a count of 4294967295 meshes");
  expect_error(with(stream.size(), 1), ErrorCode::kSyntax, "behind all meshes");
  expect_error(with(stream.size() - 3, 1), ErrorCode::kSyntax, "behind all meshes");
  expect_error(with(~std::uint64_t{0}, 1), ErrorCode::kSyntax, "behind all meshes");
  expect_error(with(1, 1), ErrorCode::kSyntax, "byte 1: no mesh of Mitsuba begins there");
}

// Counts that lie, beyond what the file holds, beyond memory, and where their products overflow.
TEST_F(SerializedFile, HugeCountsAreRefusedBeforeAnythingIsAllocated) {
  const std::uint64_t huge[] = {1000000, std::uint64_t{1} << 32, std::uint64_t{1} << 62,
                                std::numeric_limits<std::uint64_t>::max() / 12 + 1,
                                std::numeric_limits<std::uint64_t>::max()};
  for (const std::uint64_t count : huge) {
    SerializedContent vertices, triangles;
    vertices.vertices = count;
    triangles.triangles = count;
    expect_error(file_of({vertices}, 4), ErrorCode::kSyntax, "more than the file can hold");
    expect_error(file_of({triangles}, 3), ErrorCode::kSyntax, "more than the file can hold");
  }
  for (const std::uint64_t count : {std::uint64_t{5}, std::uint64_t{100}}) {
    SerializedContent longer;
    longer.vertices = count;
    expect_error(file_of({longer}, 4), ErrorCode::kSyntax, "shorter than it says");
  }
  SerializedContent shorter;
  shorter.triangles = 1;
  expect_error(file_of({shorter}, 4), ErrorCode::kSyntax, "longer than it says");
}

TEST_F(SerializedFile, BadNumbers) {
  SerializedContent content;
  content.corners[4] = 4;
  expect_error(file_of({content}, 4), ErrorCode::kSyntax, "a face uses vertex 4 of 4");
  content = {};
  content.positions[5] = std::numeric_limits<double>::quiet_NaN();
  expect_error(file_of({content}, 4), ErrorCode::kValue, "vertex 1: a coordinate is not a finite number");
  content = {};
  content.triangles = 0;
  content.corners.clear();
  expect_error(file_of({content}, 3), ErrorCode::kValue, "no triangle");
  content = {};
  content.name = std::string(100000, 'a');
  expect_error(file_of({content}, 4), ErrorCode::kSyntax, "name of a mesh has no end");
}

}  // namespace
}  // namespace nacre
