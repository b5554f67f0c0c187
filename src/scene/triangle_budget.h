// How much a scene may hold.
#pragma once

#include <cstddef>
#include <string>

namespace nacre {

/// Counts what a scene has, before it is there: a scene of a few lines must not fill the memory. All throw
/// Error(kLimit, place) where it is more than the memory of a machine or, of what subdivision makes, more
/// than files of that size could mean.
class TriangleBudget {
 public:
  void charge(std::size_t triangles, std::size_t shapes, const std::string& place);
  /// `made` triangles out of `read` that a file holds, or out of none of a built-in shape.
  void charge_subdivision(std::size_t made, std::size_t read, const std::string& place);
  /// Copies of `made` triangles that subdivision has made.
  void charge_copies(std::size_t count, std::size_t made, const std::string& place);
  /// Of spheres and the like, and their copies.
  void charge_built_in(std::size_t triangles, const std::string& place);
  /// So far.
  std::size_t made() const { return made_; }
  std::size_t built_in() const { return built_in_; }

 private:
  std::size_t triangles_ = 0, shapes_ = 0, made_ = 0, read_ = 0, built_in_ = 0;
};

}  // namespace nacre
