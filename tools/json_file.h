// JSON that users write.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace nacre::tools {

/// The content of a JSON file, keys in their order. Throws Error with `path` or "path:line" for what is not
/// JSON, for a key that an object has twice, for numbers that are too large, and what read_text_file throws.
nlohmann::ordered_json load_json(const std::string& path, std::size_t max_bytes);

}  // namespace nacre::tools
