// Walks from boundary to boundary.
#include "render/interior.h"

#include <limits>

#include "nacre/optics/fresnel.h"
#include "nacre/transport/surface.h"

namespace nacre {
namespace {

// Boundaries on one way, over which nothing measurable is left.
constexpr std::size_t kMostCrossings = 256;
// How much of the distance to a light counts, so that the light's own surface does not.
constexpr float kReach = 1 - 1e-4f;

// Distance to where a ray leaves a box that it starts in, and the normal of the face there.
float exit_box(const Box3& box, const Vec3& origin, const Vec3& direction, Vec3& normal) {
  float nearest = std::numeric_limits<float>::infinity();
  for (int k = 0; k < 3; ++k) {
    if (direction[k] == 0) continue;
    const float t = ((direction[k] > 0 ? box.max[k] : box.min[k]) - origin[k]) / direction[k];
    if (t >= nearest) continue;
    nearest = t;
    normal = Vec3(0, 0, 0);
    normal[k] = direction[k] > 0 ? 1.0f : -1.0f;
  }
  return std::isfinite(nearest) ? std::max(nearest, 0.0f) : 0.0f;
}

// Distance from `position` along a direction to the plane of a triangle that a ray of that direction from
// nearby has hit.
float distance_to_plane(const Vec3& position, const Vec3& direction, const SurfacePoint& hit) {
  const float t = dot(hit.position - position, hit.geometric_normal) / dot(direction, hit.geometric_normal);
  return std::isfinite(t) ? std::max(t, 0.0f) : 0.0f;
}

}  // namespace

InteriorPoint ViewSegment::at(float distance) const {
  InteriorPoint point{begin + direction * distance,
                      first_origin + (last_origin - first_origin) * (distance / length)};
  for (const Crossing& crossing : crossings)
    if (crossing.t < distance) point.depth += crossing.leaving ? -1 : 1;
  point.depth = std::max(point.depth, 1);
  return point;
}

Interior::Interior(const World& world, std::size_t medium)
    : world_(world), medium_(static_cast<int>(medium)), eta_(world.scene->media[medium].eta()) {
  for (const Shape& shape : world.scene->shapes)
    if (shape.medium == medium_) box_.extendBy(bounds(shape.mesh));
}

ViewSegment Interior::trace_view(const SurfacePoint& from, const Vec3& out, const Vec3& direction) const {
  ViewSegment segment;
  segment.begin = from.position;
  segment.direction = direction;
  segment.first_origin = segment.last_origin = from.origin(-from.side(out));
  Ray ray{segment.first_origin, direction};
  int depth = 1;
  for (std::size_t n = 0; n < kMostCrossings; ++n) {
    const Hit hit = world_.tracer.intersect(ray);
    if (!hit) {
      Vec3 normal;
      segment.lost = true;
      segment.length = exit_box(box_, from.position, direction, normal);
      segment.last_origin = from.position + direction * segment.length;
      break;
    }
    const SurfacePoint point = surface_point(world_, hit);
    const float side = point.side(direction);
    const float t = distance_to_plane(from.position, direction, point);
    const bool foreign = world_.shape(hit).medium != medium_;
    depth += side > 0 ? -1 : 1;
    if (foreign || depth == 0) {
      // Between surfaces closer than the offsets from them there is no inside to speak of.
      segment.last_origin = point.origin(-side);
      segment.length = dot(segment.last_origin - segment.first_origin, direction) > 0 ? t : 0.0f;
      break;
    }
    segment.crossings.push_back({t, hit, side > 0});
    ray.origin = point.origin(side);
  }
  return segment;
}

LightSegment Interior::trace_light(const InteriorPoint& point, const LightSample& sample,
                                   std::vector<Crossing>& crossings) const {
  LightSegment segment;
  segment.direction = sample.direction;
  crossings.clear();
  const bool infinite = std::isinf(sample.distance);
  Ray ray{point.origin, sample.direction};
  Rgb glass(1, 1, 1);
  for (std::size_t steps = 0;; ++steps) {
    if (!infinite) {
      ray.direction = sample.point - ray.origin;
      ray.t_max = kReach;
    }
    const Hit hit = world_.tracer.intersect(ray);
    if (!hit) break;
    const SurfacePoint at = surface_point(world_, hit);
    const float side = at.side(sample.direction);
    const bool foreign = world_.shape(hit).medium != medium_;
    if (foreign && world_.shadows) glass *= pass_glass(world_, hit, sample.direction);
    segment.blocked = is_black(glass) || steps == kMostCrossings;
    if (segment.blocked) return segment;
    if (!foreign)
      crossings.push_back({distance_to_plane(point.position, sample.direction, at), hit, side > 0});
    const Vec3 origin = at.origin(side);
    if (!(dot(origin - ray.origin, sample.direction) > 0)) break;  // as far as precision goes
    ray.origin = origin;
  }

  segment.transmittance = glass;
  float open_since = 0;
  if (sum_spans(crossings, point.depth, Overlap::kCounted, sample.direction, segment, open_since))
    return segment;
  if (!infinite && box_.intersects(sample.point)) {  // the light is inside
    segment.length += sample.distance - open_since;
    return segment;
  }
  // There is a hole: the way out was missed, and what looked like an overlap was the next bulge.
  LightSegment guess;
  guess.direction = sample.direction;
  guess.lost = true;
  guess.transmittance = glass;
  if (!sum_spans(crossings, point.depth, Overlap::kIgnored, sample.direction, guess, open_since))
    end_at_box(point.position, sample.direction, open_since, guess);
  return guess;
}

// Adds up the pieces between boundaries; false if the last one stays open, since distance `open_since`.
bool Interior::sum_spans(const std::vector<Crossing>& crossings, int depth, Overlap overlap,
                         const Vec3& direction, LightSegment& segment, float& open_since) const {
  if (overlap == Overlap::kIgnored) depth = 1;
  bool last_entry = true;  // as the light goes: the one nearest to the point
  open_since = 0;
  for (const Crossing& crossing : crossings) {
    if (crossing.leaving && depth == 0) continue;  // came in through a hole
    if (crossing.leaving ? --depth > 0 : depth > 0) {
      if (!crossing.leaving && overlap == Overlap::kCounted) ++depth;
      continue;
    }
    const Vec3 normal = surface_point(world_, crossing.hit).normal_towards(direction);
    if (crossing.leaving) {
      LightSegment piece;
      enter_through(normal, surface_albedo(world_, crossing.hit, true), direction, crossing.t - open_since,
                    piece);
      if (last_entry) {
        segment.direction = piece.direction;
        segment.cos_entry = piece.cos_entry;
        segment.cos_refracted = piece.cos_refracted;
        last_entry = false;
      }
      segment.length += piece.length;
      segment.transmittance *= piece.transmittance;
    } else {
      segment.transmittance *= surface_albedo(world_, crossing.hit, false) *
                               (1 - fresnel_reflectance(std::min(dot(normal, direction), 1.0f), eta_));
      open_since = crossing.t;
      depth = 1;
    }
  }
  return depth == 0;
}

// Light from `direction` comes in at a boundary and goes on for `span`.
void Interior::enter_through(const Vec3& normal, const Rgb& albedo, const Vec3& direction, float span,
                             LightSegment& segment) const {
  const float cosine = std::min(dot(normal, direction), 1.0f);
  Vec3 inward;
  if (!refract(direction, normal, eta_, inward)) {
    segment.transmittance = {0, 0, 0};
    return;
  }
  segment.direction = -inward.normalized();
  segment.cos_entry = cosine;
  segment.cos_refracted = dot(segment.direction, normal);
  segment.transmittance *= albedo * (1 - fresnel_reflectance(cosine, eta_));
  segment.length += std::max(span, 0.0f) * segment.cos_entry / segment.cos_refracted;
}

void Interior::end_at_box(const Vec3& point, const Vec3& direction, float open_since,
                          LightSegment& segment) const {
  Vec3 normal = direction;
  const float t = exit_box(box_, point, direction, normal);
  const bool first = open_since == 0;
  LightSegment piece;
  enter_through(normal, {1, 1, 1}, direction, t - open_since, piece);
  if (first) {
    segment.direction = piece.direction;
    segment.cos_entry = piece.cos_entry;
    segment.cos_refracted = piece.cos_refracted;
  }
  segment.length += piece.length;
  segment.transmittance *= piece.transmittance;
}

}  // namespace nacre
