// Numbers, triples, colours, transforms and indices of refraction from text.
#include "scene/values.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "scene/spectrum.h"

namespace nacre {
namespace {

constexpr std::string_view kSpace = " \t\r\n";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kSpace);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpace) - first + 1);
}

std::vector<std::string> split(std::string_view text, std::string_view separators) {
  std::vector<std::string> tokens;
  for (std::size_t at = 0; (at = text.find_first_not_of(separators, at)) != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(separators, at), text.size());
    tokens.emplace_back(text.substr(at, end - at));
    at = end;
  }
  return tokens;
}

std::string label(const XmlElement& element) {
  return element.has("name") ? element.get("name") : "<" + element.tag + ">";
}

// #rrggbb as fractions of 255.
std::optional<Vec3d> parse_hex(std::string_view text) {
  unsigned bits = 0;
  if (text.size() != 7 || text[0] != '#') return std::nullopt;
  const auto [end, error] = std::from_chars(text.data() + 1, text.data() + 7, bits, 16);
  if (error != std::errc{} || end != text.data() + 7) return std::nullopt;
  return Vec3d((bits >> 16) & 255, (bits >> 8) & 255, bits & 255) / 255.0;
}

Rgb parse_spectrum(const XmlElement& element) {
  std::vector<std::pair<double, double>> samples;
  for (const std::string& token : split(element.get("value"), " ,\t\r\n")) {
    const std::size_t colon = token.find(':');
    if (colon == std::string::npos)
      fail(ErrorCode::kValue, element.place(), "{}: '{}' is not a pair WAVELENGTH:VALUE", label(element),
           token);
    samples.emplace_back(parse_number(token.substr(0, colon), label(element), element),
                         parse_number(token.substr(colon + 1), label(element), element));
    if (samples.size() > 1 && samples.back().first <= samples[samples.size() - 2].first)
      fail(ErrorCode::kValue, element.place(), "{}: wavelengths have to increase, {} nm does not",
           label(element), samples.back().first);
  }
  return spectrum_to_rgb(samples);
}

Matrix4 parse_operation(const XmlElement& element) {
  Matrix4 matrix;
  if (element.tag == "translate") {
    matrix.setTranslation(parse_triple(element, 0.0));
  } else if (element.tag == "scale") {
    const bool uniform =
        element.attributes.size() == 1 && split(element.get("value"), " ,\t\r\n").size() == 1;
    const Vec3d factors =
        uniform ? Vec3d(parse_number(element.get("value"), "scale", element)) : parse_triple(element, 1.0);
    if (factors.x * factors.y * factors.z == 0)
      fail(ErrorCode::kValue, element.place(), "<scale> by 0 leaves nothing of the object");
    matrix.setScale(factors);
  } else if (element.tag == "rotate") {
    const Vec3d axis = parse_triple(element, 0.0);
    if (axis.length() == 0) fail(ErrorCode::kValue, element.place(), "<rotate> has no axis: give x, y or z");
    matrix.setAxisAngle(axis.normalized(),
                        parse_number(element.get("angle"), "angle", element) * kPiD / 180.0);
  } else if (element.tag == "lookat") {
    Vec3d points[3] = {{}, {}, {0, 1, 0}};
    int i = 0;
    for (const char* name : {"origin", "target", "up"}) {
      const std::vector<double> n =
          element.has(name) ? parse_numbers(element.get(name), name, element) : std::vector{0.0, 1.0, 0.0};
      if (n.size() != 3)
        fail(ErrorCode::kValue, element.place(), "<lookat> {}: expected three numbers, got '{}'", name,
             element.get(name));
      points[i++] = {n[0], n[1], n[2]};
    }
    const std::optional<Matrix4> view = look_at(points[0], points[1], points[2]);
    if (!view)
      fail(ErrorCode::kValue, element.place(),
           "<lookat>: origin and target have to differ, and up must not point along the line between them");
    matrix = *view;
  } else {  // matrix: rows of a matrix for column vectors, where Imath has row vectors
    const std::vector<double> m = parse_numbers(element.get("value"), "matrix", element);
    if (m.size() != 16)
      fail(ErrorCode::kValue, element.place(), "<matrix> has {} numbers, it needs 16", m.size());
    if (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)
      fail(ErrorCode::kValue, element.place(), "the last row of <matrix> has to be 0 0 0 1");
    for (int row = 0; row < 4; ++row)
      for (int column = 0; column < 4; ++column)
        matrix[column][row] = m[4 * static_cast<std::size_t>(row) + static_cast<std::size_t>(column)];
  }
  return matrix;
}

// Around 589 nm, at 0 to 20 degrees Celsius; the names and values that Mitsuba 0.6 has.
constexpr std::pair<std::string_view, float> kIors[] = {
    {"vacuum", 1.0f},      {"helium", 1.000036f},        {"hydrogen", 1.000132f},
    {"air", 1.000277f},    {"carbon dioxide", 1.00045f}, {"water", 1.3330f},
    {"acetone", 1.36f},    {"ethanol", 1.361f},          {"carbon tetrachloride", 1.461f},
    {"glycerol", 1.4729f}, {"benzene", 1.501f},          {"silicone oil", 1.52045f},
    {"bromine", 1.661f},   {"water ice", 1.31f},         {"fused quartz", 1.458f},
    {"pyrex", 1.470f},     {"acrylic glass", 1.49f},     {"polypropylene", 1.49f},
    {"bk7", 1.5046f},      {"sodium chloride", 1.544f},  {"amber", 1.55f},
    {"pet", 1.5750f},      {"diamond", 2.419f},
};

}  // namespace

std::string to_lower(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return result;
}

double parse_number(const std::string& text, std::string_view what, const XmlElement& element) {
  std::string_view number = trimmed(text);
  if (number.starts_with('+') && !number.starts_with("+-")) number.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), value);
  // A float is what the value ends up as: what overflows one is no number here.
  if (error != std::errc{} || end != number.data() + number.size() ||
      !std::isfinite(static_cast<float>(value)))
    fail(ErrorCode::kValue, element.place(), "{}: '{}' is not a finite number", what, text);
  return value;
}

std::vector<double> parse_numbers(const std::string& text, std::string_view what, const XmlElement& element) {
  std::vector<double> numbers;
  for (const std::string& token : split(text, " ,\t\r\n"))
    numbers.push_back(parse_number(token, what, element));
  return numbers;
}

Vec3d parse_triple(const XmlElement& element, std::optional<double> fallback) {
  const bool by_axis = element.has("x") || element.has("y") || element.has("z");
  if (element.has("value") == by_axis)
    fail(ErrorCode::kSyntax, element.place(), "{}: give either x, y and z, or value=\"x, y, z\"",
         label(element));
  Vec3d result;
  if (element.has("value")) {
    const std::vector<double> n = parse_numbers(element.get("value"), label(element), element);
    if (n.size() != 3)
      fail(ErrorCode::kValue, element.place(), "{}: expected three numbers, got '{}'", label(element),
           element.get("value"));
    return {n[0], n[1], n[2]};
  }
  int i = 0;
  for (const char* axis : {"x", "y", "z"}) {
    if (!element.has(axis) && !fallback)
      fail(ErrorCode::kSyntax, element.place(), "{}: lacks the attribute '{}'", label(element), axis);
    result[i++] = element.has(axis) ? parse_number(element.get(axis), axis, element) : *fallback;
  }
  return result;
}

std::optional<Rgb> parse_color(const XmlElement& element) {
  const bool srgb = element.tag == "srgb", spectrum = element.tag == "spectrum";
  if (element.tag == "float" || element.tag == "integer")
    return Rgb(static_cast<float>(parse_number(element.get("value"), label(element), element)));
  if (element.tag != "rgb" && !srgb && !spectrum) return std::nullopt;

  const std::string& text = element.get("value");
  if (spectrum && text.find(':') != std::string::npos) return parse_spectrum(element);
  Vec3d color;
  if (const std::optional<Vec3d> hex = spectrum ? std::nullopt : parse_hex(trimmed(text))) {
    color = *hex;
  } else {
    const std::vector<double> n = parse_numbers(text, label(element), element);
    if (n.size() != 1 && n.size() != 3)
      fail(ErrorCode::kValue, element.place(), "{}: expected one number or three, got '{}'", label(element),
           text);
    color = n.size() == 1 ? Vec3d(n[0]) : Vec3d(n[0], n[1], n[2]);
  }
  if (srgb) color = {decode_srgb(color.x), decode_srgb(color.y), decode_srgb(color.z)};
  return Rgb(static_cast<float>(color.x), static_cast<float>(color.y), static_cast<float>(color.z));
}

Matrix4 parse_transform(const XmlElement& transform) {
  Matrix4 matrix;
  for (const XmlElement& element : transform.children) {
    constexpr std::string_view kOperations[] = {"translate", "scale", "rotate", "lookat", "matrix"};
    if (std::ranges::find(kOperations, element.tag) == std::end(kOperations))
      fail(ErrorCode::kSyntax, element.place(), "<{}> cannot stand inside <transform>", element.tag);
    matrix = matrix * parse_operation(element);
  }
  return matrix;
}

std::optional<Matrix4> look_at(const Vec3d& origin, const Vec3d& target, const Vec3d& up) {
  const Vec3d z = (target - origin).normalized();
  const Vec3d x = up.normalized().cross(z);
  if (!(x.length() > 1e-9)) return std::nullopt;
  const Vec3d left = x.normalized(), y = z.cross(left);
  return Matrix4(left.x, left.y, left.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, origin.x, origin.y, origin.z,
                 1);
}

std::optional<float> find_ior(std::string_view name) {
  const std::string key = to_lower(trimmed(name));
  for (const auto& [known, value] : kIors)
    if (known == key) return value;
  return std::nullopt;
}

std::string ior_names() {
  std::string list;
  for (const auto& [name, value] : kIors) list += (list.empty() ? "" : ", ") + std::string(name);
  return list;
}

}  // namespace nacre
