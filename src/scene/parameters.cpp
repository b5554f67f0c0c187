// Look-up, type and range checks of parameters; warnings for those that nothing reads.
#include "scene/parameters.h"

#include <algorithm>
#include <map>

#include "nacre/scene/scene.h"
#include "scene/values.h"

namespace nacre {
namespace {

constexpr std::string_view kValueTags[] = {"integer", "float", "boolean", "string",   "point",
                                           "vector",  "rgb",   "srgb",    "spectrum", "transform"};

bool is_value(const XmlElement& element) {
  return std::ranges::find(kValueTags, element.tag) != std::end(kValueTags);
}

// <texture name="reflectance">, or a <ref> to one in its place: parameters of surfaces and media.
bool is_texture(const XmlElement& element, const XmlElement& plugin) {
  if (plugin.tag != "bsdf" && plugin.tag != "subsurface") return false;
  return element.tag == "texture" || (element.tag == "ref" && element.has("name"));
}

// Equal for toWorld and to_world.
std::string canonical(std::string_view name) {
  std::string key = to_lower(name);
  std::erase(key, '_');
  return key;
}

[[noreturn]] void fail_type(const XmlElement& element, std::string_view name, std::string_view expected) {
  fail(ErrorCode::kValue, element.place(), "{} has to be {}, not <{}>", name, expected, element.tag);
}

void check_range(double number, const Range& range, std::string_view name, const XmlElement& element) {
  const auto value = static_cast<float>(number);  // as it will be used, and short in the message
  const bool inside =
      range.open ? value > range.low && value < range.high : value >= range.low && value <= range.high;
  if (inside) return;
  if (range.high == kUnbounded)
    fail(ErrorCode::kValue, element.place(), "{} is {}, it has to be {} {}", name, value,
         range.open ? "above" : "at least", range.low);
  fail(ErrorCode::kValue, element.place(), "{} is {}, it has to be {} {} {} {}", name, value,
       range.open ? "above" : "from", range.low, range.open ? "and below" : "to", range.high);
}

}  // namespace

Parameters::Parameters(const XmlElement& plugin, Warnings& warnings) : plugin_(plugin), warnings_(warnings) {
  std::map<std::string, std::size_t> lines;
  for (const XmlElement& child : plugin.children) {
    if (!is_value(child) && !is_texture(child, plugin)) continue;
    if (!child.has("name"))
      fail(ErrorCode::kSyntax, child.place(),
           "<{}> lacks the attribute 'name': the parameter of {} it is for", child.tag, name());
    std::string key = canonical(child.get("name"));
    if (const auto [first, is_new] = lines.emplace(key, child.line); !is_new)
      fail(ErrorCode::kSyntax, child.place(), "{} is given twice, first in line {}", child.get("name"),
           first->second);
    entries_.push_back({&child, std::move(key), false});
  }
}

const XmlElement* Parameters::find(std::string_view name) {
  if (std::ranges::find(known_, name) == known_.end()) known_.emplace_back(name);
  const std::string key = canonical(name);
  for (Entry& entry : entries_)
    if (entry.key == key) {
      entry.known = true;
      return entry.element;
    }
  return nullptr;
}

float Parameters::number(std::string_view name, float fallback, const Range& range) {
  const XmlElement* element = find(name);
  if (!element) return fallback;
  if (element->tag != "float" && element->tag != "integer") fail_type(*element, name, "a <float>");
  const float value = static_cast<float>(parse_number(element->get("value"), name, *element));
  check_range(value, range, name, *element);
  return value;
}

int Parameters::integer(std::string_view name, int fallback, int low, int high) {
  const XmlElement* element = find(name);
  if (!element) return fallback;
  if (element->tag != "integer") fail_type(*element, name, "an <integer>");
  const double value = parse_number(element->get("value"), name, *element);
  if (value != std::floor(value))
    fail(ErrorCode::kValue, element->place(), "{}: '{}' is not an integer", name, element->get("value"));
  if (value < low || value > high)
    fail(ErrorCode::kValue, element->place(), "{} is {}, it has to be from {} to {}", name,
         element->get("value"), low, high);
  return static_cast<int>(value);
}

bool Parameters::boolean(std::string_view name, bool fallback) {
  const XmlElement* element = find(name);
  if (!element) return fallback;
  if (element->tag != "boolean") fail_type(*element, name, "a <boolean>");
  const std::string text = to_lower(element->get("value"));
  if (text != "true" && text != "false")
    fail(ErrorCode::kValue, element->place(), "{} is '{}', it has to be true or false", name,
         element->get("value"));
  return text == "true";
}

std::string Parameters::string(std::string_view name, const std::string& fallback) {
  const XmlElement* element = find(name);
  if (!element) return fallback;
  if (element->tag != "string") fail_type(*element, name, "a <string>");
  return element->get("value");
}

Vec3d Parameters::triple(std::string_view name, const Vec3d& fallback) {
  const XmlElement* element = find(name);
  if (!element) return fallback;
  if (element->tag != "point" && element->tag != "vector") fail_type(*element, name, "a <point> or <vector>");
  return parse_triple(*element, std::nullopt);
}

Rgb Parameters::color(std::string_view name, const Rgb& fallback, const Range& range) {
  const XmlElement* element = find(name);
  if (!element) return fallback;
  const std::optional<Rgb> color = parse_color(*element);
  if (!color) fail_type(*element, name, "an <rgb>, <srgb>, <spectrum> or <float>");
  for (int k = 0; k < 3; ++k) check_range((*color)[k], range, name, *element);
  return *color;
}

ColorOrTexture Parameters::color_or_texture(std::string_view name, const Rgb& fallback, const Range& range,
                                            const TextureIndex& textures) {
  const XmlElement* element = find(name);
  if (element && is_texture(*element, plugin_)) return {Rgb(1, 1, 1), textures(*element)};
  return {color(name, fallback, range), kNone};
}

Matrix4 Parameters::transform(std::string_view name) {
  const XmlElement* element = find(name);
  if (!element) return {};
  if (element->tag != "transform") fail_type(*element, name, "a <transform>");
  return parse_transform(*element);
}

float Parameters::ior(std::string_view name, std::string_view fallback) {
  const XmlElement* element = find(name);
  if (!element) return *find_ior(fallback);
  if (element->tag != "string") return number(name, 0, {0.1, 10});
  const std::optional<float> value = find_ior(element->get("value"));
  if (!value)
    fail(ErrorCode::kValue, element->place(), "{}: there is no index of refraction for '{}'; known: {}", name,
         element->get("value"), ior_names());
  return *value;
}

float Parameters::length_mm(std::string_view name, float fallback) {
  const XmlElement* element = find(name);
  if (!element) return fallback;
  if (element->tag != "string") return number(name, 0, kPositive);
  std::string text = element->get("value");
  if (text.ends_with("mm")) text.resize(text.size() - 2);
  const auto value = static_cast<float>(parse_number(text, name, *element));
  check_range(value, kPositive, name, *element);
  return value;
}

int Parameters::choice(std::string_view name, std::span<const std::string_view> choices) {
  const std::string text = to_lower(string(name, std::string(choices.front())));
  const auto found = std::ranges::find(choices, text);
  if (found == choices.end())
    fail(ErrorCode::kValue, place(name), "{} is '{}', it has to be one of {}", name, text,
         fmt::join(choices, ", "));
  return static_cast<int>(found - choices.begin());
}

std::string Parameters::place(std::string_view name) {
  const XmlElement* element = find(name);
  return (element ? *element : plugin_).place();
}

std::string Parameters::name() const {
  return plugin_.has("type") ? fmt::format("{} '{}'", plugin_.tag, plugin_.get("type")) : plugin_.tag;
}

void Parameters::finish(std::initializer_list<std::string_view> children,
                        std::initializer_list<std::string_view> accepted) {
  for (const XmlElement& child : plugin_.children)
    if (!is_value(child) && !is_texture(child, plugin_) &&
        std::ranges::find(children, child.tag) == children.end())
      fail(ErrorCode::kSyntax, child.place(), "<{}> cannot stand inside {}", child.tag, name());
  for (const Entry& entry : entries_) {
    const bool quiet = std::ranges::any_of(accepted, [&](auto a) { return canonical(a) == entry.key; });
    if (entry.known || quiet) continue;
    const std::string known = known_.empty() ? "none" : fmt::format("{}", fmt::join(known_, ", "));
    if (is_texture(*entry.element, plugin_))
      fail(ErrorCode::kUnsupported, entry.element->place(),
           "{} has no parameter '{}' for a texture (there are: {})", name(), entry.element->get("name"),
           known);
    warnings_.push_back(fmt::format("{}: {} has no parameter '{}', ignored (there are: {})",
                                    entry.element->place(), name(), entry.element->get("name"), known));
  }
}

std::string plugin_type(const XmlElement& plugin) { return to_lower(plugin.get("type")); }

void fail_unknown_type(const XmlElement& plugin, std::string_view known) {
  fail(ErrorCode::kUnsupported, plugin.place(), "{} '{}' is not supported; there is {}", plugin.tag,
       plugin.get("type"), known);
}

}  // namespace nacre
