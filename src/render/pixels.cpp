// Channels of an image.
#include "render/pixels.h"

namespace nacre {

PixelBuffer::PixelBuffer(int buffer_width, int buffer_height, const AovSelection& aovs)
    : width(buffer_width), height(buffer_height) {
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  for (auto& layer : layers) layer.assign(count, Rgb(0, 0, 0));
  weight.assign(count, 0.0f);
  coverage.assign(count, 0.0f);
  position.assign(count, Vec3(0, 0, 0));
  normal.assign(count, Vec3(0, 0, 0));
  depth.assign(count, 0.0f);
  object_id.assign(count, 0.0f);
  if (aovs.irradiance) irradiance.assign(count, Rgb(0, 0, 0));
  if (aovs.irradiance_error) irradiance_error.assign(count, 0.0f);
}

Image PixelBuffer::make_image(const RenderParams& params) const {
  Image image;
  image.full_width = params.width;
  image.full_height = params.height;
  image.x = params.crop_x;
  image.y = params.crop_y;
  image.width = width;
  image.height = height;
  const std::size_t count = coverage.size();
  // Weights are 1 but where a filter has negative lobes: then a pixel of few samples may happen to have
  // hardly any weight in all, and is left darker rather than blown up.
  const float least = 0.5f * static_cast<float>(params.samples_per_pixel);
  const auto scale = [&](std::size_t i) { return 1.0f / std::max(weight[i], least); };
  const auto add = [&](const std::string& name, const auto& value) {
    Channel channel{name, std::vector<float>(count)};
    for (std::size_t i = 0; i < count; ++i) channel.values[i] = value(i);
    image.channels.push_back(std::move(channel));
  };
  const char* const kRgbNames[] = {"R", "G", "B"};
  const char* const kXyzNames[] = {"X", "Y", "Z"};
  const char* const kLayerNames[kLayerCount] = {"diffusion", "single", "specular", "surface"};
  // Beauty is the sum of the stored layers, rounded as a reader of the file would do it: from left to right.
  for (int k = 0; k < 3; ++k)
    add(kRgbNames[k], [&](std::size_t i) {
      float sum = layers[0][i][k] * scale(i);
      for (std::size_t l = 1; l < kLayerCount; ++l) sum += layers[l][i][k] * scale(i);
      return sum;
    });
  add("A", [&](std::size_t i) { return coverage[i] * scale(i); });
  if (params.aovs.layers)
    for (std::size_t l = 0; l < kLayerCount; ++l)
      for (int k = 0; k < 3; ++k)
        add(fmt::format("{}.{}", kLayerNames[l], kRgbNames[k]),
            [&](std::size_t i) { return layers[l][i][k] * scale(i); });
  for (int k = 0; k < 3; ++k) {
    if (params.aovs.position)
      add(fmt::format("position.{}", kXyzNames[k]), [&](std::size_t i) { return position[i][k]; });
    if (params.aovs.normal)
      add(fmt::format("normal.{}", kXyzNames[k]), [&](std::size_t i) { return normal[i][k]; });
  }
  if (params.aovs.depth) add("depth.Z", [&](std::size_t i) { return depth[i]; });
  for (int k = 0; k < 3 && params.aovs.irradiance; ++k)
    add(fmt::format("irradiance.{}", kRgbNames[k]), [&](std::size_t i) { return irradiance[i][k]; });
  if (params.aovs.irradiance_error)
    add("irradiance_error.Y", [&](std::size_t i) { return irradiance_error[i]; });
  if (params.aovs.object_id) add("object.id", [&](std::size_t i) { return object_id[i]; });
  return image;
}

}  // namespace nacre
