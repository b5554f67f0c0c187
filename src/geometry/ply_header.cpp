// Parsing of PLY headers.
#include "geometry/ply_header.h"

#include <limits>

namespace nacre {
namespace {

PlyType parse_type(const LineReader& lines, std::string_view word) {
  struct Name {
    std::string_view first, second;
    PlyType type;
  };
  constexpr Name names[] = {{"char", "int8", {1, false}},    {"uchar", "uint8", {1, false, false}},
                            {"short", "int16", {2, false}},  {"ushort", "uint16", {2, false, false}},
                            {"int", "int32", {4, false}},    {"uint", "uint32", {4, false, false}},
                            {"float", "float32", {4, true}}, {"double", "float64", {8, true}}};
  for (const Name& name : names)
    if (word == name.first || word == name.second) return name.type;
  lines.fail_here(ErrorCode::kSyntax, "{} is not a type of PLY", quote_word(word));
}

void parse_format(const LineReader& lines, std::string_view word, PlyHeader& header) {
  if (word != "ascii" && word != "binary_little_endian" && word != "binary_big_endian")
    lines.fail_here(ErrorCode::kUnsupported, "{} is not a format of PLY", quote_word(word));
  header.binary = word != "ascii";
  header.big_endian = word == "binary_big_endian";
}

PlyElement parse_element(const LineReader& lines, std::string_view rest) {
  PlyElement element;
  element.name = take_word(rest);
  const std::int64_t count = lines.parse_integer(take_word(rest), "an element");
  if (count < 0 || count > std::numeric_limits<std::int32_t>::max())
    lines.fail_here(ErrorCode::kSyntax, "a count of {} elements is out of range", count);
  element.count = static_cast<std::uint64_t>(count);
  return element;
}

PlyProperty parse_property(const LineReader& lines, std::string_view rest) {
  PlyProperty property;
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

}  // namespace

std::uint64_t smallest_size(const PlyElement& element, bool binary) {
  std::uint64_t bytes = 0;
  for (const PlyProperty& p : element.properties)
    bytes += !binary ? 2 : p.list ? p.list->bytes : p.type.bytes;
  return bytes;
}

PlyHeader parse_ply_header(LineReader& lines) {
  PlyHeader header;
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
    } else if (keyword == "comment") {
      header.comments.emplace_back(rest);
    } else if (!keyword.empty() && keyword != "obj_info") {
      lines.fail_here(ErrorCode::kSyntax, "{} does not belong into a PLY header", quote_word(keyword));
    }
  }
  lines.fail_here(ErrorCode::kSyntax, "the header has no end_header line");
}

}  // namespace nacre
