// label: golden
#include "nacre/geometry/mesh_file.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "nacre/base/file.h"
#include "nacre/base/random.h"
#include "nacre/geometry/primitives.h"
#include "nacre/geometry/topology.h"

namespace nacre {
namespace {

std::string golden(const std::string& name) {
  return std::string(NACRE_SOURCE_DIR) + "/tests/golden/meshes/" + name;
}

class MeshFile : public testing::Test {
 protected:
  MeshFile() : folder_(testing::TempDir() + "nacre-mesh-XXXXXX") {
    if (mkdtemp(folder_.data()) == nullptr) ADD_FAILURE() << "no temporary folder";
  }
  ~MeshFile() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  std::string write(const std::string& name, const std::string& content) const {
    std::ofstream(path(name), std::ios::binary) << content;
    return path(name);
  }
  Mesh load(const std::string& file) {
    warnings_.clear();
    return load_mesh(file, warnings_);
  }
  Mesh load_text(const std::string& name, const std::string& content) { return load(write(name, content)); }

  // The error that loading gives, which has to be one line that names the file.
  Error load_error(const std::string& file) {
    try {
      load(file);
    } catch (const Error& e) {
      EXPECT_EQ(e.place(), file);
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
      EXPECT_LT(e.reason().size(), 200u);
      return e;
    }
    ADD_FAILURE() << file << " was accepted";
    return Error(ErrorCode::kIo, "", "");
  }
  ErrorCode code_of(const std::string& name, const std::string& content) {
    return load_error(write(name, content)).code();
  }

  std::string folder_;
  Warnings warnings_;
};

TEST_F(MeshFile, ObjWithAttributesByCorner) {
  const Mesh mesh = load(golden("cube_corners.obj"));
  EXPECT_TRUE(warnings_.empty());
  ASSERT_EQ(mesh.triangles.size(), 12u);
  EXPECT_EQ(mesh.positions.size(), 24u);
  EXPECT_NEAR(signed_volume(mesh), 8, 1e-12);
  EXPECT_TRUE(analyse_topology(mesh).closed());
  for (std::size_t i = 0; i < 12; ++i)
    for (const std::uint32_t v : mesh.triangles[i]) EXPECT_EQ(mesh.normals[v], face_normal(mesh, i));
  // Corner 5/1/2 and 5/4/3: one position, two vertices.
  int found = 0;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    if (mesh.positions[v] == Vec3(-1, -1, 1)) {
      if (mesh.normals[v] == Vec3(0, 0, 1)) found += mesh.uvs[v] == Vec2(0, 0);
      if (mesh.normals[v] == Vec3(0, -1, 0)) found += mesh.uvs[v] == Vec2(0, 1);
    }
  EXPECT_EQ(found, 2);
}

TEST_F(MeshFile, ObjWithoutAttributesKeepsItsVertices) {
  const Mesh mesh = load_text("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nv 1 1 0\nf 1 2 3\nf 2 5 3\n");
  EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}));
  EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
  EXPECT_TRUE(mesh.normals.empty());
  EXPECT_TRUE(mesh.uvs.empty());
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_EQ(warnings_[0], path("a.obj") + ": left out vertices that no face uses: 1");
}

TEST_F(MeshFile, ObjOfManyDialects) {
  const std::string text =
      "\xef\xbb\xbf# comment\r\n\r\ng a\r\nv +0 0. .0\r\n  v\t1e0 0 0 1.0\r\nv 0 1 0 0.5 0.5 0.5\r\n"
      "vt 0 0 0\r\nvn 0 0 2\r\nf 1//1 2//1 3//1   \r\nf 1/1 2/1 3/1\r\nf 3 2 1\r\nl 1 2\r\nf -3//-1 -2//-1 "
      "-1//-1";
  const Mesh mesh = load_text("a.OBJ", text.substr(3));
  ASSERT_EQ(mesh.triangles.size(), 4u);
  for (const std::uint32_t v : mesh.triangles[0]) EXPECT_EQ(mesh.normals[v], Vec3(0, 0, 1));
  for (const std::uint32_t v : mesh.triangles[1])
    EXPECT_EQ(mesh.normals[v], Vec3(0, 0, 1));  // its face's own
  for (const std::uint32_t v : mesh.triangles[2]) EXPECT_NEAR(mesh.normals[v].length(), 1, 1e-6);
  EXPECT_EQ(mesh.triangles[3], mesh.triangles[0]);
}

TEST_F(MeshFile, ObjMaterialFilesAreNotOpened) {
  // Opening a pipe would wait for a writer for ever.
  ASSERT_EQ(::system(("mkfifo " + path("pipe.mtl")).c_str()), 0);
  EXPECT_EQ(load_text("a.obj", "mtllib pipe.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").triangles.size(), 1u);
}

TEST_F(MeshFile, PolygonsBecomeTriangles) {
  // An L of six corners, concave at (1, 1), counter-clockwise; a fan from (0, 2) would leave it.
  const std::string vertices = "v 0 2 0\nv 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\n";
  for (const char* face : {"f 1 2 3 4 5 6", "f 3 4 5 6 1 2", "f 5 6 1 2 3 4"}) {
    const Mesh mesh = load_text("a.obj", vertices + face);
    ASSERT_EQ(mesh.triangles.size(), 4u);
    EXPECT_NEAR(surface_area(mesh), 3, 1e-12);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(face_normal(mesh, i), Vec3(0, 0, 1));
  }
  // Turned around and stood up.
  const Mesh turned =
      load_text("b.obj", "v 0 0 2\nv 0 0 0\nv 0 2 0\nv 0 2 1\nv 0 1 1\nv 0 1 2\nf 6 5 4 3 2 1");
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(face_normal(turned, i), Vec3(-1, 0, 0));
}

TEST_F(MeshFile, OffKeepsFacesThatHalfEdgesCannotHold) {
  const Mesh mesh = load(golden("fin.off"));
  EXPECT_TRUE(warnings_.empty());
  EXPECT_EQ(mesh.positions.size(), 5u);
  ASSERT_EQ(mesh.triangles.size(), 5u);
  EXPECT_EQ(mesh.triangles[3], (Triangle{1, 3, 2}));
  const TopologyReport report = analyse_topology(mesh);
  EXPECT_EQ(report.non_manifold_edges, 1u);
  EXPECT_EQ(report.flipped_edges, 3u);
}

TEST_F(MeshFile, OffWithAttributes) {
  const Mesh mesh = load(golden("normals.off"));
  ASSERT_EQ(mesh.triangles.size(), 1u);
  EXPECT_EQ(mesh.normals, std::vector<Vec3>(3, Vec3(0, 0, 1)));
  EXPECT_EQ(mesh.uvs, (std::vector<Vec2>{{0, 0}, {1, 0}, {0, 1}}));
  // The reader's state does not stick to the next file; counts may stand beside OFF.
  const Mesh plain = load_text("a.off", "OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2");
  EXPECT_EQ(plain.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_TRUE(plain.normals.empty());
}

TEST_F(MeshFile, StlAscii) {
  const Mesh mesh = load(golden("tetrahedron.stl"));
  EXPECT_EQ(mesh.positions.size(), 4u);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_NEAR(signed_volume(mesh), 1.0 / 6, 1e-12);
  EXPECT_EQ(describe_problems(analyse_topology(mesh)), "");
}

std::string binary_stl(const std::vector<std::array<float, 9>>& triangles, const std::string& title) {
  std::string text = title + std::string(80 - title.size(), ' ');
  const auto count = static_cast<std::uint32_t>(triangles.size());
  text.append(reinterpret_cast<const char*>(&count), 4);
  for (const auto& t : triangles) {
    const float normal[3] = {std::nanf(""), 0, 0};  // many programs write nonsense here
    text.append(reinterpret_cast<const char*>(normal), 12);
    text.append(reinterpret_cast<const char*>(t.data()), 36);
    text.append(2, '\0');
  }
  return text;
}

TEST_F(MeshFile, StlBinary) {
  const std::vector<std::array<float, 9>> triangles = {
      {0, 0, 0, 1, 0, 0, 0, 1, 0}, {1, 0, 0, 1, 1, 0, 0, 1, 0}, {1, 0, 0, 1, 0, 0, 0, 1, 0}};
  for (const char* title : {"binary", "solid but binary all the same"}) {
    const Mesh mesh = load_text("a.stl", binary_stl(triangles, title));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}, {1, 3, 2}}));
    ASSERT_EQ(warnings_.size(), 1u);
    EXPECT_NE(warnings_[0].find("degenerate faces: 1"), std::string::npos);
  }
  const std::string whole = binary_stl(triangles, "binary");
  EXPECT_EQ(code_of("b.stl", whole.substr(0, whole.size() - 1)), ErrorCode::kSyntax);
  auto infinite = triangles;
  infinite[1][4] = std::numeric_limits<float>::infinity();
  EXPECT_EQ(code_of("b.stl", binary_stl(infinite, "binary")), ErrorCode::kValue);
  EXPECT_EQ(code_of("b.stl", binary_stl({}, "binary")), ErrorCode::kValue);
}

TEST_F(MeshFile, PlyAscii) {
  const Mesh mesh = load(golden("attributes.ply"));
  EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}));
  EXPECT_EQ(mesh.normals, std::vector<Vec3>(4, Vec3(0, 0, 1)));
  EXPECT_EQ(mesh.uvs, (std::vector<Vec2>{{0, 0}, {1, 0}, {1, 1}, {0, 1}}));
  EXPECT_EQ(mesh.triangles.size(), 2u);
  ASSERT_EQ(warnings_.size(), 1u);
  EXPECT_NE(warnings_[0].find("degenerate faces: 1, vertices that no face uses: 1"), std::string::npos);
}

// A triangle in either byte order, with unusual types and properties that are of no use.
std::string binary_ply(bool big_endian) {
  std::string text = fmt::format(
      "ply\nformat binary_{}_endian 1.0\nelement other 1\nproperty short a\nelement vertex 3\nproperty "
      "double x\n"
      "property uchar red\nproperty float y\nproperty float32 z\nproperty int16 confidence\nelement face 1\n"
      "property list uint int vertex_indices\nproperty double area\nelement tail 5\nproperty list uchar int "
      "b\n"
      "end_header\n",
      big_endian ? "big" : "little");
  const auto put = [&](auto value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    if (big_endian) std::reverse(bytes, bytes + sizeof value);
    text.append(bytes, sizeof value);
  };
  put(std::int16_t{7});
  for (int i = 0; i < 3; ++i) {
    put(i == 1 ? 1.5 : 0.0);
    put(std::uint8_t{200});
    put(i == 2 ? 2.5f : 0.0f);
    put(0.25f);
    put(std::int16_t{-1});
  }
  put(std::uint32_t{3});
  for (const std::int32_t i : {0, 1, 2}) put(i);
  put(0.5);
  return text;
}

TEST_F(MeshFile, PlyBinaryInBothByteOrders) {
  for (const bool big_endian : {false, true}) {
    const Mesh mesh = load_text("a.ply", binary_ply(big_endian));
    EXPECT_EQ(mesh.positions, (std::vector<Vec3>{{0, 0, 0.25f}, {1.5f, 0, 0.25f}, {0, 2.5f, 0.25f}}));
    EXPECT_EQ(mesh.triangles, (std::vector<Triangle>{{0, 1, 2}}));
  }
}

TEST_F(MeshFile, RoundTripIsExact) {
  Mesh mesh = make_sphere();
  for (const char* name : {"a.ply", "a.obj"}) {
    save_mesh(mesh, path(name));
    const Mesh back = load(path(name));
    EXPECT_TRUE(warnings_.empty());
    ASSERT_EQ(back.triangles.size(), mesh.triangles.size());
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = mesh.triangles[i][k], b = back.triangles[i][k];
        ASSERT_EQ(mesh.positions[a], back.positions[b]);
        ASSERT_EQ(mesh.normals[a], back.normals[b]);
        ASSERT_EQ(mesh.uvs[a], back.uvs[b]);
      }
  }
  mesh.normals.clear();
  mesh.uvs.clear();
  for (const char* name : {"b.ply", "b.obj"}) {
    save_mesh(mesh, path(name));
    const Mesh back = load(path(name));
    EXPECT_TRUE(back.positions == mesh.positions && back.triangles == mesh.triangles && back.normals.empty());
  }
}

TEST_F(MeshFile, SaveRefusesAndLeavesNothingBehind) {
  EXPECT_THROW(save_mesh(make_cube(), path("a.stl")), Error);
  EXPECT_THROW(save_mesh(make_cube(), path("missing/a.ply")), Error);
  std::filesystem::create_directory(path("folder.ply"));
  EXPECT_THROW(save_mesh(make_cube(), path("folder.ply")), Error);
  for (const auto& entry : std::filesystem::directory_iterator(folder_))
    EXPECT_EQ(entry.path().filename(), "folder.ply");
}

TEST_F(MeshFile, Names) {
  EXPECT_TRUE(is_mesh_file_name("a/b.c.PlY"));
  EXPECT_FALSE(is_mesh_file_name("x.xml"));
  EXPECT_FALSE(is_mesh_file_name("ply"));
  EXPECT_EQ(load_error(path("absent.obj")).code(), ErrorCode::kNotFound);
  EXPECT_EQ(load_error(write("a.txt", "v 0 0 0")).code(), ErrorCode::kUnsupported);
  std::filesystem::create_directory(path("folder.ply"));
  EXPECT_EQ(load_error(path("folder.ply")).code(), ErrorCode::kIo);
}

TEST_F(MeshFile, GoldenBadFiles) {
  struct Bad {
    const char* name;
    ErrorCode code;
    const char* says;
  };
  for (const Bad& bad :
       {Bad{"bad_nan.obj", ErrorCode::kValue, "line 2: \"nan\""},
        Bad{"bad_index.obj", ErrorCode::kSyntax, "line 4: a face uses number 4 of 3 vertices"},
        Bad{"bad_word.ply", ErrorCode::kSyntax, "line 11: \"zero\" is not a number"},
        Bad{"bad_count.ply", ErrorCode::kSyntax, "promises 2000000000 vertices"},
        Bad{"bad_truncated.off", ErrorCode::kSyntax, "line 4: the file ends where a vertex"}}) {
    const Error error = load_error(golden(bad.name));
    EXPECT_EQ(error.code(), bad.code) << error.what();
    EXPECT_NE(error.reason().find(bad.says), std::string::npos) << error.what();
  }
}

TEST_F(MeshFile, BadObj) {
  const std::string good = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\n";
  for (const char* face :
       {"f 1 2", "f 1 2 0", "f 1 2 -4", "f 1 2 x", "f 1 2 3.5", "f /1 /2 /3", "f 1//2 2//1 3//1",
        "f 1/1/1 2 3", "f 1/1/1/1 2 3", "f 99999999999999999999 1 2", "v 1 2", "v a b c", "vt 0", "v 1 2 3f"})
    EXPECT_EQ(code_of("a.obj", good + face), ErrorCode::kSyntax) << face;
  for (const char* line : {"v 1 -inf 0", "v 1e39 0 0", "vn nan 0 0", "vt 0 1e999"})
    EXPECT_EQ(code_of("a.obj", good + line), ErrorCode::kValue) << line;
  for (const char* text : {"", "\n\n", "f 1 1 1\nv 0 0 0", "hello", "v 0 0 0"})
    EXPECT_EQ(code_of("a.obj", text), ErrorCode::kValue) << text;
  std::string endless = good + "f";
  for (int i = 0; i < 500'000; ++i) endless += " 1 2 3";
  EXPECT_EQ(code_of("a.obj", endless), ErrorCode::kUnsupported);
}

TEST_F(MeshFile, BadPlyHeaders) {
  const std::string start = "ply\nformat ascii 1.0\n";
  const std::string vertex = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string face = "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string body = "end_header\n0 0 0 1 0 0 0 1 0 3 0 1 2\n";
  EXPECT_EQ(load_text("a.ply", start + vertex + face + body).triangles.size(), 1u);
  for (const std::string& text :
       {std::string(), std::string("plx\n"), start, start + vertex + face, "ply\n" + vertex + face + body,
        start + "element vertex -3\n", start + "element vertex 99999999999\n", start + "property float x\n",
        start + "element vertex 3\nproperty quaternion x\n", start + "nonsense\n",
        start + vertex + vertex + face + body,
        start + vertex + "element face 9\nproperty list uchar int vertex_indices\n" + body,
        start + vertex + face + "end_header\n0 0 0 1 0 0 0 1 0 4000000000 0 1 2\n",
        start + vertex + face + "end_header\n0 0 0 1 0 0 0 1 0 3 0 1 3\n",
        start + vertex + face + "end_header\n0 0 0 1 0 0 0 1 0 3 0 1 -1\n",
        start + vertex + face + "end_header\n0 0 0 1 0 0 0 1 0 3 0 1.5 2\n",
        start + vertex + face + "end_header\n0 0 0 1 0 0 0 1 0 3 0 1\n"})
    EXPECT_EQ(code_of("a.ply", text), ErrorCode::kSyntax) << text;
  for (const std::string& text :
       {"ply\nformat ternary 1.0\n" + vertex + face + body, start + face + body, start + vertex + body,
        start + "element vertex 3\nproperty float x\nproperty float y\n" + face + body,
        start + vertex + "element face 1\nproperty int a\nproperty list uchar int vertex_indices\n" + body,
        start + vertex + face + "property list uchar float texcoord\n" + body})
    EXPECT_EQ(code_of("a.ply", text), ErrorCode::kUnsupported) << text;
  EXPECT_EQ(code_of("a.ply", start + vertex + face + "end_header\n0 0 inf 1 0 0 0 1 0 3 0 1 2\n"),
            ErrorCode::kValue);
  EXPECT_EQ(code_of("a.ply", start + vertex + face + "end_header\n0 0 1e39 1 0 0 0 1 0 3 0 1 2\n"),
            ErrorCode::kValue);
  EXPECT_EQ(code_of("a.ply", start + vertex + face + "end_header\n0 0 0 1 0 0 0 1 0 2 0 1\n"),
            ErrorCode::kValue);
}

TEST_F(MeshFile, BadOffAndStl) {
  const std::string vertices = "3 1 0\n0 0 0\n1 0 0\n0 1 0\n";
  for (const std::string& text : std::vector<std::string>{
           "OF\n", "OFF", "OFF\n-1 1 0\n", "OFF\n3 1\n", "OFF\n" + vertices, "OFF\n" + vertices + "3 0 1",
           "OFF\n" + vertices + "3 0 1 3", "OFF\n" + vertices + "4000000000 0 1 2",
           "OFF\n3 1 0\n0 0\n1 0 0\n0 1 0\n3 0 1 2", "STOFF\n" + vertices + "3 0 1 2",
           "OFF\n4000000000 1 0\n"})
    EXPECT_EQ(code_of("a.off", text), ErrorCode::kSyntax) << text;
  for (const std::string& text : {"4OFF\n" + vertices, "OFF BINARY\n" + vertices, "#\nNOFF\n" + vertices})
    EXPECT_EQ(code_of("a.off", text), ErrorCode::kUnsupported) << text;
  EXPECT_EQ(code_of("a.off", "OFF\n3 1 0\n0 0 nan\n1 0 0\n0 1 0\n3 0 1 2"), ErrorCode::kValue);
  EXPECT_EQ(code_of("a.off", "OFF\n" + vertices + "3 0 1 1"), ErrorCode::kValue);

  for (const char* text :
       {"", "what", "solid a\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n",
        "solid a\nouter loop\nvertex 0 0 0\nvertex 1 0 x\nvertex 1 0 0\n", "solid a\nvertex 0 0 0\n"})
    EXPECT_EQ(code_of("a.stl", text), ErrorCode::kSyntax) << text;
  EXPECT_EQ(code_of("a.stl", "solid a\nouter loop\nvertex 0 0 0\nvertex 1 0 inf\nvertex 1 0 0\n"),
            ErrorCode::kValue);
  EXPECT_EQ(code_of("a.stl", "solid a\nendsolid\n"), ErrorCode::kValue);
}

TEST_F(MeshFile, DamagedFilesNeverDoHarm) {
  // Every kind of file, cut short, and with bytes changed at random: a mesh of finite numbers or an Error.
  std::vector<std::pair<std::string, std::string>> files = {{"a.ply", binary_ply(false)},
                                                            {"b.ply", binary_ply(true)}};
  files.emplace_back("a.stl", binary_stl({{0, 0, 0, 1, 0, 0, 0, 1, 0}, {1, 0, 0, 1, 1, 0, 0, 1, 0}}, "x"));
  for (const char* name : {"cube_corners.obj", "attributes.ply", "normals.off", "fin.off", "tetrahedron.stl"})
    files.emplace_back(name, read_text_file(golden(name)));
  const auto survive = [&](const std::string& name, const std::string& content) {
    try {
      const Mesh mesh = load_text(name, content);
      ASSERT_FALSE(mesh.triangles.empty());
      for (const Triangle& t : mesh.triangles)
        for (const std::uint32_t v : t) ASSERT_LT(v, mesh.positions.size());
      for (const Vec3& p : mesh.positions) ASSERT_TRUE(is_finite(p));
      for (const Vec3& n : mesh.normals) ASSERT_NEAR(n.length(), 1, 1e-5);
      for (const Vec2& uv : mesh.uvs) ASSERT_TRUE(std::isfinite(uv.x) && std::isfinite(uv.y));
    } catch (const Error& e) {
      ASSERT_EQ(e.place(), path(name));
    }
  };
  const std::string alphabet = "0123456789-./ \n\t#efvnN\\\"OFx\xff\x80";
  for (const auto& [name, content] : files) {
    for (std::size_t size = 0; size < content.size(); size += 5) survive(name, content.substr(0, size));
    for (std::uint64_t seed = 0; seed < 300; ++seed) {
      Rng rng(hash_words(seed, content.size()));
      std::string changed = content;
      for (std::uint64_t i = 0; i <= seed % 4; ++i)
        changed[rng.next_bits() % changed.size()] = alphabet[rng.next_bits() % alphabet.size()];
      survive(name, changed);
    }
  }
}

}  // namespace
}  // namespace nacre
