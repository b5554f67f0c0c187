// Warps and discrete distributions.
#include "nacre/base/sampling.h"

namespace nacre {

Vec2 sample_concentric_disk(const Vec2& u) noexcept {
  const Vec2 p(2 * u.x - 1, 2 * u.y - 1);
  if (p.x == 0 && p.y == 0) return {0, 0};
  const bool wide = std::abs(p.x) > std::abs(p.y);
  const float r = wide ? p.x : p.y;
  const float phi = wide ? kPi / 4 * (p.y / p.x) : kPi / 2 - kPi / 4 * (p.x / p.y);
  return {r * std::cos(phi), r * std::sin(phi)};
}

Vec3 sample_cosine_hemisphere(const Vec2& u) noexcept {
  const Vec2 d = sample_concentric_disk(u);
  return {d.x, d.y, std::sqrt(std::max(0.0f, 1 - d.x * d.x - d.y * d.y))};
}

Vec3 sample_uniform_sphere(const Vec2& u) noexcept {
  const float z = 1 - 2 * u.x;
  const float r = std::sqrt(std::max(0.0f, 1 - z * z));
  const float phi = 2 * kPi * u.y;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

Vec2 sample_uniform_triangle(const Vec2& u) noexcept {
  float a = u.x, b = u.y;
  if (b > a) {
    a *= 0.5f;
    b -= a;
  } else {
    b *= 0.5f;
    a -= b;
  }
  return {a, b};
}

Distribution::Distribution(std::span<const double> weights) : cumulative_(weights.size()) {
  double sum = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) cumulative_[i] = sum += weights[i];
}

std::size_t Distribution::sample(double& u) const noexcept {
  const double x = u * total();
  auto at = std::upper_bound(cumulative_.begin(), cumulative_.end(), x);
  // Rounding can reach the end; the last entry with weight is the first that holds the total.
  if (at == cumulative_.end()) at = std::lower_bound(cumulative_.begin(), cumulative_.end(), total());
  const double before = at == cumulative_.begin() ? 0 : *(at - 1);
  const double weight = *at - before;
  u = weight > 0 ? std::clamp((x - before) / weight, 0.0, 1.0 - 0x1p-53) : 0.0;
  return static_cast<std::size_t>(at - cumulative_.begin());
}

double Distribution::pdf(std::size_t index) const noexcept {
  return (cumulative_[index] - (index ? cumulative_[index - 1] : 0)) / total();
}

Distribution2D::Distribution2D(std::span<const double> weights, std::size_t width) {
  std::vector<double> rows;
  for (std::size_t begin = 0; begin < weights.size(); begin += width) {
    columns_.emplace_back(weights.subspan(begin, width));
    rows.push_back(columns_.back().total());
  }
  rows_ = Distribution(rows);
}

Distribution2D::Cell Distribution2D::sample(const Vec2& u) const noexcept {
  Cell cell{0, 0, static_cast<double>(u.x), static_cast<double>(u.y)};
  cell.y = rows_.sample(cell.dy);
  cell.x = columns_[cell.y].sample(cell.dx);
  return cell;
}

}  // namespace nacre
