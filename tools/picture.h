// Pictures that are rendered once: where they go, and what proves that one is there.
#pragma once

#include <string>

#include "nacre/cache/cache.h"
#include "render_options.h"

namespace nacre::tools {

struct Picture {
  std::string label;  // for messages: a camera's id, or "frame 7"; empty where there is one picture
  std::string path, preview;
  RenderParams params = {};
  std::string key = {};  // of all that a frame of a film depends on; empty: rendered again each time
};

/// Throws UsageError for a name that is one of another format than OpenEXR.
void check_picture_name(const std::string& output);

/// All that pictures depend on but for their cameras. `cache` is empty where the command bakes, or needs
/// none.
KeyValues make_conditions(const RenderOptions& options, const RenderParams& params, const Scene& scene,
                          const Cache& cache);

/// The name of the header's attribute that holds the key.
inline constexpr const char* kKeyAttribute = "nacre:key";
/// Whether the OpenEXR file is there, whole, and of that key.
bool is_complete(const Picture& picture);

}  // namespace nacre::tools
