// Cells by clipping; FLANN finds the neighbours of those that the nearest do not close.
#include "bake/voronoi_cells.h"

// FLANN 1.9 is not written for the warnings that nacre is compiled with.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wall"
#pragma GCC diagnostic ignored "-Wextra"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wconversion"
#include <flann/flann.hpp>
#pragma GCC diagnostic pop

#include <bit>
#include <optional>

#include "bake/sheet_edges.h"

namespace nacre {
namespace {

// A convex polygon around the origin, cut by half-planes.
class Cell {
 public:
  explicit Cell(float half_size) : count_(4), radius2_(2 * half_size * half_size) {
    corners_[0] = {-half_size, -half_size};
    corners_[1] = {half_size, -half_size};
    corners_[2] = {half_size, half_size};
    corners_[3] = {-half_size, half_size};
  }

  /// Keeps the points p with dot(p, direction) <= offset, whatever the length of `direction`.
  void clip(const Vec2& direction, float offset) {
    std::array<float, kMaxCorners> heights;  // above the line, in that length
    float highest = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      heights[i] = corners_[i].dot(direction) - offset;
      highest = std::max(highest, heights[i]);
    }
    if (!(highest > 0) || count_ + 2 > kMaxCorners) return;  // a cell of so many sides is round enough
    std::array<Vec2, kMaxCorners> kept;
    std::size_t kept_count = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const std::size_t next = i + 1 < count_ ? i + 1 : 0;
      if (heights[i] <= 0) kept[kept_count++] = corners_[i];
      if ((heights[i] < 0) != (heights[next] < 0) && heights[i] != heights[next])
        kept[kept_count++] =
            corners_[i] + (corners_[next] - corners_[i]) * (heights[i] / (heights[i] - heights[next]));
    }
    count_ = kept_count;
    radius2_ = 0;
    for (std::size_t i = 0; i < kept_count; ++i) {
      corners_[i] = kept[i];
      radius2_ = std::max(radius2_, kept[i].length2());
    }
  }
  float area() const {
    float twice = 0;
    for (std::size_t i = 0; i < count_; ++i) twice += corners_[i].cross(corners_[i + 1 < count_ ? i + 1 : 0]);
    return std::max(0.0f, twice / 2);
  }
  float radius2() const { return radius2_; }

 private:
  static constexpr std::size_t kMaxCorners = 32;
  std::array<Vec2, kMaxCorners> corners_;
  std::size_t count_;
  float radius2_;
};

// A search without a limit on distance, over the points of a block and those around it.
class FarNeighbours {
 public:
  FarNeighbours(const PointBlocks& blocks, const BlockNeighbourhood& near,
                std::span<const PlacedPoint> points) {
    blocks.for_each_around(near, [&](std::uint32_t i) {
      points_.push_back(i);
      for (int axis = 0; axis < 3; ++axis) coordinates_.push_back(points[i].position[axis]);
    });
    index_.emplace(flann::Matrix<float>(coordinates_.data(), points_.size(), 3),
                   flann::KDTreeSingleIndexParams(16));
    index_->buildIndex();
  }
  /// Calls visit(point index) for the points nearer than a distance, the nearest first.
  template <class Visit>
  void for_each_within(const Vec3& position, float distance, const Visit& visit) {
    flann::Matrix<float> query(const_cast<float*>(&position.x), 1, 3);
    flann::SearchParams params(flann::FLANN_CHECKS_UNLIMITED, 0, true);
    params.cores = 1;
    index_->radiusSearch(query, found_, distances2_, square(distance), params);
    for (const int i : found_[0]) visit(points_[static_cast<std::size_t>(i)]);
  }

 private:
  std::vector<std::uint32_t> points_;
  std::vector<float> coordinates_;
  std::optional<flann::Index<flann::L2_3D<float>>> index_;
  std::vector<std::vector<int>> found_;
  std::vector<std::vector<float>> distances2_;
};

class CellCutter {
 public:
  CellCutter(const GroupSurface& surface, std::span<const PlacedPoint> points, const PointBlocks& blocks,
             float spacing)
      : points_(points), blocks_(blocks), spacing_(spacing), edges_(surface.sheet_edges) {}

  void cut(const BlockNeighbourhood& near, CellAreas& cells) const {
    std::optional<FarNeighbours> far;
    Box3 box = near.box();
    box.min -= Vec3(kCellReach * spacing_);
    box.max += Vec3(kCellReach * spacing_);
    const bool edges_near = edges_.any_in(box);
    const BlockNeighbourhood::Entries& entries = near.entries();
    // Their squared distances, of which as floats above 0 the bits are in order, and which entries they are.
    std::vector<std::uint64_t> neighbours(entries.size() + 1);
    std::vector<float> distances2(entries.size());
    const float reach2 = square(kCellReach * spacing_);
    for (const std::uint32_t i : near.own()) {
      const PlacedPoint& point = points_[i];
      const Frame frame = make_frame(point.normal);
      Cell cell(kCellReach * spacing_);
      const float border2 = edges_near ? clip_at_edges(point, frame, cell) : reach2;
      // Nearly every cell is closed by what is that near.
      float done2 = 0;
      for (const float within2 : {square(kUsualReach * spacing_), reach2}) {
        if (4 * cell.radius2() <= done2) break;
        std::size_t count = 0;
        near.for_each_range_near(point.position, [&](std::size_t begin, std::size_t end) {
          for (std::size_t e = begin; e < end; ++e)
            distances2[e - begin] = (entries.position(e) - point.position).length2();
          for (std::size_t e = begin; e < end; ++e) {
            // Without a branch for each. The point itself, at no distance, will cut nothing.
            const float distance2 = distances2[e - begin];
            neighbours[count] = std::uint64_t{std::bit_cast<std::uint32_t>(distance2)} << 32 | e;
            count += (distance2 < within2) & (distance2 >= done2);
          }
        });
        std::sort(neighbours.begin(), neighbours.begin() + static_cast<std::ptrdiff_t>(count));
        for (std::size_t n = 0; n < count; ++n) {
          if (std::bit_cast<float>(static_cast<std::uint32_t>(neighbours[n] >> 32)) > 4 * cell.radius2())
            break;
          const auto e = static_cast<std::uint32_t>(neighbours[n]);
          clip_by_neighbour(point, entries.position(e), entries.normal(e), frame, cell);
        }
        done2 = within2;
      }
      // Where most of what is near lies on other sheets, or nothing is near at all.
      if (4 * cell.radius2() > reach2) {
        if (!far) far.emplace(blocks_, near, points_);
        far->for_each_within(point.position, 2 * std::sqrt(cell.radius2()), [&](std::uint32_t j) {
          if (j != i) clip_by_neighbour(point, points_[j].position, points_[j].normal, frame, cell);
        });
      }
      cells.areas[i] = cell.area();
      cells.closed[i] = cell.radius2() < border2;
    }
  }

 private:
  static constexpr float kUsualReach = 1.45f;  // spacings

  // The bisector in the tangent plane, the neighbour unfolded into it at its distance in space.
  static void clip_by_neighbour(const PlacedPoint& point, const Vec3& position, const Vec3& normal,
                                const Frame& frame, Cell& cell) {
    if (dot(normal, point.normal) <= kSameSheetCosine) return;
    const Vec3 offset = position - point.position;
    const Vec2 flat(dot(offset, frame.s), dot(offset, frame.t));
    const float flat2 = flat.length2(), distance2 = offset.length2();
    if (flat2 > square(0.05f) * distance2) cell.clip(flat, std::sqrt(flat2 * distance2) / 2);
  }

  // A border or a crease is a side of the cell where its nearest point to the sample is inside an edge, or is
  // the corner of a border that bends away. Of a border in short edges that is one edge, however many are
  // near. Isolated short creases, which noise in a scan makes, end nothing. Returns the squared distance of
  // the nearest side, or of the cell's reach.
  float clip_at_edges(const PlacedPoint& point, const Frame& frame, Cell& cell) const {
    std::array<Vec3, 32> sides;  // the nearest of all comes first
    std::size_t count = 1;
    const float reach = kCellReach * spacing_, reach2 = square(reach);
    float length = 0, nearest2 = reach2;
    edges_.for_each_in({point.position - Vec3(reach), point.position + Vec3(reach)},
                       [&](const SheetEdge& edge) {
                         if (edge.normal != Vec3(0) && dot(edge.normal, point.normal) <= kSameSheetCosine)
                           return;
                         const Vec3 along = edge.b - edge.a;
                         const float length2 = along.length2();
                         const float t = length2 > 0 ? dot(point.position - edge.a, along) / length2 : 0.0f;
                         const Vec3 offset = edge.a + along * std::clamp(t, 0.0f, 1.0f) - point.position;
                         if (offset.length2() > reach2) return;
                         length += std::sqrt(length2);
                         if (t >= 0 && t <= 1 && count < sides.size()) sides[count++] = offset;
                         if (offset.length2() <= nearest2) {
                           nearest2 = offset.length2();
                           sides[0] = offset;
                         }
                       });
    if (length < spacing_) return reach2;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec2 flat(dot(sides[i], frame.s), dot(sides[i], frame.t));
      const float flat_length = flat.length();
      if (flat_length > 0) cell.clip(flat / flat_length, sides[i].length());
    }
    return nearest2;
  }

  std::span<const PlacedPoint> points_;
  const PointBlocks& blocks_;
  float spacing_;
  SheetEdgeTree edges_;
};

}  // namespace

CellAreas compute_cell_areas(const GroupSurface& surface, std::span<const PlacedPoint> points,
                             const PointBlocks& blocks, float spacing, Progress& progress) {
  CellAreas cells{std::vector<float>(points.size()), std::vector<std::uint8_t>(points.size())};
  const CellCutter cutter(surface, points, blocks, spacing);
  progress.begin("dividing the surface", "samples", points.size());
  blocks.for_each_block([&](const BlockNeighbourhood& near) {
    cutter.cut(near, cells);
    progress.advance(near.own().size());
  });
  progress.end();
  return cells;
}

}  // namespace nacre
