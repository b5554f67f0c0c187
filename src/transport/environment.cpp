// Latitude-longitude maps as in Mitsuba 0.6.
#include "nacre/transport/environment.h"

namespace nacre {
namespace {

// Cosine of the polar angle at the upper edge of a row.
double edge_cosine(std::size_t row, int height) { return std::cos(kPiD * static_cast<double>(row) / height); }

double mean(const Rgb& c) {
  return (static_cast<double>(c.x) + static_cast<double>(c.y) + static_cast<double>(c.z)) / 3;
}

// Mean over a cell of what bilinear interpolation makes of it and its neighbours: 1/8, 3/4, 1/8 along each
// axis. Exact, so that it vanishes only where all of the cell is black.
double cell_mean(const Bitmap& map, int x, int y) {
  const int left = x > 0 ? x - 1 : map.width - 1, right = x + 1 < map.width ? x + 1 : 0;
  const auto along_row = [&](int row) {
    return 0.125 * (mean(map.at(left, row)) + mean(map.at(right, row))) + 0.75 * mean(map.at(x, row));
  };
  return 0.125 * (along_row(std::max(y - 1, 0)) + along_row(std::min(y + 1, map.height - 1))) +
         0.75 * along_row(y);
}

}  // namespace

Environment::Environment(const EnvironmentMap& map) : map_(&map) {
  for (int i = 0; i < 3; ++i)
    axes_[i] = Vec3(static_cast<float>(map.to_world[i][0]), static_cast<float>(map.to_world[i][1]),
                    static_cast<float>(map.to_world[i][2]));
  const Bitmap& bitmap = map.radiance;
  const auto width = static_cast<std::size_t>(bitmap.width);
  std::vector<double> weights(bitmap.texels.size());
  for (int y = 0; y < bitmap.height; ++y) {
    const double solid_angle = cell_solid_angle(static_cast<std::size_t>(y));
    for (int x = 0; x < bitmap.width; ++x)
      weights[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] =
          solid_angle * cell_mean(bitmap, x, y);
  }
  cells_ = Distribution2D(weights, width);
}

double Environment::cell_solid_angle(std::size_t row) const noexcept {
  const Bitmap& map = map_->radiance;
  return 2 * kPiD / map.width * (edge_cosine(row, map.height) - edge_cosine(row + 1, map.height));
}

Vec2 Environment::to_picture(const Vec3& direction) const noexcept {
  const float x = dot(direction, axes_[0]), y = dot(direction, axes_[1]), z = dot(direction, axes_[2]);
  float u = std::atan2(x, -z) / (2 * kPi);
  if (u < 0) u += 1;
  const float v = std::atan2(std::sqrt(x * x + z * z), y) / kPi;
  return {u * static_cast<float>(map_->radiance.width), v * static_cast<float>(map_->radiance.height)};
}

Rgb Environment::radiance(const Vec3& direction) const noexcept {
  const Bitmap& map = map_->radiance;
  const Vec2 at = to_picture(direction) - Vec2(0.5f, 0.5f);
  const float left = std::floor(at.x), upper = std::floor(at.y);
  const float fx = at.x - left, fy = at.y - upper;
  const int column = static_cast<int>(left), row = static_cast<int>(upper);  // from -1 to the last
  const int x0 = (column + map.width) % map.width, x1 = (column + 1) % map.width;
  const int y0 = std::clamp(row, 0, map.height - 1), y1 = std::clamp(row + 1, 0, map.height - 1);
  return (map.at(x0, y0) * (1 - fx) + map.at(x1, y0) * fx) * (1 - fy) +
         (map.at(x0, y1) * (1 - fx) + map.at(x1, y1) * fx) * fy;
}

Vec3 Environment::sample(const Vec2& u, float& pdf) const noexcept {
  pdf = 0;
  if (!(total() > 0)) return {0, 0, 1};
  const Distribution2D::Cell cell = cells_.sample(u);
  const Bitmap& map = map_->radiance;
  const double upper = edge_cosine(cell.y, map.height), lower = edge_cosine(cell.y + 1, map.height);
  const double cosine = upper + (lower - upper) * cell.dy;
  const double sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
  const double phi = 2 * kPiD * (static_cast<double>(cell.x) + cell.dx) / map.width;
  pdf = static_cast<float>(cells_.pdf(cell.x, cell.y) / cell_solid_angle(cell.y));
  const Vec3 direction = axes_[0] * static_cast<float>(sine * std::sin(phi)) +
                         axes_[1] * static_cast<float>(cosine) -
                         axes_[2] * static_cast<float>(sine * std::cos(phi));
  return direction.normalized();
}

float Environment::pdf(const Vec3& direction) const noexcept {
  if (!(total() > 0)) return 0;
  const Bitmap& map = map_->radiance;
  const Vec2 at = to_picture(direction);
  const auto x = static_cast<std::size_t>(std::clamp(static_cast<int>(at.x), 0, map.width - 1));
  const auto y = static_cast<std::size_t>(std::clamp(static_cast<int>(at.y), 0, map.height - 1));
  return static_cast<float>(cells_.pdf(x, y) / cell_solid_angle(y));
}

}  // namespace nacre
