// Depth-first search, nearest children first.
#include "nacre/cache/nearest.h"

#include <limits>

namespace nacre {
namespace {

// Least cosine between a sample's normal and that of the point: else it lies on another sheet.
constexpr float kSameSide = 0.2f;

struct Search {
  const CacheGroup& group;
  Vec3 position, normal;
  bool any_side;
  float best2 = std::numeric_limits<float>::infinity();
  std::size_t best = 0;

  float distance_to(std::size_t node) const {
    const OctreeNode& n = group.nodes[node];
    return (Vec3(n.centre[0], n.centre[1], n.centre[2]) - position).length() - n.radius;
  }

  void visit(std::size_t index) {
    const OctreeNode& node = group.nodes[index];
    if (node.child_count() == 0) {
      for (std::size_t i = node.first_sample; i < node.first_sample + node.sample_count(); ++i) {
        const float distance2 = (group.position(i) - position).length2();
        if (distance2 < best2 && (any_side || dot(group.normal(i), normal) > kSameSide)) {
          best2 = distance2;
          best = i;
        }
      }
      return;
    }
    std::array<std::pair<float, std::size_t>, 8> children;
    for (std::size_t c = 0; c < node.child_count(); ++c)
      children[c] = {distance_to(node.first_child + c), node.first_child + c};
    std::sort(children.begin(), children.begin() + node.child_count());
    for (std::size_t c = 0; c < node.child_count(); ++c)
      if (children[c].first <= 0 || square(children[c].first) < best2) visit(children[c].second);
  }
};

}  // namespace

std::size_t find_nearest_sample(const CacheGroup& group, const Vec3& position, const Vec3& normal) noexcept {
  Search search{group, position, normal, false};
  search.visit(0);
  if (std::isfinite(search.best2)) return search.best;
  search.any_side = true;
  search.visit(0);
  return search.best;
}

}  // namespace nacre
