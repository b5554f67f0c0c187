// Points on pieces, and rays from there to other pieces.
#include "nacre/geometry/piece_faults.h"

#include <algorithm>
#include <map>
#include <optional>
#include <tuple>

#include "geometry/edge_table.h"
#include "nacre/base/parallel.h"
#include "nacre/base/random.h"
#include "nacre/base/sampling.h"
#include "nacre/geometry/ray_tracer.h"

namespace nacre {
namespace {

constexpr std::size_t kPoints = 64, kFirstPoints = 4;  // on each piece; to rule most pieces out
constexpr double kExact = 1e-6;    // share of a piece's size within which surfaces are the same
constexpr double kNear = 1e-2;     // and above which they are never near
constexpr double kFlat = 1e-5;     // thickness over size of what encloses nothing
constexpr float kParallel = 0.9f;  // cosine of normals that face the same way
constexpr std::size_t kMostPairs = std::size_t{1} << 24;  // of boxes that are compared

struct Piece {
  std::uint32_t mesh = 0;
  std::vector<std::uint32_t> triangles;
  double area = 0, volume = 0;  // the latter seen from the middle of its box
  Vec3d area_vector{0, 0, 0};
  Box3 box;
  double size() const { return Vec3d(box.max - box.min).length(); }
};

// The pieces of all meshes, and for every triangle which one it is part of.
struct Pieces {
  std::vector<Piece> all;
  std::vector<std::vector<std::uint32_t>> of_triangle;  // by mesh
};

void add_pieces(const Mesh& mesh, std::uint32_t index, Pieces& pieces) {
  constexpr std::uint32_t kNone = ~0u;
  const std::vector<std::uint32_t> weld = weld_map(mesh);
  DisjointSets sets(mesh.positions.size());
  for (const Triangle& t : mesh.triangles) {
    sets.unite(weld[t[0]], weld[t[1]]);
    sets.unite(weld[t[0]], weld[t[2]]);
  }
  std::vector<std::uint32_t> numbers(mesh.positions.size(), kNone);
  std::vector<std::uint32_t>& of_triangle = pieces.of_triangle.emplace_back();
  of_triangle.reserve(mesh.triangles.size());
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    std::uint32_t& number = numbers[sets.find(weld[mesh.triangles[i][0]])];
    if (number == kNone) {
      number = static_cast<std::uint32_t>(pieces.all.size());
      pieces.all.push_back({index, {}, 0, 0, Vec3d(0), {}});
    }
    of_triangle.push_back(number);
    Piece& piece = pieces.all[number];
    piece.triangles.push_back(i);
    for (const std::uint32_t v : mesh.triangles[i]) piece.box.extendBy(mesh.positions[v]);
  }
}

void measure(const Mesh& mesh, Piece& piece) {
  const Vec3d middle(piece.box.center());
  for (const std::uint32_t i : piece.triangles) {
    const Triangle& t = mesh.triangles[i];
    const Vec3d a = Vec3d(mesh.positions[t[0]]) - middle, b = Vec3d(mesh.positions[t[1]]) - middle,
                c = Vec3d(mesh.positions[t[2]]) - middle, n = (b - a).cross(c - a) * 0.5;
    piece.area += n.length();
    piece.area_vector += n;
    piece.volume += a.dot(n) / 3;
  }
}

bool is_flat(const Piece& piece) {
  const bool closed = piece.area_vector.length() <= 1e-3 * piece.area;
  return closed && piece.area > 0 && 2 * std::abs(piece.volume) <= kFlat * piece.size() * piece.area;
}

// Which pieces may lie on or in another one, by their boxes.
std::vector<std::uint32_t> find_candidates(const Pieces& pieces) {
  std::vector<std::uint32_t> candidates;
  const std::size_t count = pieces.all.size();
  const bool all = count > 1 && count * count > kMostPairs;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Box3& box = pieces.all[i].box;
    const Vec3 margin(static_cast<float>(kNear * pieces.all[i].size()));
    const auto meets = [&](const Piece& other) {
      for (int k = 0; k < 3; ++k)
        if (other.box.min[k] > box.max[k] + margin[k] || other.box.max[k] < box.min[k] - margin[k])
          return false;
      return &other != &pieces.all[i];
    };
    if (all || std::ranges::any_of(pieces.all, meets)) candidates.push_back(i);
  }
  return candidates;
}

struct Point {
  Vec3 position, normal;
};

class Judge {
 public:
  Judge(std::span<const Mesh* const> meshes, const Pieces& pieces, float near)
      : meshes_(meshes), pieces_(pieces), near_(near), tracer_(meshes), passable_(meshes.size(), 1) {}

  struct Verdict {
    PieceFault fault;
    std::uint32_t other;  // piece
  };
  std::optional<Verdict> judge(std::uint32_t index) const {
    std::vector<Point> points = spread_points(index, kFirstPoints);
    std::vector<Hit> hits;
    if (count_inside(index, points, hits).first < points.size() && !touches(index, points, hits))
      return std::nullopt;
    points = spread_points(index, kPoints);
    if (const auto verdict = find_twin(index, points, hits))
      return verdict->other < index ? verdict : std::nullopt;
    const auto [inside, around] = count_inside(index, points, hits);
    if (inside < points.size() || !(pieces_.all[index].volume > 0)) return std::nullopt;
    return Verdict{PieceFault::kInside, around};
  }

 private:
  // By area, each from its own part of the piece's triangles.
  std::vector<Point> spread_points(std::uint32_t index, std::size_t count) const {
    const Piece& piece = pieces_.all[index];
    const Mesh& mesh = *meshes_[piece.mesh];
    std::vector<Point> points;
    double sum = 0;
    for (const std::uint32_t i : piece.triangles) {
      const double area = 0.5 * double{area_vector(mesh, i).length()};
      sum += area;
      while (points.size() < count &&
             sum > (static_cast<double>(points.size()) + 0.5) / static_cast<double>(count) * piece.area) {
        const Vec2 b = sample_uniform_triangle(sobol_2d(static_cast<std::uint32_t>(points.size()), index));
        points.push_back({hit_position(mesh, {0, piece.mesh, i, b.x, b.y}), face_normal(mesh, i)});
      }
    }
    return points;
  }

  double reach(const Piece& piece) const { return std::min(double{near_}, kNear * piece.size()); }

  // Hits of a ray with other pieces.
  template <class Visit>
  void visit_others(std::uint32_t index, const Ray& ray, std::vector<Hit>& hits, const Visit& visit) const {
    if (!tracer_.collect(ray, passable_, hits)) return;
    for (const Hit& hit : hits)
      if (const std::uint32_t other = pieces_.of_triangle[hit.mesh][hit.triangle]; other != index)
        visit(hit, other);
  }

  // What lies within reach of a point, on the straight line through it along the normal.
  template <class Visit>
  void visit_near(std::uint32_t index, const Point& point, std::vector<Hit>& hits, const Visit& visit) const {
    const Piece& piece = pieces_.all[index];
    const auto length = static_cast<float>(std::max(reach(piece), 2 * exact(piece)));
    visit_others(index, {point.position - point.normal * length, point.normal, 0, 2 * length}, hits,
                 [&](const Hit& hit, std::uint32_t other) {
                   const float cosine = dot(face_normal(*meshes_[hit.mesh], hit.triangle), point.normal);
                   visit(std::abs(double{hit.t} - double{length}), cosine, other);
                 });
  }

  // Positions are as exact as their coordinates.
  double exact(const Piece& piece) const {
    float largest = 0;
    for (int k = 0; k < 3; ++k)
      largest = std::max({largest, std::abs(piece.box.min[k]), std::abs(piece.box.max[k])});
    return std::max(kExact * piece.size(), 0x1p-21 * double{largest});
  }

  bool touches(std::uint32_t index, const std::vector<Point>& points, std::vector<Hit>& hits) const {
    bool found = false;
    for (const Point& point : points)
      visit_near(index, point, hits, [&](double, float, std::uint32_t) { found = true; });
    return found;
  }

  // The first piece that half of this one lies on.
  std::optional<Verdict> find_twin(std::uint32_t index, const std::vector<Point>& points,
                                   std::vector<Hit>& hits) const {
    std::map<std::uint32_t, std::array<std::size_t, 3>> counts;  // of points, by PieceFault
    const double same = exact(pieces_.all[index]);
    for (const Point& point : points) {
      std::map<std::uint32_t, std::array<bool, 3>> found;
      visit_near(index, point, hits, [&](double distance, float cosine, std::uint32_t other) {
        auto& [copy, near, back] = found[other];
        copy = copy || (cosine > kParallel && distance <= same);
        near = near || cosine > kParallel;
        back = back || (cosine < -kParallel && distance <= same);
      });
      for (const auto& [other, is] : found)
        for (std::size_t k = 0; k < is.size(); ++k) counts[other][k] += is[k];
    }
    for (const PieceFault fault : {PieceFault::kCopy, PieceFault::kNearCopy, PieceFault::kBackSide})
      for (const auto& [other, count] : counts)
        if (2 * count[static_cast<std::size_t>(fault)] > points.size()) return Verdict{fault, other};
    return std::nullopt;
  }

  // How many points are inside of other pieces in whatever direction one looks, and of which.
  std::pair<std::size_t, std::uint32_t> count_inside(std::uint32_t index, const std::vector<Point>& points,
                                                     std::vector<Hit>& hits) const {
    static const std::array<Vec3, 4> kDirections{
        Vec3(0.7071f, 0.5236f, 0.4759f).normalized(), Vec3(-0.6180f, -0.4142f, 0.6667f).normalized(),
        Vec3(0.3010f, -0.8329f, -0.4646f).normalized(), Vec3(-0.4815f, 0.6309f, -0.6093f).normalized()};
    std::size_t inside = 0;
    std::uint32_t around = 0;
    for (const Point& point : points) {
      int least = 1;
      for (const Vec3& direction : kDirections) {
        int depth = 0;
        visit_others(index, {point.position, direction}, hits, [&](const Hit& hit, std::uint32_t other) {
          const bool leaves = dot(face_normal(*meshes_[hit.mesh], hit.triangle), direction) > 0;
          depth += leaves ? 1 : -1;
          if (leaves) around = other;
        });
        least = std::min(least, depth);
      }
      if (least < 1) break;
      ++inside;
    }
    return {inside, around};
  }

  std::span<const Mesh* const> meshes_;
  const Pieces& pieces_;
  float near_;
  RayTracer tracer_;
  std::vector<std::uint8_t> passable_;
};

}  // namespace

std::vector<FaultyPieces> find_faulty_pieces(std::span<const Mesh* const> meshes, float near) {
  Pieces pieces;
  for (std::uint32_t i = 0; i < meshes.size(); ++i) add_pieces(*meshes[i], i, pieces);
  parallel_for(pieces.all.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) measure(*meshes[pieces.all[i].mesh], pieces.all[i]);
  });
  std::vector<std::optional<Judge::Verdict>> verdicts(pieces.all.size());
  if (const std::vector<std::uint32_t> candidates = find_candidates(pieces); !candidates.empty()) {
    const Judge judge(meshes, pieces, near);
    parallel_for(candidates.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) verdicts[candidates[i]] = judge.judge(candidates[i]);
    });
  }
  std::vector<FaultyPieces> faults;
  std::map<std::tuple<std::uint32_t, PieceFault>, std::size_t> places;
  for (std::uint32_t i = 0; i < pieces.all.size(); ++i) {
    if (!verdicts[i] && is_flat(pieces.all[i])) verdicts[i] = Judge::Verdict{PieceFault::kFlat, i};
    if (!verdicts[i]) continue;
    const auto [fault, other] = *verdicts[i];
    const auto [place, is_new] = places.try_emplace({pieces.all[i].mesh, fault}, faults.size());
    if (is_new) faults.push_back({fault, pieces.all[i].mesh, pieces.all[other].mesh, 0});
    ++faults[place->second].pieces;
  }
  return faults;
}

}  // namespace nacre
