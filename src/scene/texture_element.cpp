// <texture>: bitmap, checkerboard.
#include <algorithm>

#include "scene/elements.h"

namespace nacre {
namespace {

// What a reflectance cannot be is cut off: pictures of light hold such values.
void clamp_texels(Bitmap& bitmap, const std::string& place, Warnings& warnings) {
  std::size_t outside = 0;
  for (Rgb& texel : bitmap.texels) {
    if (min_channel(texel) >= 0 && max_channel(texel) <= 1) continue;
    ++outside;
    for (int k = 0; k < 3; ++k) texel[k] = std::clamp(texel[k], 0.0f, 1.0f);
  }
  if (outside > 0)
    warnings.push_back(fmt::format("{}: {} of {} texels are not from 0 to 1 and are cut off", place, outside,
                                   bitmap.texels.size()));
}

WrapMode read_wrap(Parameters& parameters, std::string_view name, WrapMode fallback) {
  return parameters.has(name) ? static_cast<WrapMode>(parameters.choice(name, {"repeat", "mirror", "clamp"}))
                              : fallback;
}

BitmapTexture read_bitmap(Parameters& parameters, Warnings& warnings) {
  const std::string name = parameters.string("filename", "");
  const std::string place = parameters.place("filename");
  if (name.empty())
    fail(ErrorCode::kSyntax, place, "{} needs <string name=\"filename\" value=\"...\"/>", parameters.name());
  BitmapTexture texture;
  const WrapMode both = read_wrap(parameters, "wrapMode", WrapMode::kRepeat);
  texture.wrap_u = read_wrap(parameters, "wrapModeU", both);
  texture.wrap_v = read_wrap(parameters, "wrapModeV", both);
  texture.nearest = parameters.choice("filterType", {"bilinear", "nearest", "trilinear", "ewa"}) == 1;
  const float gamma = parameters.number("gamma", kGammaOfFormat, {-1, 10});
  if (gamma < 0 && gamma != kGammaSrgb)
    fail(ErrorCode::kValue, parameters.place("gamma"),
         "gamma is {}, it has to be -1 for sRGB, 0 for what the format has, or a positive exponent", gamma);
  texture.bitmap = load_bitmap(resolve_path(name, parameters.plugin()), place, gamma);
  clamp_texels(texture.bitmap, place, warnings);
  return texture;
}

}  // namespace

Texture read_texture(const XmlElement& element, Warnings& warnings) {
  Parameters parameters(element, warnings);
  Texture texture{element.get("id"), element.place(), CheckerboardTexture{}};
  const std::string type = plugin_type(element);
  if (type == "bitmap")
    texture.model = read_bitmap(parameters, warnings);
  else if (type == "checkerboard")
    texture.model = CheckerboardTexture{parameters.color("color0", Rgb(0.4f), kFraction),
                                        parameters.color("color1", Rgb(0.2f), kFraction)};
  else
    fail_unknown_type(element, "bitmap, checkerboard");
  constexpr Range kAny{-1e6, 1e6};
  texture.scale = {parameters.number("uscale", 1, kAny), parameters.number("vscale", 1, kAny)};
  texture.offset = {parameters.number("uoffset", 0, kAny), parameters.number("voffset", 0, kAny)};
  parameters.finish({}, {"maxAnisotropy", "cache"});
  return texture;
}

}  // namespace nacre
