// Light from a cache: whether it is that of a scene, dense enough, and with which lights.
#pragma once

#include <string>
#include <vector>

#include "nacre/base/report.h"
#include "nacre/cache/cache.h"
#include "nacre/cache/relight.h"
#include "nacre/scene/scene.h"

namespace nacre::tools {

/// What the arguments of --light ("ID=SCALE", "ID=r,g,b"; the id of a light or of a group) come to, for each
/// light of the scene. Throws UsageError for what cannot be read, Error(kValue) for an id that no light has.
std::vector<Rgb> find_light_scales(const Scene& scene, const std::vector<std::string>& arguments,
                                   const std::string& place = "--light");

/// Multiplies what the lights send.
void scale_lights(Scene& scene, const std::vector<Rgb>& scales);

/// What planes of light are to be scaled by. Throws Error(kMismatch, path) for a cache of another scene,
/// saying what differs, for one that does not serve its indices of refraction, and where lights were baked
/// together that are to be scaled apart. Tells groups of a single index that it is the scene's.
std::vector<LightScale> check_cache(Cache& cache, const std::string& path, const Scene& scene, bool shadows,
                                    const std::vector<Rgb>& light_scales);

/// Loads a cache of the scene, its lights to be scaled. Throws as check_cache and load_cache.
ScaledCache load_scaled_cache(const std::string& path, const Scene& scene, bool shadows,
                              const std::vector<Rgb>& light_scales, Report& report);

/// Loads a cache and makes its irradiance that of the scene: its indices of refraction, its lights scaled.
/// Throws as load_scaled_cache.
Cache load_matching_cache(const std::string& path, const Scene& scene, bool shadows,
                          const std::vector<Rgb>& light_scales, Report& report);

/// The planes of light that a scene has and a cache lacks, which is that of the same scene without them.
/// Throws Error(kMismatch, path) where it is not, or a light is in a plane that is there already, or comes
/// with a new shape, which may shade what was baked; Error(kValue, path) if there is nothing to add.
std::vector<std::string> find_new_lights(const std::string& path, const Cache& cache, const Scene& scene,
                                         bool shadows);

/// Says where a material is too fine-grained for a cache, and what would serve.
Warnings check_density(const Scene& scene, const Cache& cache);

}  // namespace nacre::tools
