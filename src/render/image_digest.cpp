// The seal of a picture.
#include "render/image_digest.h"

#include <algorithm>

#include "nacre/base/parallel.h"
#include "nacre/cache/fingerprint.h"

namespace nacre {

std::string image_digest(const Image& image) {
  KeyValues parts(image.channels.size());
  parallel_for(parts.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Channel& channel = image.channels[i];
      parts[i] = {"channel " + channel.name,
                  bytes_digest({reinterpret_cast<const char*>(channel.values.data()),
                                channel.values.size() * sizeof(float)})};
    }
  });
  std::ranges::sort(parts);  // a file keeps them so
  parts.emplace_back("window", fmt::format("{} {} {} {} {} {}", image.full_width, image.full_height, image.x,
                                           image.y, image.width, image.height));
  for (const auto& [name, value] : image.metadata)
    if (name != kDigestKey) parts.emplace_back(name, value);
  return fingerprint_digest(parts);
}

Seal check_seal(const Image& image) {
  const auto seal = image.metadata.find(kDigestKey);
  if (seal == image.metadata.end()) return Seal::kAbsent;
  return seal->second == image_digest(image) ? Seal::kSound : Seal::kBroken;
}

}  // namespace nacre
