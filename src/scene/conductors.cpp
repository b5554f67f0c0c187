// The table of metals.
#include "scene/conductors.h"

#include "scene/values.h"

namespace nacre {
namespace {

// Source: Palik 1985, "Handbook of Optical Constants of Solids"; each of eta and k brought from its spectrum
// to linear rgb as in spectrum_to_rgb.
constexpr int kCount = 8;
const Conductor (&table())[kCount] {
  static const Conductor conductors[kCount] = {
      {"Cu", {0.1667f, 0.9742f, 1.2122f}, {3.2479f, 2.5869f, 2.3560f}},
      {"Au", {0.1186f, 0.3959f, 1.5859f}, {3.3058f, 2.5158f, 1.7633f}},
      {"Ag", {0.1289f, 0.1231f, 0.1522f}, {4.0075f, 3.2926f, 2.3615f}},
      {"Al", {1.3757f, 0.9284f, 0.5733f}, {7.6556f, 6.6117f, 5.3201f}},
      {"Cr", {3.6268f, 3.0756f, 1.8202f}, {4.3213f, 4.4623f, 4.1298f}},
      {"Ni", {1.9648f, 1.7542f, 1.6135f}, {3.7339f, 3.2166f, 2.5797f}},
      {"W", {3.6275f, 3.4804f, 3.2975f}, {2.9054f, 2.7471f, 2.5000f}},
      {"none", {0, 0, 0}, {1, 1, 1}},
  };
  return conductors;
}

}  // namespace

const Conductor* find_conductor(std::string_view name) {
  for (const Conductor& conductor : table())
    if (to_lower(conductor.name) == to_lower(name)) return &conductor;
  return nullptr;
}

std::string conductor_names() {
  std::string names;
  for (const Conductor& conductor : table())
    names += (names.empty() ? "" : ", ") + std::string(conductor.name);
  return names;
}

}  // namespace nacre
