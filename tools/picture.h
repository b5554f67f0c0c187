// What a picture depends on, so that one is known again without rendering it.
#pragma once

#include "nacre/cache/cache.h"
#include "render_options.h"

namespace nacre::tools {

/// All that pictures depend on but for their cameras. `cache` is empty where the command bakes, or needs
/// none.
KeyValues make_conditions(const RenderOptions& options, const RenderParams& params, const Scene& scene,
                          const Cache& cache);

}  // namespace nacre::tools
