// Loading of mesh files: guard, read, assemble.
#include "nacre/geometry/mesh_file.h"

#include <optional>

#include "geometry/openmesh_reader.h"
#include "nacre/base/file.h"

namespace nacre {
namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{1} << 33;

std::optional<MeshFormat> format_of(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  if (dot == std::string::npos) return std::nullopt;
  std::string extension = path.substr(dot + 1);
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == "obj") return MeshFormat::kObj;
  if (extension == "ply") return MeshFormat::kPly;
  if (extension == "stl") return MeshFormat::kStl;
  if (extension == "off") return MeshFormat::kOff;
  return std::nullopt;
}

GuardedFile guard(MeshFormat format, std::string content, const std::string& path) {
  switch (format) {
    case MeshFormat::kObj:
      return guard_obj(std::move(content), path);
    case MeshFormat::kPly:
      return guard_ply(std::move(content), path);
    case MeshFormat::kStl:
      return guard_stl(std::move(content), path);
    case MeshFormat::kOff:
      break;
  }
  return guard_off(std::move(content), path);
}

}  // namespace

bool is_mesh_file_name(const std::string& path) { return format_of(path).has_value(); }

Mesh load_mesh(const std::string& path, Warnings& warnings) {
  const std::optional<MeshFormat> format = format_of(path);
  if (!format)
    fail(ErrorCode::kUnsupported, path, "not a mesh file: its name has to end in .obj, .ply, .stl or .off");
  GuardedFile file = guard(*format, read_text_file(path, kMaxFileBytes), path);
  const std::uint64_t faces = file.faces;
  RawMesh raw = read_with_openmesh(*format, std::move(file), path);
  const std::uint64_t left_out = faces - raw.face_ends.size();
  return assemble_mesh(std::move(raw), left_out, path, warnings);
}

}  // namespace nacre
