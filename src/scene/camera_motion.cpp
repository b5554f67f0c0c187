// Turntables, and cubic splines through key frames.
#include "nacre/scene/camera_motion.h"

#include <algorithm>
#include <cmath>

#include "scene/values.h"

namespace nacre {
namespace {

// A quantity at a few neighbouring keys, and how fast it changes there.
class Spline {
 public:
  template <class Quantity>
  Spline(std::span<const CameraKey> keys, const Quantity& quantity) {
    for (const CameraKey& key : keys) {
      frames_.push_back(key.frame);
      values_.push_back(quantity(key));
    }
  }

  // Cubic Hermite between keys `i` and `i + 1`.
  Vec3d eval(std::size_t i, double frame) const {
    const double length = frames_[i + 1] - frames_[i], t = (frame - frames_[i]) / length;
    const Vec3d rise = values_[i + 1] - values_[i];
    const Vec3d start = slope(i) * length - rise, end = rise - slope(i + 1) * length;
    return values_[i] + (rise + (start * (1 - t) + end * t) * (1 - t)) * t;
  }

 private:
  Vec3d chord(std::size_t i) const { return (values_[i + 1] - values_[i]) / (frames_[i + 1] - frames_[i]); }

  // Of the parabola through a key and its neighbours, at the ends of the film that which ends in the slope of
  // the next key. Not above three times the slower of the chords beside it, so that nothing swings far beyond
  // keys, and what stands still does. Source: Fritsch & Carlson 1980, for each speed instead of each value.
  Vec3d slope(std::size_t i) const {
    const std::size_t last = values_.size() - 1;
    if (last == 1) return chord(0);
    if (i == 0) return limited(chord(0) * 2 - slope(1), chord(0), chord(0));
    if (i == last) return limited(chord(last - 1) * 2 - slope(last - 1), chord(last - 1), chord(last - 1));
    const Vec3d before = chord(i - 1), after = chord(i);
    const double share = (frames_[i] - frames_[i - 1]) / (frames_[i + 1] - frames_[i - 1]);
    return limited(before * (1 - share) + after * share, before, after);
  }

  static Vec3d limited(const Vec3d& slope, const Vec3d& before, const Vec3d& after) {
    const double most = 3 * std::min(before.length(), after.length()), length = slope.length();
    return length > most ? slope * (most / length) : slope;
  }

  std::vector<double> frames_;
  std::vector<Vec3d> values_;
};

// Of the key, or the camera's own.
double field_of_view(const Camera& camera, const CameraKey& key) {
  return key.fov > 0 ? key.fov : double{camera.fov};
}

CameraKey interpolate(const Camera& camera, std::span<const CameraKey> keys, int frame) {
  if (frame <= keys.front().frame) return keys.front();
  if (frame >= keys.back().frame) return keys.back();
  const auto next = std::ranges::upper_bound(keys, frame, {}, &CameraKey::frame);
  const auto i = static_cast<std::size_t>(next - keys.begin()) - 1;
  if (keys[i].frame == frame) return keys[i];
  // Slopes need one more key to either side.
  const std::size_t first = i > 0 ? i - 1 : 0, count = std::min(i + 3, keys.size()) - first;
  const auto at = [&](const auto& quantity) {
    return Spline(keys.subspan(first, count), quantity).eval(i - first, frame);
  };
  CameraKey result{frame, at([](const CameraKey& key) { return key.origin; }),
                   at([](const CameraKey& key) { return key.target; }),
                   at([](const CameraKey& key) { return key.up.normalized(); })};
  const Vec3d zoom = at([&](const CameraKey& key) {
    return Vec3d(std::log(std::tan(field_of_view(camera, key) * kPiD / 360)), 0, 0);
  });
  result.fov = std::atan(std::exp(zoom.x)) * 360 / kPiD;
  return result;
}

}  // namespace

TurnAxis find_turn_axis(const Scene& scene, const Camera& camera) {
  Box3 box;
  for (const bool translucent : {true, false})
    if (box.isEmpty())
      for (const Shape& shape : scene.shapes)
        if (!translucent || shape.medium != kNone) box.extendBy(bounds(shape.mesh));
  Vec3d up;
  camera.to_world.multDirMatrix(Vec3d(0, 1, 0), up);
  TurnAxis axis{(Vec3d(box.min) + Vec3d(box.max)) / 2, Vec3d(0, 0, 0)};
  int nearest = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(up[k]) > std::abs(up[nearest])) nearest = k;
  axis.direction[nearest] = up[nearest] < 0 ? -1 : 1;
  return axis;
}

Camera turn_camera(const Camera& camera, const TurnAxis& axis, double turns) {
  Camera turned = camera;
  if (turns == 0) return turned;
  Matrix4 to_axis, rotation, back;
  to_axis.setTranslation(-axis.centre);
  rotation.setAxisAngle(axis.direction, turns * 2 * kPiD);
  back.setTranslation(axis.centre);
  turned.to_world = camera.to_world * to_axis * rotation * back;
  return turned;
}

bool is_view(const CameraKey& key) { return look_at(key.origin, key.target, key.up).has_value(); }

Camera move_camera(const Camera& camera, std::span<const CameraKey> keys, int frame,
                   const std::string& place) {
  const CameraKey key = interpolate(camera, keys, frame);
  const std::optional<Matrix4> view = look_at(key.origin, key.target, key.up);
  if (!view)
    fail(ErrorCode::kValue, place,
         "at frame {} the camera looks along its up, or stands in its target: put a key frame there", frame);
  Camera moved = camera;
  moved.to_world = *view;
  moved.fov = static_cast<float>(field_of_view(camera, key));
  // The width of what an orthographic camera sees is in its transform.
  if (camera.kind == CameraKind::kOrthographic) {
    Matrix4 scale;
    for (int k = 0; k < 3; ++k) {
      Vec3d side;
      camera.to_world.multDirMatrix(Vec3d(k == 0, k == 1, k == 2), side);
      scale[k][k] = side.length();
    }
    moved.to_world = scale * *view;
  }
  return moved;
}

}  // namespace nacre
