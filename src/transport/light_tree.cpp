// Bounds of groups of lights, and the way down to one of them.
#include "nacre/transport/light_tree.h"

#include <numeric>

namespace nacre {
namespace {

// Light at grazing angles counts at least this much, and cosines are taken this much larger, so that
// rounding never rules out a light that can be seen.
constexpr float kLeastCosine = 0.01f;
constexpr float kSlack = 1e-3f;

float angle_between(const Vec3& a, const Vec3& b) { return std::acos(std::clamp(dot(a, b), -1.0f, 1.0f)); }

// The narrowest cone around two, or all directions.
void merge_cones(LightBound& a, const LightBound& b) {
  const bool a_wider = a.normal_angle >= b.normal_angle;
  const LightBound &wide = a_wider ? a : b, &narrow = a_wider ? b : a;
  const float between = angle_between(wide.axis, narrow.axis);
  if (std::min(between + narrow.normal_angle, kPi) <= wide.normal_angle) {
    const Vec3 axis = wide.axis;
    a.normal_angle = wide.normal_angle;
    a.axis = axis;
    return;
  }
  const float angle = (wide.normal_angle + between + narrow.normal_angle) / 2;
  const Vec3 aside = narrow.axis - wide.axis * dot(wide.axis, narrow.axis);
  const float turn = angle - wide.normal_angle;
  Vec3 axis = wide.axis;
  if (angle < kPi && aside.length() > 1e-6f)
    axis = (wide.axis * std::cos(turn) + aside.normalized() * std::sin(turn)).normalized();
  a.normal_angle = angle < kPi && aside.length() > 1e-6f ? angle : kPi;
  a.axis = axis;
}

LightBound merge(LightBound a, const LightBound& b) {
  a.box.extendBy(b.box);
  a.intensity += b.intensity;
  merge_cones(a, b);
  a.beam_cosine = std::min(a.beam_cosine, b.beam_cosine);
  a.normal_cosine = std::cos(a.normal_angle);
  a.normal_sine = std::sin(a.normal_angle);
  return a;
}

// By cosine and sine, which subtract without a call of either.
struct Angle {
  float cosine, sine;
};
Angle angle_of(float cosine) {
  cosine = std::clamp(cosine, -1.0f, 1.0f);
  return {cosine, std::sqrt(1 - cosine * cosine)};
}
// At least 0; both up to pi.
Angle minus(const Angle& a, const Angle& b) {
  if (a.cosine >= b.cosine) return {1, 0};
  return {a.cosine * b.cosine + a.sine * b.sine, a.sine * b.cosine - a.cosine * b.sine};
}

double importance_of(const LightBound& bound, const Vec3& x, const Vec3& normal) {
  if (!(bound.intensity > 0)) return 0;
  const Vec3d to_light = (Vec3d(bound.box.min) + Vec3d(bound.box.max)) / 2 - Vec3d(x);
  const double radius = Vec3d(bound.box.size()).length() / 2, distance = to_light.length();
  const double nearest = std::max({distance, radius, 1e-15});
  const double intensity = bound.intensity / (nearest * nearest);
  if (distance <= radius || distance <= 0) return intensity;

  const Vec3d direction = to_light / distance;
  const Vec3 d(static_cast<float>(direction.x), static_cast<float>(direction.y),
               static_cast<float>(direction.z));
  const double sine = radius / distance;
  const Angle spread{static_cast<float>(std::sqrt(1 - sine * sine)), static_cast<float>(sine)};
  float weight = 1;
  if (bound.normal_angle < kPi) {
    const Angle normals{bound.normal_cosine, bound.normal_sine};
    const float leaving = minus(minus(angle_of(-dot(bound.axis, d)), normals), spread).cosine;
    if (leaving < bound.beam_cosine - kSlack) return 0;
    if (bound.beam_cosine <= 0) weight = std::max(leaving, kLeastCosine);
  }
  if (normal != Vec3(0, 0, 0)) {
    const float arriving = minus(angle_of(dot(normal, d)), spread).cosine;
    if (arriving < -kSlack) return 0;
    weight *= std::max(arriving, kLeastCosine);
  }
  return intensity * static_cast<double>(weight);
}

}  // namespace

LightTree::LightTree(std::span<const LightBound> bounds, std::span<const std::size_t> lights,
                     std::size_t light_count)
    : paths_(light_count) {
  std::vector<std::uint32_t> items(bounds.size());
  std::iota(items.begin(), items.end(), 0u);
  nodes_.reserve(2 * items.size());
  if (!items.empty()) build(items, bounds, lights, 0, 0);
}

std::uint32_t LightTree::build(std::span<std::uint32_t> items, std::span<const LightBound> bounds,
                               std::span<const std::size_t> lights, std::uint64_t path, int depth) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  if (items.size() == 1) {
    LightBound& bound = nodes_[index].bound;
    bound = bounds[items[0]];
    bound.normal_cosine = std::cos(bound.normal_angle);
    bound.normal_sine = std::sin(bound.normal_angle);
    nodes_[index].light = static_cast<std::uint32_t>(lights[items[0]]);
    paths_[lights[items[0]]] = path;
    return index;
  }
  Box3 centers;
  for (const std::uint32_t i : items) centers.extendBy(bounds[i].box.center());
  const unsigned axis = centers.majorAxis();
  const std::size_t half = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                   [&](std::uint32_t a, std::uint32_t b) {
                     const int k = static_cast<int>(axis);
                     const float ca = bounds[a].box.center()[k], cb = bounds[b].box.center()[k];
                     return ca != cb ? ca < cb : a < b;
                   });
  const std::uint32_t first = build(items.first(half), bounds, lights, path, depth + 1);
  const std::uint32_t second =
      build(items.subspan(half), bounds, lights, path | std::uint64_t{1} << depth, depth + 1);
  nodes_[index].second = second;
  nodes_[index].bound = merge(nodes_[first].bound, nodes_[second].bound);
  return index;
}

double LightTree::importance(const Vec3& x, const Vec3& normal) const noexcept {
  return nodes_.empty() ? 0 : importance_of(nodes_[0].bound, x, normal);
}

// Of the first child of an inner node; negative if neither can light x.
double LightTree::first_probability(const Node& node, const Vec3& x, const Vec3& normal) const noexcept {
  const double first = importance_of((&node + 1)->bound, x, normal);
  const double second = importance_of(nodes_[node.second].bound, x, normal);
  return first + second > 0 ? first / (first + second) : -1;
}

LightChoice LightTree::choose(const Vec3& x, const Vec3& normal, double u) const noexcept {
  if (nodes_.empty() || !(importance(x, normal) > 0)) return {};
  double probability = 1;
  const Node* node = &nodes_[0];
  while (node->second != 0) {
    const double first = first_probability(*node, x, normal);
    if (first < 0) return {};
    if (u < first) {
      u /= first;
      probability *= first;
      node += 1;
    } else {
      u = (u - first) / (1 - first);
      probability *= 1 - first;
      node = &nodes_[node->second];
    }
    if (!(probability > 0)) return {};
  }
  return {node->light, probability};
}

double LightTree::probability(std::size_t light, const Vec3& x, const Vec3& normal) const noexcept {
  if (nodes_.empty() || !(importance(x, normal) > 0)) return 0;
  double probability = 1;
  std::uint64_t path = paths_[light];
  const Node* node = &nodes_[0];
  for (; node->second != 0; path >>= 1) {
    const double first = first_probability(*node, x, normal);
    if (first < 0) return 0;
    const bool is_first = (path & 1) == 0;
    probability *= is_first ? first : 1 - first;
    node = is_first ? node + 1 : &nodes_[node->second];
  }
  return probability;
}

}  // namespace nacre
