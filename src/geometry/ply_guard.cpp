// Guard for PLY files: parses the header and writes it anew.
#include <algorithm>
#include <initializer_list>
#include <vector>

#include "geometry/mesh_guard.h"
#include "geometry/ply_header.h"
#include "geometry/text_lines.h"

namespace nacre {
namespace {

// The names under which OpenMesh knows what is wanted of a vertex; "" for what is not.
std::string_view known_name(std::string_view name) {
  struct Alias {
    std::string_view name, known;
  };
  constexpr Alias aliases[] = {{"x", "x"},   {"y", "y"},   {"z", "z"},         {"nx", "nx"},
                               {"ny", "ny"}, {"nz", "nz"}, {"u", "u"},         {"v", "v"},
                               {"s", "u"},   {"t", "v"},   {"texture_u", "u"}, {"texture_v", "v"}};
  for (const Alias& alias : aliases)
    if (alias.name == name) return alias.known;
  return "";
}

// How often a vertex has a property under which of OpenMesh's names, in a type that OpenMesh can read.
std::size_t count_known(const PlyElement& vertex, std::string_view known, bool binary) {
  return static_cast<std::size_t>(std::count_if(
      vertex.properties.begin(), vertex.properties.end(),
      [&](const PlyProperty& p) { return known_name(p.name) == known && (!binary || p.type.is_float); }));
}

// ASCII values are words, whatever their type.
std::string_view scalar_name(const PlyType& type, bool binary) {
  if (!binary) return "float";
  if (type.is_float) return type.bytes == 4 ? "float" : "double";
  return type.bytes == 1 ? "uchar" : type.bytes == 2 ? "ushort" : "int";
}
// OpenMesh knows just these types for the length of a list.
std::string_view length_name(const PlyType& type) {
  return type.bytes == 1 ? "uchar" : type.bytes == 2 ? "uint16" : "int";
}

void write_vertex(const PlyElement& vertex, bool binary, const std::string& path, std::string& out) {
  for (const char* axis : {"x", "y", "z"})
    if (count_known(vertex, axis, binary) != 1)
      fail(ErrorCode::kUnsupported, path, "the vertices need one property {} of type float or double", axis);
  const auto has_all = [&](std::initializer_list<std::string_view> names) {
    return std::all_of(names.begin(), names.end(),
                       [&](std::string_view name) { return count_known(vertex, name, binary) == 1; });
  };
  const bool normals = has_all({"nx", "ny", "nz"}), uvs = has_all({"u", "v"});
  for (const PlyProperty& p : vertex.properties) {
    std::string_view name = known_name(p.name);
    const bool wanted = name.size() == 2 ? normals : name == "u" || name == "v" ? uvs : !name.empty();
    if (!wanted || (binary && !p.type.is_float)) name = "unused";
    out += fmt::format("property {} {}\n", scalar_name(p.type, binary), name);
  }
}

void write_face(const PlyElement& face, bool binary, const std::string& path, std::string& out) {
  if (face.properties.empty() || !face.properties[0].list ||
      (face.properties[0].name != "vertex_indices" && face.properties[0].name != "vertex_index") ||
      (binary && face.properties[0].type.is_float))
    fail(ErrorCode::kUnsupported, path, "the first property of a face has to be the list vertex_indices");
  const PlyType& index = face.properties[0].type;
  // In binary OpenMesh reads an index by its sign, which for a valid one does not matter.
  out += fmt::format("property list {} {} vertex_indices\n", length_name(*face.properties[0].list),
                     binary ? scalar_name(index, true) : "int");
  for (std::size_t i = 1; i < face.properties.size(); ++i)
    out += fmt::format("property {} unused\n", scalar_name(face.properties[i].type, binary));
}

}  // namespace

GuardedFile guard_ply(std::string content, const std::string& path) {
  LineReader lines(content, path);
  const PlyHeader header = parse_ply_header(lines);
  const std::size_t body = lines.next_begin();
  const std::uint64_t body_bytes = content.size() - body;

  GuardedFile file;
  file.binary = header.binary;
  std::string out = fmt::format("ply\nformat {} 1.0\n", !header.binary      ? "ascii"
                                                        : header.big_endian ? "binary_big_endian"
                                                                            : "binary_little_endian");
  bool has_vertices = false, has_faces = false;
  std::uint64_t needed_bytes = 0;
  for (const PlyElement& element : header.elements) {
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    if (is_vertex && has_vertices) fail(ErrorCode::kSyntax, path, "the header has two vertex elements");
    for (std::size_t i = is_face ? 1 : 0; i < element.properties.size(); ++i)
      if (element.properties[i].list)
        fail(ErrorCode::kUnsupported, path,
             "cannot read the list {} of the element {}: save the file without it, or as OBJ",
             quote_word(element.properties[i].name), quote_word(element.name));
    if (element.properties.empty() && !is_vertex && !is_face) continue;  // takes no place
    needed_bytes += element.count * smallest_size(element, header.binary);
    out += fmt::format("element {} {}\n", is_vertex || is_face ? element.name : "other", element.count);
    if (is_vertex) {
      write_vertex(element, header.binary, path, out);
      has_vertices = true;
      file.vertices = element.count;
    } else if (is_face) {
      write_face(element, header.binary, path, out);
      has_faces = true;
      file.faces = element.count;
      break;  // nothing after the faces is read
    } else {
      for (const PlyProperty& p : element.properties)
        out += fmt::format("property {} unused\n", scalar_name(p.type, header.binary));
    }
  }
  if (!has_vertices || !has_faces)
    fail(ErrorCode::kUnsupported, path, "the file has no {} element", has_vertices ? "face" : "vertex");
  if (needed_bytes > body_bytes + 1)
    fail(ErrorCode::kSyntax, path,
         "the header promises {} vertices and {} faces, at least {} bytes, but {} follow: truncated?",
         file.vertices, file.faces, needed_bytes, body_bytes);
  out += "end_header\n";
  file.line_shift = static_cast<std::int64_t>(lines.number()) - std::count(out.begin(), out.end(), '\n');
  content.replace(0, body, out);
  if (!file.binary) content += '\n';
  file.content = std::move(content);
  return file;
}

}  // namespace nacre
