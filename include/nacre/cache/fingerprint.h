// What a cache's numbers depend on, as named values that can be compared and shown.
#pragma once

#include <string>

#include "nacre/cache/cache.h"
#include "nacre/scene/scene.h"

namespace nacre {

/// The parts of a scene that a cache depends on: content of each shape, not its file's name ("shape
/// bunny/geometry"), which group it belongs to, lights ("light key/position"), eta of each medium, shadows,
/// bounces and, where light bounces, reflectances; with interreflection the coefficients of the media, too.
/// `bounces[m]` is the number of bounces baked for medium m.
KeyValues make_fingerprint(const Scene& scene, std::span<const int> bounces, bool shadows,
                           bool interreflect = false);

/// The bounces that a fingerprint was made with, for `groups` media; missing ones are 0.
std::vector<int> fingerprint_bounces(const KeyValues& fingerprint, std::size_t groups);

/// Whether it was made with interreflection.
bool fingerprint_interreflects(const KeyValues& fingerprint);

/// A 32-digit hash of a group's samples and octree, whatever scene they belong to.
std::string samples_digest(const CacheGroup& group);

/// A 32-digit hash of a fingerprint.
std::string fingerprint_digest(const KeyValues& fingerprint);

/// What differs between a cache's fingerprint and a scene's, in one line: "light key/position was 0 1 2 and
/// is 0 1 3; ...", or "" if nothing does.
std::string describe_mismatch(const KeyValues& cached, const KeyValues& current);

}  // namespace nacre
