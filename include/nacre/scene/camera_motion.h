// Cameras that move: around what they look at, and along key frames.
#pragma once

#include <span>

#include "nacre/scene/scene.h"

namespace nacre {

/// A line around which a camera goes; world space, `direction` of unit length.
struct TurnAxis {
  Vec3d centre, direction;
};
/// Through the middle of the box around all translucent shapes (around all shapes if there are none), along
/// the world axis that is nearest to the camera's up.
TurnAxis find_turn_axis(const Scene& scene, const Camera& camera);
/// The camera gone round by `turns` of full circles, counter-clockwise for who looks against the axis; by 0
/// turns the same to the bit.
Camera turn_camera(const Camera& camera, const TurnAxis& axis, double turns);

/// Where a camera is at one frame, as <lookat> has it, in scene units.
struct CameraKey {
  int frame;
  Vec3d origin, target, up{0, 1, 0};
  double fov = 0;  // full angle along the camera's fov_axis, degrees; 0: the camera's own
};
/// Whether a key is a view: its target not at the origin, its up not along the view.
bool is_view(const CameraKey& key);
/// The camera at a frame of a film, by keys whose frames increase, of which there is at least one: at a key
/// the same to the bit as <lookat> would place it, between two of them on a cubic whose speed is continuous,
/// before and after all of them at the nearest. Origin, target and up go each their own way, fov by the
/// logarithm of the focal length. What two neighbouring keys share stands still between them. Throws
/// Error(kValue, place) for a frame at which the camera looks nowhere or along its up.
Camera move_camera(const Camera& camera, std::span<const CameraKey> keys, int frame,
                   const std::string& place);

}  // namespace nacre
