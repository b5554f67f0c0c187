// What a cache's numbers depend on, as named values that can be compared and shown.
#pragma once

#include <string>
#include <string_view>

#include "nacre/cache/cache.h"
#include "nacre/scene/scene.h"

namespace nacre {

/// What of a bake counts, beside the scene.
struct BakeConditions {
  std::vector<int> bounces;  // by medium
  bool shadows = true;
  bool interreflect = false;  // then the coefficients of the media count, too
  bool every_eta = false;     // then the indices of refraction do not
};

/// The parts of a scene that a cache depends on: content of each shape, not its file's name ("shape
/// bunny/geometry"), which group it belongs to, lights ("light key/position"), eta of each medium, shadows,
/// bounces and, where light bounces, reflectances; with interreflection the coefficients of the media, too.
KeyValues make_fingerprint(const Scene& scene, const BakeConditions& conditions);

/// The conditions that a fingerprint was made with, for `groups` media; missing bounces are 0.
BakeConditions fingerprint_conditions(const KeyValues& fingerprint, std::size_t groups);

/// A 32-digit hash of what a scene file refers to, whether or not a cache depends on it: meshes with normals
/// and texture coordinates, textures.
std::string contents_digest(const Scene& scene);

/// A 32-digit hash of a group's samples and octree, whatever scene they belong to.
std::string samples_digest(const CacheGroup& group);

/// A 32-digit hash of bytes, as they lie in a file.
std::string bytes_digest(std::string_view bytes);

/// A 32-digit hash of a fingerprint.
std::string fingerprint_digest(const KeyValues& fingerprint);

/// What differs between a cache's fingerprint and a scene's, in one line: "light key/position was 0 1 2 and
/// is 0 1 3; ...", or "" if nothing does.
std::string describe_mismatch(const KeyValues& cached, const KeyValues& current);

}  // namespace nacre
