// Walks from boundary to boundary.
#include "render/interior.h"

#include <limits>

#include "nacre/optics/fresnel.h"
#include "nacre/transport/surface.h"

namespace nacre {
namespace {

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

// Sine of the angle between shading normal and triangle.
float tilt(const SurfacePoint& point) {
  return std::sqrt(std::max(1 - square(dot(point.shading_normal, point.geometric_normal)), 0.0f));
}

// How much longer a way of length `t` to a hit is on the smooth surface that interpolated normals belong to.
// Without this, depths belong to flat triangles and cosines to the normals, and a coarse mesh shows its
// facets. The chord between two points of a smooth surface is square to the mean of their normals (of a
// sphere exactly), which tells how far above the hit that surface is, as far as the tilt of the normals
// against the triangles accounts for it. That is for ways that come out near where they began, on the same
// sheet of surface; further on, and across to the other side, the mesh itself is the better judge of how
// thick a body is (normals round the edges of a box make it a ball). `normal` is that of the hit, bent
// towards the direction.
float smoothing(const SheetPoint& top, const Vec3& direction, float t, const SurfacePoint& hit,
                const Vec3& normal) {
  constexpr float kSameSheet = 0.5f;    // cosine between normals from which on they share a sheet
  constexpr float kNear = 2, kFar = 4;  // in triangles
  constexpr float kShortest = -0.75f, kLongest = 3;  // in lengths of the way
  const Vec3 chord = top.position - hit.position;
  const float length = chord.length();
  const float same = dot(top.normal, hit.shading_normal) / kSameSheet;
  const float near = (kFar - length / std::max(top.extent, hit.extent)) / (kFar - kNear);
  const float weight = std::clamp(same, 0.0f, 1.0f) * std::clamp(near, 0.0f, 1.0f);
  const float most = 0.75f * (top.tilt + tilt(hit)) * length;
  if (!(weight * most > 0)) return 0;
  // How far the smooth surface is above the hit, and one step from there onto its tangent plane.
  const Vec3 mean = (top.normal + hit.shading_normal).normalized();
  const float height = std::clamp(dot(chord, mean), -most, most) / dot(hit.shading_normal, mean);
  const float longer = height * dot(hit.shading_normal, normal) / dot(direction, normal);
  return weight * std::clamp(longer, kShortest * t, kLongest * t);
}

SheetPoint sheet_at(const SurfacePoint& point) {
  return {point.position, point.shading_normal, point.extent, tilt(point)};
}

// Whether two triangles of one mesh meet at a vertex.
bool share_vertex(const World& world, const Hit& a, const Hit& b) {
  if (a.mesh != b.mesh) return false;
  const Mesh& mesh = world.shape(a).mesh;
  for (const std::uint32_t i : mesh.triangles[a.triangle])
    for (const std::uint32_t j : mesh.triangles[b.triangle])
      if (mesh.positions[i] == mesh.positions[j]) return true;
  return false;
}

}  // namespace

InteriorPoint ViewSegment::at(float distance) const {
  InteriorPoint point{begin + direction * distance,
                      first_origin + (last_origin - first_origin) * (distance / length), top, depth};
  for (const Crossing& crossing : crossings)
    if (crossing.t < distance) point.depth += crossing.leaving ? -1 : 1;
  point.depth = std::max(point.depth, 1);
  return point;
}

Interior::Interior(const World& world, std::size_t medium)
    : world_(world), medium_(static_cast<int>(medium)), eta_(world.media[medium].eta()) {
  int bodies = 0;
  for (const Shape& shape : world.scene->shapes) {
    const bool own = shape.medium == medium_;
    if (own) box_.extendBy(bounds(shape.mesh));
    bodies += own;
    passable_.push_back(own || !world.shadows || world.clear_glass[passable_.size()]);
  }
  all_.assign(passable_.size(), 1);
  several_bodies_ = bodies > 1;
  // A flat sheet stands for a half-space.
  if (box_.isEmpty()) return;
  const Vec3 size = box_.size();
  for (int k = 0; k < 3; ++k)
    if (size[k] < 1e-6f * size.length()) {
      box_.min[k] -= size.length();
      box_.max[k] += size.length();
    }
}

// How many bodies begin at a point of the surface, which more than one do where faces lie upon each other.
int Interior::bodies_below(const SurfacePoint& at, float side, InteriorRoom& room) const {
  if (!several_bodies_) return 1;
  const Vec3 above = at.origin(side), below = at.origin(-side);
  if (!world_.tracer.collect({above, below - above, 0, 1}, all_, room.hits)) return 1;
  find_crossings(above, (below - above).normalized(), room);
  int depth = 0;
  for (const Crossing& crossing : room.crossings)
    if (world_.shape(crossing.hit).medium == medium_) depth += crossing.leaving ? -1 : 1;
  return std::max(depth, 1);
}

// Hits as crossings: distances from the true point, one for a ray through the edge of two faces, and where
// bodies touch the next one entered before the last is left.
void Interior::find_crossings(const Vec3& from, const Vec3& direction, InteriorRoom& room) const {
  std::vector<Crossing>& crossings = room.crossings;
  crossings.clear();
  float last_reach = 0;  // within which distances are the same, for all that precision tells
  for (const Hit& hit : room.hits) {
    const SurfacePoint point = surface_point(world_, hit);
    const float side = point.side(direction);
    const float cosine = std::max(std::abs(dot(point.geometric_normal, direction)), 1e-3f);
    const float reach = (point.origin(side) - point.position).length() / cosine;
    const Crossing crossing{distance_to_plane(from, direction, point), hit, point, side > 0};
    const bool touches = !crossings.empty() && crossing.t - crossings.back().t <= std::max(reach, last_reach);
    last_reach = reach;
    if (touches && crossing.leaving == crossings.back().leaving &&
        share_vertex(world_, hit, crossings.back().hit))
      continue;
    crossings.push_back(crossing);
    if (touches && !crossing.leaving && crossings[crossings.size() - 2].leaving)
      std::swap(crossings.back(), crossings[crossings.size() - 2]);
  }
}

ViewSegment Interior::trace_view(const SurfacePoint& from, const Vec3& out, const Vec3& direction,
                                 InteriorRoom& room) const {
  ViewSegment segment;
  segment.begin = from.position;
  segment.direction = direction;
  segment.top = sheet_at(from);
  segment.first_origin = segment.last_origin = from.origin(-from.side(out));
  segment.depth = bodies_below(from, from.side(out), room);
  if (!world_.tracer.collect({segment.first_origin, direction}, all_, room.hits)) return segment;
  find_crossings(from.position, direction, room);
  int depth = segment.depth;
  for (const Crossing& crossing : room.crossings) {
    depth += crossing.leaving ? -1 : 1;
    if (world_.shape(crossing.hit).medium == medium_ && depth > 0) {
      segment.crossings.push_back(crossing);
      continue;
    }
    // Between surfaces closer than the offsets from them there is no inside to speak of.
    segment.last_origin = crossing.point.origin(crossing.leaving ? -1.0f : 1.0f);
    segment.length = dot(segment.last_origin - segment.first_origin, direction) > 0 ? crossing.t : 0.0f;
    return segment;
  }
  Vec3 normal;
  segment.lost = true;
  segment.length = exit_box(box_, from.position, direction, normal);
  segment.last_origin = from.position + direction * segment.length;
  return segment;
}

LightSegment Interior::trace_light(const InteriorPoint& point, const LightSample& sample,
                                   InteriorRoom& room) const {
  LightSegment segment;
  segment.direction = sample.direction;
  segment.blocked = !world_.tracer.collect(ray_to_light(point.origin, sample), passable_, room.hits);
  if (segment.blocked) return segment;
  std::erase_if(room.hits, [&](const Hit& hit) {
    if (world_.shape(hit).medium == medium_) return false;
    if (world_.shadows) segment.transmittance *= pass_glass(world_, hit, sample.direction);
    return true;
  });
  if (is_black(segment.transmittance)) return segment;
  find_crossings(point.position, sample.direction, room);

  LightSegment guess = segment;
  float open_since = 0;
  if (sum_spans(room.crossings, point, Overlap::kCounted, sample.direction, segment, open_since))
    return segment;
  if (!std::isinf(sample.distance) && box_.intersects(sample.point)) {  // the light is inside
    segment.length += sample.distance - open_since;
    return segment;
  }
  // There is a hole: the way out was missed, and what looked like an overlap was the next bulge.
  guess.lost = true;
  if (!sum_spans(room.crossings, point, Overlap::kIgnored, sample.direction, guess, open_since))
    end_at_box(point.position, sample.direction, open_since, guess);
  return guess;
}

// Adds up the pieces between boundaries; false if the last one stays open, since distance `open_since`.
bool Interior::sum_spans(const std::vector<Crossing>& crossings, const InteriorPoint& from, Overlap overlap,
                         const Vec3& direction, LightSegment& segment, float& open_since) const {
  int depth = overlap == Overlap::kIgnored ? 1 : from.depth;
  bool last_entry = true;  // as the light goes: the one nearest to the point
  open_since = 0;
  for (const Crossing& crossing : crossings) {
    if (crossing.leaving && depth == 0) continue;  // came in through a hole
    if (crossing.leaving ? --depth > 0 : depth > 0) {
      if (!crossing.leaving && overlap == Overlap::kCounted) ++depth;
      continue;
    }
    const Vec3 normal = crossing.point.normal_towards(direction);
    const float t = crossing.t + smoothing(from.top, direction, crossing.t, crossing.point, normal);
    if (crossing.leaving) {
      LightSegment piece;
      enter_through(normal, surface_albedo(world_, crossing.hit, true), direction, t - open_since, piece);
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
      open_since = t;
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
