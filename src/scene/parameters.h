// The parameters of one plugin element, typed and checked.
#pragma once

#include <functional>
#include <initializer_list>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "nacre/base/math.h"
#include "scene/scene_xml.h"

namespace nacre {

/// Which numbers a parameter accepts; `open` excludes the limits themselves.
struct Range {
  double low = std::numeric_limits<double>::lowest(), high = std::numeric_limits<double>::max();
  bool open = false;
};
inline constexpr double kUnbounded = std::numeric_limits<double>::max();
inline constexpr Range kPositive{0, kUnbounded, true}, kNotNegative{0, kUnbounded}, kFraction{0, 1};

/// Index into Scene::textures of a <texture>, or of the one that a <ref> names.
using TextureIndex = std::function<int(const XmlElement&)>;

/// A colour, or a texture in its place.
struct ColorOrTexture {
  Rgb color;    // white if there is a texture
  int texture;  // kNone if there is not
};

/// Reads the parameters of a plugin (<shape>, <bsdf>, ...) by name; case and underscores do not count, so
/// that to_world is toWorld. Every getter returns `fallback` if the parameter is absent, and throws Error
/// with the line of the parameter if it is of another type, is not a finite number or is outside its range.
class Parameters {
 public:
  /// Throws Error(kSyntax) if a parameter is given twice.
  Parameters(const XmlElement& plugin, Warnings& warnings);

  float number(std::string_view name, float fallback, const Range& range);
  int integer(std::string_view name, int fallback, int low, int high);
  bool boolean(std::string_view name, bool fallback);
  std::string string(std::string_view name, const std::string& fallback);
  Vec3d triple(std::string_view name, const Vec3d& fallback);  // <point> or <vector>
  Rgb color(std::string_view name, const Rgb& fallback, const Range& range);
  ColorOrTexture color_or_texture(std::string_view name, const Rgb& fallback, const Range& range,
                                  const TextureIndex& textures);
  Matrix4 transform(std::string_view name);                     // identity if absent
  float ior(std::string_view name, std::string_view fallback);  // a number, or a name like "bk7"
  float length_mm(std::string_view name, float fallback);       // "50mm", "50" or a number
  /// Index of the string in `choices`.
  int choice(std::string_view name, std::span<const std::string_view> choices);
  int choice(std::string_view name, std::initializer_list<std::string_view> choices) {
    return choice(name, std::span(choices.begin(), choices.size()));
  }

  bool has(std::string_view name) { return find(name) != nullptr; }
  /// Line of the parameter, or of the plugin if it is absent.
  std::string place(std::string_view name);
  /// Throws Error(kSyntax) if a nested plugin is not of `children`, kUnsupported if a parameter that no
  /// getter has asked for is a texture; warns of parameters that no getter has asked for and that are not
  /// among those `accepted` without effect.
  void finish(std::initializer_list<std::string_view> children = {},
              std::initializer_list<std::string_view> accepted = {});

  const XmlElement& plugin() const { return plugin_; }
  /// For messages: "shape 'obj'".
  std::string name() const;

 private:
  struct Entry {
    const XmlElement* element;
    std::string key;
    bool known;
  };
  const XmlElement* find(std::string_view name);

  const XmlElement& plugin_;
  Warnings& warnings_;
  std::vector<Entry> entries_;
  std::vector<std::string> known_;
};

/// The plugin's type in lower case.
std::string plugin_type(const XmlElement& plugin);
/// Throws Error(kUnsupported): this type of bsdf, emitter, ... is not read; `known` lists those that are.
[[noreturn]] void fail_unknown_type(const XmlElement& plugin, std::string_view known);

}  // namespace nacre
