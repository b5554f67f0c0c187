// Straight ways through the inside of a translucent object.
#pragma once

#include <vector>

#include "nacre/transport/light.h"
#include "nacre/transport/world.h"

namespace nacre {

/// A boundary on a straight way.
struct Crossing {
  float t;  // distance from where the way starts
  Hit hit;
  SurfacePoint point;
  bool leaving;  // out of the body
};

/// The surface where the eye's ray enters: of its SurfacePoint, with the shading normal.
struct SheetPoint {
  Vec3 position, normal;
  float extent, tilt;  // of the triangle; sine of the angle between it and the shading normal
};

/// A point inside: where it is, and where rays from it start, which is off all surfaces by more than rounding
/// and for large triangles that much further from the first.
struct InteriorPoint {
  Vec3 position, origin;
  SheetPoint top;  // that the point is below
  int depth = 1;   // number of bodies of the medium that it is inside of
};

/// The way from the point where the eye's ray enters to where it first leaves the medium or meets another
/// object.
struct ViewSegment {
  Vec3 begin, direction;           // on the surface; unit
  SheetPoint top;                  // at its beginning
  Vec3 first_origin, last_origin;  // its ends, off the surfaces
  float length = 0;
  bool lost = false;                // no surface ended it; the bounding box did
  int depth = 1;                    // number of bodies at its beginning
  std::vector<Crossing> crossings;  // boundaries between bodies of the same medium that overlap

  InteriorPoint at(float distance) const;
};

/// What is left of a light's connection to a point inside.
struct LightSegment {
  bool blocked = false;
  bool lost = false;           // no surface ended it; the bounding box did
  float length = 0;            // scene units, as attenuated: shortened by refraction
  Rgb transmittance{1, 1, 1};  // of all boundaries
  Vec3 direction;              // towards the light, refracted where the light enters for the last time
  float cos_entry = 1, cos_refracted = 1;  // there, outside and inside
};

/// Memory that is used again from one way to the next.
struct InteriorRoom {
  std::vector<Hit> hits;
  std::vector<Crossing> crossings;
};

/// The bodies of one medium: where rays enter and leave them. A way through it is straight from the light to
/// the point; refraction shortens each piece of it by the ratio of the cosines where the light enters
/// (Jensen et al. 2001, section 4.1), and each boundary on it, also of another bulge of the same object,
/// takes its Fresnel share. Other objects block it, and so do those inside.
class Interior {
 public:
  Interior(const World& world, std::size_t medium);

  /// From a point of the surface, seen from the side of `out`, along the unit vector `direction` inwards.
  /// `room` is memory to work in.
  ViewSegment trace_view(const SurfacePoint& from, const Vec3& out, const Vec3& direction,
                         InteriorRoom& room) const;
  /// From a point to a light sample taken there.
  LightSegment trace_light(const InteriorPoint& point, const LightSample& sample, InteriorRoom& room) const;

 private:
  int bodies_below(const SurfacePoint& at, float side, InteriorRoom& room) const;
  void find_crossings(const Vec3& from, const Vec3& direction, InteriorRoom& room) const;
  enum class Overlap { kCounted, kIgnored };
  bool sum_spans(const std::vector<Crossing>& crossings, const InteriorPoint& from, Overlap overlap,
                 const Vec3& direction, LightSegment& segment, float& open_since) const;
  void enter_through(const Vec3& normal, const Rgb& albedo, const Vec3& direction, float span,
                     LightSegment& segment) const;
  void end_at_box(const Vec3& point, const Vec3& direction, float open_since, LightSegment& segment) const;

  const World& world_;
  int medium_;
  float eta_;
  Box3 box_;
  bool several_bodies_ = false;
  std::vector<std::uint8_t> passable_, all_;  // by mesh: what light may pass, and everything
};

}  // namespace nacre
