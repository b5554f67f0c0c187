// Guards for OBJ, STL and OFF files.
#include "geometry/mesh_guard.h"

#include <OpenMesh/Core/IO/reader/OFFReader.hh>
#include <array>
#include <cstring>
#include <vector>

#include "geometry/text_lines.h"

namespace nacre {
namespace {

// OpenMesh looks for repeated vertices of an OBJ face in quadratic time.
constexpr std::size_t kMaxObjCorners = 4096;

std::string to_lower(std::string_view word) {
  std::string lower(word);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

// How many v, vt and vn lines there are, and the largest index that a face used of each.
struct ObjCounts {
  std::array<std::int64_t, 3> defined{}, largest{};
  std::array<std::uint64_t, 3> line_of_largest{};
};

// One corner: v, v/vt, v//vn or v/vt/vn, each counting from 1, or from -1 backwards.
void check_obj_corner(const LineReader& lines, std::string_view corner, ObjCounts& counts) {
  const char* const names[] = {"vertex", "texture coordinate", "normal"};
  for (std::size_t part = 0;; ++part) {
    if (part == 3) lines.fail_here(ErrorCode::kSyntax, "a corner of a face has more than three indices");
    const std::size_t slash = corner.find('/');
    const std::string_view word = corner.substr(0, slash);
    if (!word.empty() || part == 0) {
      const std::int64_t index = lines.parse_integer(word, "a face");
      if (index == 0 || index < -counts.defined[part])
        lines.fail_here(ErrorCode::kSyntax, "a face uses {} {}, which does not exist", names[part], index);
      if (index > counts.largest[part]) {
        counts.largest[part] = index;
        counts.line_of_largest[part] = lines.number();
      }
    }
    if (slash == std::string_view::npos) return;
    corner.remove_prefix(slash + 1);
  }
}

// Joins lines that end in a backslash with the next one.
void join_lines(std::string& text) {
  for (std::size_t at = text.find('\\'); at != std::string::npos; at = text.find('\\', at + 1)) {
    std::size_t end = at + 1;
    if (end < text.size() && text[end] == '\r') ++end;
    if (end >= text.size() || text[end] != '\n') continue;
    for (std::size_t i = at; i <= end; ++i) text[i] = ' ';
  }
}

void check_stl_binary(const std::string& content, std::uint32_t triangles, const std::string& path) {
  for (std::uint32_t i = 0; i < triangles; ++i) {
    std::array<float, 12> values;  // normal, three vertices
    std::memcpy(values.data(), content.data() + 84 + std::size_t{50} * i, sizeof values);
    for (std::size_t k = 3; k < 12; ++k)
      if (!std::isfinite(values[k]))
        fail(ErrorCode::kValue, path, "triangle {}: a coordinate is not a finite number", i);
  }
}

// OpenMesh takes every line with "outer" in it for the beginning of a triangle and the three lines after it
// for vertices: nothing but these lines is left.
std::uint64_t keep_stl_loops(std::string& content, const std::string& path) {
  LineReader lines(content, path);
  std::uint64_t loops = 0;
  while (lines.next()) {
    std::string_view rest = lines.line();
    const std::string_view word = take_word(rest);
    if (to_lower(word) != "outer") {
      if (to_lower(word) == "vertex") lines.fail_here(ErrorCode::kSyntax, "a vertex outside of a loop");
      lines.blank(lines.line());
      continue;
    }
    content.replace(static_cast<std::size_t>(word.data() - content.data()), 5, "outer");
    ++loops;
    for (int i = 0; i < 3; ++i) {
      if (!lines.next() || to_lower(take_word(rest = lines.line())) != "vertex")
        lines.fail_here(ErrorCode::kSyntax, "a loop needs three vertices on the next three lines");
      for (int k = 0; k < 3; ++k) lines.take_number(rest, "a vertex");
    }
  }
  return loops;
}

struct OffFlavour {
  bool normals = false, uvs = false;
};

// [ST][C][N]OFF; colours need no attention since they are blanked out.
OffFlavour parse_off_flavour(const LineReader& lines, std::string_view word, std::string_view rest) {
  OffFlavour flavour;
  const auto take = [&](std::string_view prefix) {
    const bool found = word.starts_with(prefix);
    if (found) word.remove_prefix(prefix.size());
    return found;
  };
  flavour.uvs = take("ST");
  take("C");
  flavour.normals = take("N");
  if (word == "4OFF" || word == "nOFF" || word == "4nOFF")
    lines.fail_here(ErrorCode::kUnsupported, "only three-dimensional OFF files can be read");
  if (word != "OFF") lines.fail_here(ErrorCode::kSyntax, "an OFF file has to begin with OFF");
  if (take_word(rest) == "BINARY")
    lines.fail_here(ErrorCode::kUnsupported, "binary OFF files cannot be read: convert it to PLY");
  return flavour;
}

// x y z [nx ny nz] [colour] [u v]; the colour is blanked out.
void check_off_vertex(LineReader& lines, const OffFlavour& flavour) {
  std::string_view rest = lines.line();
  for (int i = 0; i < (flavour.normals ? 6 : 3); ++i) lines.take_number(rest, "a vertex");
  std::string_view uv = rest.substr(rest.size());
  if (flavour.uvs) {
    std::string_view before_last, last = uv;
    for (std::string_view tail = rest, word; !(word = take_word(tail)).empty(); last = word)
      before_last = last;
    if (before_last.empty()) lines.fail_here(ErrorCode::kSyntax, "a vertex has no texture coordinates");
    uv = rest.substr(static_cast<std::size_t>(before_last.data() - rest.data()));
  }
  lines.blank(rest.substr(0, rest.size() - uv.size()));
  for (int i = 0; i < (flavour.uvs ? 2 : 0); ++i) lines.take_number(uv, "a texture coordinate");
}

void check_off_face(LineReader& lines, std::int64_t vertices) {
  std::string_view rest = lines.line();
  const std::int64_t corners = lines.parse_integer(take_word(rest), "a face");
  if (corners < 0) lines.fail_here(ErrorCode::kSyntax, "a face has {} corners", corners);
  for (std::int64_t i = 0; i < corners; ++i) {
    const std::int64_t index = lines.parse_integer(take_word(rest), "a face");
    if (index < 0 || index >= vertices)
      lines.fail_here(ErrorCode::kSyntax, "a face uses vertex {} of {}", index, vertices);
  }
  lines.blank(rest);
}

}  // namespace

GuardedFile guard_obj(std::string content, const std::string& path) {
  GuardedFile file{std::move(content)};
  join_lines(file.content);
  LineReader lines(file.content, path);
  ObjCounts counts;
  while (lines.next()) {
    std::string_view rest = lines.line();
    const std::string_view keyword = take_word(rest);
    if (keyword == "v" || keyword == "vn") {
      for (int i = 0; i < 3; ++i) lines.take_number(rest, keyword == "v" ? "a vertex" : "a normal");
      ++counts.defined[keyword == "v" ? 0 : 2];
    } else if (keyword == "vt") {
      for (int i = 0; i < 2; ++i) lines.take_number(rest, "a texture coordinate");
      ++counts.defined[1];
    } else if (keyword == "f") {
      std::size_t corners = 0;
      for (std::string_view corner; !(corner = take_word(rest)).empty(); ++corners)
        check_obj_corner(lines, corner, counts);
      if (corners < 3) lines.fail_here(ErrorCode::kSyntax, "a face has {} corners", corners);
      if (corners > kMaxObjCorners)
        lines.fail_here(ErrorCode::kUnsupported, "a face has more than {} corners", kMaxObjCorners);
      ++file.faces;
    } else {
      lines.blank(lines.line());  // materials, groups, lines, comments
    }
  }
  for (std::size_t part = 0; part < 3; ++part)
    if (counts.largest[part] > counts.defined[part])
      fail(ErrorCode::kSyntax, path, "line {}: a face uses number {} of {} {}", counts.line_of_largest[part],
           counts.largest[part], counts.defined[part],
           part == 0   ? "vertices"
           : part == 1 ? "texture coordinates"
                       : "normals");
  return file;
}

GuardedFile guard_stl(std::string content, const std::string& path) {
  GuardedFile file{std::move(content)};
  const std::uint64_t size = file.content.size();
  std::uint32_t triangles = 0;
  if (size >= 84) std::memcpy(&triangles, file.content.data() + 80, 4);
  const std::uint64_t expected = 84 + std::uint64_t{50} * triangles;
  // The word solid alone does not tell: some programs begin binary files with it.
  std::string_view start = std::string_view(file.content).substr(0, 80);
  const bool says_solid = to_lower(take_word(start)).starts_with("solid");
  if (says_solid && size != expected) {
    file.faces = keep_stl_loops(file.content, path);
    return file;
  }
  if (size < 84) fail(ErrorCode::kSyntax, path, "neither an ASCII nor a binary STL file");
  if (size < expected)
    fail(ErrorCode::kSyntax, path,
         "a binary STL file of {} triangles has {} bytes, but this one has {}: truncated?", triangles,
         expected, size);
  file.content.resize(expected);
  check_stl_binary(file.content, triangles, path);
  file.binary = true;
  file.faces = triangles;
  return file;
}

GuardedFile guard_off(std::string content, const std::string& path) {
  GuardedFile file{std::move(content)};
  std::string& text = file.content;
  if (!text.ends_with('\n')) text += '\n';
  bool in_comment = false;
  for (char& c : text) {
    in_comment = c != '\n' && (in_comment || c == '#');
    if (in_comment || is_blank(c)) c = ' ';
  }

  LineReader lines(text, path);
  lines.require_next("OFF");
  std::string_view rest = lines.line();
  const std::string_view header = take_word(rest);
  const OffFlavour flavour = parse_off_flavour(lines, header, rest);
  if ((flavour.normals || flavour.uvs) && header.data() != text.data())
    lines.fail_here(ErrorCode::kUnsupported, "the file has to begin with {}", quote_word(header));
  OpenMesh::IO::OFFReader().can_u_read(path);
  // OpenMesh skips one line, whatever it holds, before the counts.
  const auto header_end = rest.data() - text.data();
  std::fill(text.begin(), text.begin() + header_end, ' ');
  text[static_cast<std::size_t>(header_end)] = '\n';
  if (rest.find_first_not_of(" \t\r\n\v\f") == std::string_view::npos) {
    lines.require_next("the number of vertices");
    rest = lines.line();
  } else {
    rest.remove_prefix(1);
  }
  std::array<std::int64_t, 3> counts;  // vertices, faces, edges
  for (std::int64_t& count : counts) {
    count = lines.parse_integer(take_word(rest), "the counts of vertices, faces and edges");
    if (count < 0) lines.fail_here(ErrorCode::kSyntax, "the count {} is negative", count);
  }
  lines.blank(rest);
  for (std::int64_t i = 0; i < counts[0]; ++i) {
    lines.require_next("a vertex");
    check_off_vertex(lines, flavour);
  }
  for (std::int64_t i = 0; i < counts[1]; ++i) {
    lines.require_next("a face");
    check_off_face(lines, counts[0]);
  }
  file.faces = static_cast<std::uint64_t>(counts[1]);
  return file;
}

}  // namespace nacre
