// The key of a picture, and finding it again.
#include "picture.h"

#include <filesystem>

#include "nacre/base/file.h"
#include "nacre/base/simd.h"
#include "nacre/base/version.h"
#include "nacre/cache/fingerprint.h"
#include "nacre/geometry/mesh_file.h"

namespace nacre::tools {

void check_picture_name(const std::string& output) {
  std::string ending = std::filesystem::path(output).extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  for (const char* const other : {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".hdr", ".pfm", ".webp"})
    if (ending == other)
      throw UsageError("-o " + output +
                       ": pictures are OpenEXR; name it .exr, --png writes a preview beside it");
}

KeyValues make_conditions(const RenderOptions& options, const RenderParams& params, const Scene& scene,
                          const Cache& cache) {
  KeyValues conditions =
      make_fingerprint(scene, fingerprint_conditions(cache.fingerprint, scene.media.size()));
  for (const CacheGroup& group : cache.groups) conditions.emplace_back("samples", samples_digest(group));
  const auto add = [&](const char* name, const std::string& value) { conditions.emplace_back(name, value); };
  add("nacre", kVersion);
  for (const std::string& source : scene.sources) add("scene", bytes_digest(read_text_file(source)));
  add("contents", contents_digest(scene));
  for (const std::string& define : options.scene.defines) add("define", define);
  add("mesh", fmt::format("{} {}", options.scene.material, options.scene.height.value_or(0)));
  add("picture", fmt::format("{} {} {} {} {} {} {}", params.width, params.height, params.crop_x,
                             params.crop_y, params.crop_width, params.crop_height, params.samples_per_pixel));
  add("method", fmt::format("{} {} {} {} {} {}", options.method, params.tolerance, params.certified,
                            params.single_samples, params.mc_samples, static_cast<int>(params.mc_sampling)));
  add("channels", options.aovs);
  add("seed", fmt::format("{}", params.seed));
  const BakeOptions& bake = options.bake;
  add("bake", fmt::format("{} {} {} {} {} {}", bake.points.value_or(0), bake.spacing.value_or(0),
                          bake.irradiance_samples.value_or(0), bake.bounces.value_or(-1), bake.interreflect,
                          bake.irradiance_error.value_or(0)));
  add("shadows", bake.no_shadows ? "no" : "yes");
  add("simd", simd_target());
  return conditions;
}

bool is_complete(const Picture& picture) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(picture.path, error)) return false;
  try {
    const Image image = load_exr(picture.path);
    const auto key = image.metadata.find(kKeyAttribute);
    return key != image.metadata.end() && key->second == picture.key && check_seal(image) == Seal::kSound;
  } catch (const Error&) {
    return false;
  }
}

}  // namespace nacre::tools
