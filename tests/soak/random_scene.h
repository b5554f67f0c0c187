// Scenes made up at random: shapes, media, surfaces, lights and cameras of every kind.
#pragma once

#include <cstdint>
#include <string>

namespace nacre::soak {

/// Writes scene.xml, and the meshes and pictures that it names, into a folder; returns its path. The same
/// seed gives the same scene.
std::string write_random_scene(std::uint64_t seed, const std::string& folder);

}  // namespace nacre::soak
