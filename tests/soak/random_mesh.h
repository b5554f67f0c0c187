// Meshes as they come from scanners and strangers.
#pragma once

#include <string>

#include "soak/dice.h"

namespace nacre::soak {

/// Writes a closed bumpy body about 1 in radius as an .obj, .ply or .off file, now and then with holes, faces
/// turned around, slivers or vertices that nobody uses; returns the type, which is also its ending.
std::string write_random_mesh(Dice& dice, const std::string& path_without_ending);

}  // namespace nacre::soak
