// Voronoi cells by clipping, with neighbours from FLANN.
#include "bake/area_shares.h"

// FLANN 1.9 is not written for the warnings that nacre is compiled with.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#include <flann/flann.hpp>
#pragma GCC diagnostic pop

#include <array>

#include "bake/sheet_edges.h"
#include "nacre/base/parallel.h"
#include "nacre/cache/cache.h"

namespace nacre {
namespace {

// A convex polygon around the origin, cut by half-planes.
class Cell {
 public:
  explicit Cell(float half_size)
      : corners_{{{-half_size, -half_size},
                  {half_size, -half_size},
                  {half_size, half_size},
                  {-half_size, half_size}}},
        count_(4) {}

  /// Keeps the points p with dot(p, normal) <= offset.
  void clip(const Vec2& normal, float offset) {
    std::array<Vec2, kMaxCorners> kept;
    std::size_t kept_count = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const Vec2& a = corners_[i];
      const Vec2& b = corners_[(i + 1) % count_];
      const float da = a.dot(normal) - offset, db = b.dot(normal) - offset;
      if (da <= 0) kept[kept_count++] = a;
      if ((da < 0) != (db < 0) && da != db && kept_count < kMaxCorners)
        kept[kept_count++] = a + (b - a) * (da / (da - db));
      if (kept_count >= kMaxCorners - 1) return;  // a cell of so many sides is round enough as it is
    }
    corners_ = kept;
    count_ = kept_count;
  }
  float area() const {
    float twice = 0;
    for (std::size_t i = 0; i < count_; ++i) twice += corners_[i].cross(corners_[(i + 1) % count_]);
    return std::max(0.0f, twice / 2);
  }
  float radius() const {
    float r2 = 0;
    for (std::size_t i = 0; i < count_; ++i) r2 = std::max(r2, corners_[i].length2());
    return std::sqrt(r2);
  }

 private:
  static constexpr std::size_t kMaxCorners = 32;
  std::array<Vec2, kMaxCorners> corners_;
  std::size_t count_;
};

using Index = flann::Index<flann::L2_3D<float>>;

class ShareComputer {
 public:
  ShareComputer(const GroupSurface& surface, const std::vector<PlacedPoint>& points)
      : surface_(surface),
        points_(points),
        spacing_(
            static_cast<float>(hexagonal_spacing(surface.areas.total(), static_cast<double>(points.size())))),
        coordinates_(3 * points.size()),
        edges_(surface.sheet_edges, points, kReach * spacing_) {
    for (std::size_t i = 0; i < points.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        coordinates_[3 * i + static_cast<std::size_t>(axis)] = points[i].position[axis];
    index_ = std::make_unique<Index>(flann::Matrix<float>(coordinates_.data(), points.size(), 3),
                                     flann::KDTreeSingleIndexParams(16));
    index_->buildIndex();
  }

  float cell_area(std::size_t i, std::vector<int>& neighbours, std::vector<float>& distances2) const {
    const PlacedPoint& point = points_[i];
    const Frame frame = make_frame(point.normal);
    Cell cell(kReach * spacing_);
    clip_at_edges(point, frame, cell);
    // More neighbours are asked for only where those found do not close the cell: most lie on other sheets.
    for (std::size_t wanted = 20, done = 0;; wanted *= 4) {
      wanted = std::min(wanted, points_.size());
      const std::size_t found = find_neighbours(i, wanted, neighbours, distances2);
      float limit = 2 * cell.radius();
      for (std::size_t n = done; n < found; ++n) {
        const auto j = static_cast<std::size_t>(neighbours[n]);
        const float distance = std::sqrt(distances2[n]);
        if (distance > limit) return cell.area();
        if (j == i || dot(points_[j].normal, point.normal) <= kSameSheetCosine) continue;
        clip_by_neighbour(points_[j].position - point.position, distance, frame, cell);
        limit = 2 * cell.radius();
      }
      if (found >= points_.size() || found < wanted || wanted >= kMostNeighbours) return cell.area();
      done = found;
    }
  }

 private:
  // Cells end at this many spacings at the latest; between points that leave no room for another they are far
  // smaller.
  static constexpr float kReach = 2;
  static constexpr std::size_t kMostNeighbours = 1280;

  std::size_t find_neighbours(std::size_t i, std::size_t count, std::vector<int>& neighbours,
                              std::vector<float>& distances2) const {
    neighbours.resize(count);
    distances2.resize(count);
    flann::Matrix<float> query(const_cast<float*>(&coordinates_[3 * i]), 1, 3);
    flann::Matrix<int> indices(neighbours.data(), 1, count);
    flann::Matrix<float> dists(distances2.data(), 1, count);
    flann::SearchParams params(flann::FLANN_CHECKS_UNLIMITED, 0, true);
    params.cores = 1;
    return static_cast<std::size_t>(index_->knnSearch(query, indices, dists, count, params));
  }

  // The bisector in the tangent plane, the neighbour unfolded into it at its distance in space.
  static void clip_by_neighbour(const Vec3& offset, float distance, const Frame& frame, Cell& cell) {
    const Vec2 flat(dot(offset, frame.s), dot(offset, frame.t));
    const float flat_length = flat.length();
    if (flat_length > 0.05f * distance) cell.clip(flat / flat_length, distance / 2);
  }

  // A border or a crease is a side of the cell where its nearest point to the sample is inside an edge, or is
  // the corner of a border that bends away. Of a border in short edges that is one edge, however many are
  // near. Isolated short creases, which noise in a scan makes, end nothing.
  void clip_at_edges(const PlacedPoint& point, const Frame& frame, Cell& cell) const {
    std::array<Vec3, 32> sides;  // the nearest of all comes first
    std::size_t count = 1;
    float length = 0, nearest2 = square(kReach * spacing_);
    edges_.for_each_near(point.position, [&](const SheetEdge& edge) {
      if (edge.normal != Vec3(0) && dot(edge.normal, point.normal) <= kSameSheetCosine) return;
      const Vec3 along = edge.b - edge.a;
      const float length2 = along.length2();
      const float t = length2 > 0 ? dot(point.position - edge.a, along) / length2 : 0.0f;
      const Vec3 offset = edge.a + along * std::clamp(t, 0.0f, 1.0f) - point.position;
      if (offset.length2() > square(kReach * spacing_)) return;
      length += std::sqrt(length2);
      if (t >= 0 && t <= 1 && count < sides.size()) sides[count++] = offset;
      if (offset.length2() <= nearest2) {
        nearest2 = offset.length2();
        sides[0] = offset;
      }
    });
    if (length < spacing_) return;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec2 flat(dot(sides[i], frame.s), dot(sides[i], frame.t));
      const float flat_length = flat.length();
      if (flat_length > 0) cell.clip(flat / flat_length, sides[i].length());
    }
  }

  const GroupSurface& surface_;
  const std::vector<PlacedPoint>& points_;
  float spacing_;
  std::vector<float> coordinates_;
  SheetEdgeGrid edges_;
  std::unique_ptr<Index> index_;
};

// Scales each piece's shares to its area; pieces too small to hold a point leave theirs to all the others.
void scale_shares(const GroupSurface& surface, const std::vector<PlacedPoint>& points,
                  std::vector<float>& shares) {
  std::vector<double> wanted(surface.component_count, 0.0), got(surface.component_count, 0.0);
  const auto cumulative = surface.areas.cumulative();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    wanted[surface.components[t]] += cumulative[t] - (t ? cumulative[t - 1] : 0);
  for (std::size_t i = 0; i < points.size(); ++i) got[surface.components[points[i].triangle]] += shares[i];
  double covered = 0;
  for (std::uint32_t c = 0; c < surface.component_count; ++c)
    if (got[c] > 0) covered += wanted[c];
  const double rest = covered > 0 ? surface.areas.total() / covered : 1;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::uint32_t c = surface.components[points[i].triangle];
    if (got[c] > 0) shares[i] = static_cast<float>(shares[i] * (wanted[c] / got[c]) * rest);
  }
}

}  // namespace

std::vector<float> compute_area_shares(const GroupSurface& surface, const std::vector<PlacedPoint>& points,
                                       Progress& progress) {
  std::vector<float> shares(points.size());
  if (points.empty()) return shares;
  const ShareComputer computer(surface, points);
  progress.begin("dividing the surface", "samples", points.size());
  parallel_for(points.size(), 1024, [&](std::size_t begin, std::size_t end) {
    std::vector<int> neighbours;
    std::vector<float> distances2;
    for (std::size_t i = begin; i < end; ++i) shares[i] = computer.cell_area(i, neighbours, distances2);
    progress.advance(end - begin);
  });
  progress.end();
  scale_shares(surface, points, shares);
  return shares;
}

}  // namespace nacre
