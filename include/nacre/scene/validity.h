// Where the diffusion model holds: scattering that dominates absorption, objects thicker than a few mean free
// paths, surfaces that bound one body each.
#pragma once

#include "nacre/scene/scene.h"

namespace nacre {

/// Extent of what one medium fills. Thickness is 2 V / A of its closed pieces of surface together (the
/// thickness of a slab, two thirds of a sphere's radius), at most the smallest side of its box; for open
/// surfaces that side.
struct MediumExtent {
  Vec3 size_mm{0, 0, 0};
  double thickness_mm = 0;
  double area_mm2 = 0;
  float furthest = 0;  // coordinate of any point, scene units
};
MediumExtent measure_medium(const Scene& scene, std::size_t medium);

/// One line for each medium with a channel of alpha' below 0.5, or with an extent thinner than three of its
/// largest mean free path, naming its size in mm and in l'.
Warnings check_validity(const Scene& scene);

/// One line for each shape with pieces that are no boundary of their medium (find_faulty_pieces), saying what
/// comes of it and what to do.
Warnings check_bodies(const Scene& scene);

}  // namespace nacre
