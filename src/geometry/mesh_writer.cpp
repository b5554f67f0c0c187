// Writing of mesh files. Not through OpenMesh, whose half-edge mesh cannot hold every mesh.
#include <bit>
#include <cstring>
#include <iterator>

#include "nacre/base/file.h"
#include "nacre/geometry/mesh_file.h"

namespace nacre {
namespace {

static_assert(std::endian::native == std::endian::little, "binary PLY is written as it lies in memory");

// Collects bytes and hands them to the file in large pieces.
class Output {
 public:
  explicit Output(AtomicFile& file) : file_(file) {}
  template <class T>
  void put(const T& value) {
    const char* bytes = reinterpret_cast<const char*>(&value);
    buffer_.append(bytes, sizeof value);
    flush_above(kPiece);
  }
  template <class... Args>
  void print(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(buffer_), format, std::forward<Args>(args)...);
    flush_above(kPiece);
  }
  void flush_above(std::size_t bytes) {
    if (buffer_.size() <= bytes) return;
    file_.write(buffer_.data(), buffer_.size());
    buffer_.clear();
  }

 private:
  static constexpr std::size_t kPiece = 1 << 20;
  AtomicFile& file_;
  std::string buffer_;
};

void write_ply(const Mesh& mesh, Output& out) {
  out.print("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", mesh.positions.size());
  out.print("property float x\nproperty float y\nproperty float z\n");
  if (!mesh.normals.empty()) out.print("property float nx\nproperty float ny\nproperty float nz\n");
  if (!mesh.uvs.empty()) out.print("property float u\nproperty float v\n");
  out.print("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    out.put(mesh.positions[i]);
    if (!mesh.normals.empty()) out.put(mesh.normals[i]);
    if (!mesh.uvs.empty()) out.put(mesh.uvs[i]);
  }
  for (const Triangle& t : mesh.triangles) {
    out.put(std::uint8_t{3});
    out.put(t);
  }
}

void write_obj(const Mesh& mesh, Output& out) {
  // The shortest digits that give back the same floats.
  for (const Vec3& p : mesh.positions) out.print("v {} {} {}\n", p.x, p.y, p.z);
  for (const Vec2& uv : mesh.uvs) out.print("vt {} {}\n", uv.x, uv.y);
  for (const Vec3& n : mesh.normals) out.print("vn {} {} {}\n", n.x, n.y, n.z);
  for (const Triangle& t : mesh.triangles) {
    out.print("f");
    for (const std::uint32_t v : t) {
      const std::uint64_t i = std::uint64_t{v} + 1;
      if (mesh.normals.empty() && mesh.uvs.empty())
        out.print(" {}", i);
      else if (mesh.normals.empty())
        out.print(" {}/{}", i, i);
      else if (mesh.uvs.empty())
        out.print(" {}//{}", i, i);
      else
        out.print(" {}/{}/{}", i, i, i);
    }
    out.print("\n");
  }
}

}  // namespace

void save_mesh(const Mesh& mesh, const std::string& path) {
  const bool is_ply = path.ends_with(".ply") || path.ends_with(".PLY");
  const bool is_obj = path.ends_with(".obj") || path.ends_with(".OBJ");
  if (!is_ply && !is_obj) fail(ErrorCode::kUnsupported, path, "meshes are written as .ply or .obj only");
  AtomicFile file(path);
  Output out(file);
  if (is_ply)
    write_ply(mesh, out);
  else
    write_obj(mesh, out);
  out.flush_above(0);
  file.commit();
}

}  // namespace nacre
