// Distance from which the corners of a box fit into the field of view.
#include "scene/framing.h"

#include "scene/values.h"

namespace nacre {

Camera make_framing_camera(const Box3& box, const Vec3d& direction, float fov_degrees, const Film& film) {
  constexpr double kMargin = 1.15;
  const Vec3d center = (Vec3d(box.min) + Vec3d(box.max)) / 2, forward = direction.normalized();
  const Vec3d up = std::abs(forward.y) < 0.999 ? Vec3d(0, 1, 0) : Vec3d(0, 0, 1);
  const Matrix4 view = look_at({0, 0, 0}, forward, up).value_or(Matrix4());

  const double tan_x = std::tan(fov_degrees * kPiD / 360), tan_y = tan_x * film.height / film.width;
  double distance = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d offset = Vec3d((corner & 1 ? box.max : box.min).x, (corner & 2 ? box.max : box.min).y,
                               (corner & 4 ? box.max : box.min).z) -
                         center;
    Vec3d seen;  // in camera space; the rotation's inverse is its transpose
    view.transposed().multDirMatrix(offset, seen);
    distance = std::max(
        {distance, kMargin * std::abs(seen.x) / tan_x - seen.z, kMargin * std::abs(seen.y) / tan_y - seen.z});
  }

  Camera camera;
  const Vec3d origin = center - forward * distance;
  camera.to_world = view;
  for (int k = 0; k < 3; ++k) camera.to_world[3][k] = origin[k];
  camera.fov = fov_degrees;
  camera.fov_axis = FovAxis::kX;
  camera.near_clip = static_cast<float>(distance * 1e-3);
  camera.far_clip = static_cast<float>(distance * 1e4);
  return camera;
}

}  // namespace nacre
