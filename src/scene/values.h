// Values as they are written in attributes: numbers, triples, colours, transforms.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "nacre/base/math.h"
#include "scene/scene_xml.h"

namespace nacre {

/// A finite decimal number, "1.5e-3"; white space around it is allowed. Throws Error(kValue) with the
/// element's line; `what` names the value in the message.
double parse_number(const std::string& text, std::string_view what, const XmlElement& element);
/// Numbers separated by commas or white space.
std::vector<double> parse_numbers(const std::string& text, std::string_view what, const XmlElement& element);
/// Attributes x, y, z (absent ones are `fallback`; without a fallback they are needed) or value="x, y, z".
Vec3d parse_triple(const XmlElement& element, std::optional<double> fallback);
/// <rgb>, <srgb>, <spectrum>, <float> or <integer>; nullopt for another element.
std::optional<Rgb> parse_color(const XmlElement& element);
/// Operations of a <transform>, the first one applied first.
Matrix4 parse_transform(const XmlElement& transform);
/// Mitsuba's camera space: z from origin to target, y up, x to the left. nullopt if the three do not span it.
std::optional<Matrix4> look_at(const Vec3d& origin, const Vec3d& target, const Vec3d& up);
/// Index of refraction by name ("bk7", "water ice"), case does not count.
std::optional<float> find_ior(std::string_view name);
/// All names that find_ior knows, separated by commas.
std::string ior_names();

std::string to_lower(std::string_view text);

}  // namespace nacre
