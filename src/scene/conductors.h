// Complex indices of refraction of metals.
#pragma once

#include <string>
#include <string_view>

#include "nacre/base/math.h"

namespace nacre {

/// Index eta + i k against vacuum.
struct Conductor {
  std::string_view name;  // chemical symbol, or "none": a perfect mirror
  Rgb eta, k;
};
/// Case does not count. nullptr if there is none of that name.
const Conductor* find_conductor(std::string_view name);
/// "Cu, Au, ..."
std::string conductor_names();

}  // namespace nacre
