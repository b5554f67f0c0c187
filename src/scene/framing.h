// Cameras that see a box whole.
#pragma once

#include "nacre/scene/scene.h"

namespace nacre {

/// A camera that looks along `direction` at the middle of `box`, from just so far that the box with a margin
/// fits into pictures of `film`. y is up unless the direction is vertical.
Camera make_framing_camera(const Box3& box, const Vec3d& direction, float fov_degrees, const Film& film);

}  // namespace nacre
