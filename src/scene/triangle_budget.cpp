// Limits on triangles and shapes.
#include "scene/triangle_budget.h"

#include "nacre/base/error.h"

namespace nacre {
namespace {

constexpr std::size_t kMaxTriangles = 200'000'000;  // of all shapes together
constexpr std::size_t kMaxShapes = 1'000'000;
// Triangles that subdivision makes, and for each that a file holds; a copy takes a quarter of their memory.
constexpr std::size_t kMaxMade = 4'000'000, kMaxMadePerRead = 16, kCopiesEach = 4;

// About a gigabyte.
constexpr std::size_t kMaxBuiltIn = 8'000'000;

}  // namespace

void TriangleBudget::charge(std::size_t triangles, std::size_t shapes, const std::string& place) {
  triangles_ += triangles;
  shapes_ += shapes;
  if (triangles_ > kMaxTriangles)
    fail(ErrorCode::kLimit, place, "up to here the scene has {} triangles, more than {}", triangles_,
         kMaxTriangles);
  if (shapes_ > kMaxShapes)
    fail(ErrorCode::kLimit, place, "up to here the scene has {} shapes, more than {}", shapes_, kMaxShapes);
}

void TriangleBudget::charge_subdivision(std::size_t made, std::size_t read, const std::string& place) {
  made_ += made;
  read_ += read;
  if (made_ > kMaxMade + kMaxMadePerRead * read_)
    fail(ErrorCode::kLimit, place,
         "up to here subdivisions make {} triangles; {} are the most, and {} for each of the {} that files "
         "hold: "
         "use fewer",
         made_, kMaxMade, kMaxMadePerRead, read_);
}

void TriangleBudget::charge_built_in(std::size_t triangles, const std::string& place) {
  built_in_ += triangles;
  if (built_in_ > kMaxBuiltIn)
    fail(ErrorCode::kLimit, place,
         "up to here spheres, cubes and the like have {} triangles, more than {}: use fewer, or mesh files",
         built_in_, kMaxBuiltIn);
}

void TriangleBudget::charge_copies(std::size_t count, std::size_t made, const std::string& place) {
  charge_subdivision(count * (made / kCopiesEach), 0, place);
}

}  // namespace nacre
