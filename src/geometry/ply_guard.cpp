// Guard for PLY files: parses the header and writes it anew.
#include <algorithm>
#include <initializer_list>
#include <optional>
#include <vector>

#include "geometry/mesh_guard.h"
#include "geometry/text_lines.h"

namespace nacre {
namespace {

struct Type {
  std::size_t bytes;
  bool is_float;
};

struct Property {
  std::string name;
  Type type;
  std::optional<Type> list;  // the type of a list's length
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  bool binary = false, big_endian = false;
  std::vector<Element> elements;
};

Type parse_type(const LineReader& lines, std::string_view word) {
  struct Name {
    std::string_view first, second;
    Type type;
  };
  constexpr Name names[] = {{"char", "int8", {1, false}},    {"uchar", "uint8", {1, false}},
                            {"short", "int16", {2, false}},  {"ushort", "uint16", {2, false}},
                            {"int", "int32", {4, false}},    {"uint", "uint32", {4, false}},
                            {"float", "float32", {4, true}}, {"double", "float64", {8, true}}};
  for (const Name& name : names)
    if (word == name.first || word == name.second) return name.type;
  lines.fail_here(ErrorCode::kSyntax, "{} is not a type of PLY", quote_word(word));
}

void parse_format(const LineReader& lines, std::string_view word, Header& header) {
  if (word != "ascii" && word != "binary_little_endian" && word != "binary_big_endian")
    lines.fail_here(ErrorCode::kUnsupported, "{} is not a format of PLY", quote_word(word));
  header.binary = word != "ascii";
  header.big_endian = word == "binary_big_endian";
}

Element parse_element(const LineReader& lines, std::string_view rest) {
  Element element;
  element.name = take_word(rest);
  const std::int64_t count = lines.parse_integer(take_word(rest), "an element");
  if (count < 0 || count > std::numeric_limits<std::int32_t>::max())
    lines.fail_here(ErrorCode::kSyntax, "a count of {} elements is out of range", count);
  element.count = static_cast<std::uint64_t>(count);
  return element;
}

Property parse_property(const LineReader& lines, std::string_view rest) {
  Property property;
  std::string_view word = take_word(rest);
  if (word == "list") {
    property.list = parse_type(lines, take_word(rest));
    if (property.list->is_float)
      lines.fail_here(ErrorCode::kSyntax, "the length of a list is not an integer");
    word = take_word(rest);
  }
  property.type = parse_type(lines, word);
  property.name = take_word(rest);
  return property;
}

// Reads the header and leaves `lines` at its last line.
Header parse_header(LineReader& lines) {
  Header header;
  if (!lines.next()) lines.fail_here(ErrorCode::kSyntax, "the file is empty");
  std::string_view rest = lines.line();
  if (const auto magic = take_word(rest); magic != "ply" && magic != "PLY")
    lines.fail_here(ErrorCode::kSyntax, "a PLY file has to begin with ply");
  bool has_format = false;
  while (lines.next()) {
    rest = lines.line();
    const std::string_view keyword = take_word(rest);
    if (keyword == "end_header") {
      if (!has_format) lines.fail_here(ErrorCode::kSyntax, "the header has no format line");
      return header;
    }
    if (keyword == "format") {
      parse_format(lines, take_word(rest), header);
      has_format = true;
    } else if (keyword == "element") {
      header.elements.push_back(parse_element(lines, rest));
    } else if (keyword == "property") {
      if (header.elements.empty()) lines.fail_here(ErrorCode::kSyntax, "a property before any element");
      header.elements.back().properties.push_back(parse_property(lines, rest));
    } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
      lines.fail_here(ErrorCode::kSyntax, "{} does not belong into a PLY header", quote_word(keyword));
    }
  }
  lines.fail_here(ErrorCode::kSyntax, "the header has no end_header line");
}

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
std::size_t count_known(const Element& vertex, std::string_view known, bool binary) {
  return static_cast<std::size_t>(std::count_if(
      vertex.properties.begin(), vertex.properties.end(),
      [&](const Property& p) { return known_name(p.name) == known && (!binary || p.type.is_float); }));
}

// ASCII values are words, whatever their type.
std::string_view scalar_name(const Type& type, bool binary) {
  if (!binary) return "float";
  if (type.is_float) return type.bytes == 4 ? "float" : "double";
  return type.bytes == 1 ? "uchar" : type.bytes == 2 ? "ushort" : "int";
}
// OpenMesh knows just these types for the length of a list.
std::string_view length_name(const Type& type) {
  return type.bytes == 1 ? "uchar" : type.bytes == 2 ? "uint16" : "int";
}

void write_vertex(const Element& vertex, bool binary, const std::string& path, std::string& out) {
  for (const char* axis : {"x", "y", "z"})
    if (count_known(vertex, axis, binary) != 1)
      fail(ErrorCode::kUnsupported, path, "the vertices need one property {} of type float or double", axis);
  const auto has_all = [&](std::initializer_list<std::string_view> names) {
    return std::all_of(names.begin(), names.end(),
                       [&](std::string_view name) { return count_known(vertex, name, binary) == 1; });
  };
  const bool normals = has_all({"nx", "ny", "nz"}), uvs = has_all({"u", "v"});
  for (const Property& p : vertex.properties) {
    std::string_view name = known_name(p.name);
    const bool wanted = name.size() == 2 ? normals : name == "u" || name == "v" ? uvs : !name.empty();
    if (!wanted || (binary && !p.type.is_float)) name = "unused";
    out += fmt::format("property {} {}\n", scalar_name(p.type, binary), name);
  }
}

void write_face(const Element& face, bool binary, const std::string& path, std::string& out) {
  if (face.properties.empty() || !face.properties[0].list ||
      (face.properties[0].name != "vertex_indices" && face.properties[0].name != "vertex_index") ||
      (binary && face.properties[0].type.is_float))
    fail(ErrorCode::kUnsupported, path, "the first property of a face has to be the list vertex_indices");
  const Type& index = face.properties[0].type;
  // In binary OpenMesh reads an index by its sign, which for a valid one does not matter.
  out += fmt::format("property list {} {} vertex_indices\n", length_name(*face.properties[0].list),
                     binary ? scalar_name(index, true) : "int");
  for (std::size_t i = 1; i < face.properties.size(); ++i)
    out += fmt::format("property {} unused\n", scalar_name(face.properties[i].type, binary));
}

// The fewest bytes that an element takes.
std::uint64_t smallest_size(const Element& element, bool binary) {
  std::uint64_t bytes = 0;
  for (const Property& p : element.properties) bytes += !binary ? 2 : p.list ? p.list->bytes : p.type.bytes;
  return bytes;
}

}  // namespace

GuardedFile guard_ply(std::string content, const std::string& path) {
  LineReader lines(content, path);
  const Header header = parse_header(lines);
  const auto body = static_cast<std::size_t>(lines.line().data() - content.data()) + lines.line().size() + 1;
  const std::uint64_t body_bytes = content.size() > body ? content.size() - body : 0;

  GuardedFile file;
  file.binary = header.binary;
  std::string out = fmt::format("ply\nformat {} 1.0\n", !header.binary      ? "ascii"
                                                        : header.big_endian ? "binary_big_endian"
                                                                            : "binary_little_endian");
  bool has_vertices = false, has_faces = false;
  std::uint64_t needed_bytes = 0;
  for (const Element& element : header.elements) {
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
      for (const Property& p : element.properties)
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
  content.replace(0, std::min(body, content.size()), out);
  if (!file.binary) content += '\n';
  file.content = std::move(content);
  return file;
}

}  // namespace nacre
