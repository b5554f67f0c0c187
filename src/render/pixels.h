// The sums of a picture's samples, layer by layer, and their way into an image.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "nacre/render/render.h"

namespace nacre {

enum class Layer : std::uint8_t { kDiffusion, kSingle, kSpecular, kSurface };
inline constexpr std::size_t kLayerCount = 4;

struct PixelBuffer {
  PixelBuffer(int buffer_width, int buffer_height, const AovSelection& aovs);

  int width, height;
  std::array<std::vector<Rgb>, kLayerCount> layers;
  std::vector<float> weight;    // filter weights of all samples
  std::vector<float> coverage;  // and of those that hit anything
  std::vector<Vec3> position, normal;
  std::vector<float> depth, object_id;
  std::vector<Rgb> irradiance;  // empty where it is not asked for
  std::vector<float> irradiance_error;

  void add(Layer layer, std::uint32_t pixel, const Rgb& value) {
    layers[static_cast<std::size_t>(layer)][pixel] += value;
  }
  /// Divides by the samples' weights and lays out the channels that are selected.
  Image make_image(const RenderParams& params) const;
};

}  // namespace nacre
