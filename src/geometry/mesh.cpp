// Measures, transforms and vertex normals of triangle meshes.
#include "nacre/geometry/mesh.h"

#include <bit>
#include <span>

#include "nacre/base/error.h"
#include "nacre/base/parallel.h"
#include "nacre/base/random.h"

namespace nacre {
namespace {

// Products of edges in double precision: they neither cancel nor underflow for any float coordinates that
// occur.
Vec3d area_vector_double(const Mesh& mesh, const Triangle& t) {
  const Vec3d a(mesh.positions[t[0]]);
  return (Vec3d(mesh.positions[t[1]]) - a).cross(Vec3d(mesh.positions[t[2]]) - a);
}

// Stable also for tiny and nearly straight angles, unlike acos. Source: Kahan 2006, "How futile are mindless
// assessments of roundoff", section 12 (in its cross product form).
double angle_between(const Vec3d& a, const Vec3d& b) { return std::atan2(a.cross(b).length(), a.dot(b)); }

std::uint64_t bits_of(float x) { return std::bit_cast<std::uint32_t>(x == 0.0f ? 0.0f : x); }

// The corners (3 * triangle + position in it) around each welded vertex: those of vertex v are
// corners[starts[v]] to corners[starts[v + 1] - 1].
struct CornerTable {
  std::vector<std::size_t> starts;
  std::vector<std::uint32_t> corners;
};

CornerTable make_corner_table(const Mesh& mesh) {
  const std::vector<std::uint32_t> weld = weld_map(mesh);
  CornerTable table;
  table.starts.assign(mesh.positions.size() + 1, 0);
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) ++table.starts[weld[v] + 1];
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) table.starts[v + 1] += table.starts[v];
  table.corners.resize(3 * mesh.triangles.size());
  std::vector<std::size_t> next(table.starts.begin(), table.starts.end() - 1);
  for (std::size_t i = 0; i < table.corners.size(); ++i)
    table.corners[next[weld[mesh.triangles[i / 3][i % 3]]]++] = static_cast<std::uint32_t>(i);
  return table;
}

// One corner as it counts for the normal of its vertex.
struct Corner {
  Vec3d face_normal;  // unit, or zero for a degenerate triangle
  Vec3d weighted;     // times the angle between the two edges
};

Corner make_corner(const Mesh& mesh, std::uint32_t index) {
  const Triangle& t = mesh.triangles[index / 3];
  const std::size_t k = index % 3;
  const Vec3d p(mesh.positions[t[k]]);
  const double angle =
      angle_between(Vec3d(mesh.positions[t[(k + 1) % 3]]) - p, Vec3d(mesh.positions[t[(k + 2) % 3]]) - p);
  const Vec3d face_normal = area_vector_double(mesh, t).normalized();
  return {face_normal, face_normal * angle};
}

Vec3 to_unit_normal(const Vec3d& sum, const Vec3d& fallback) {
  Vec3d n = sum.normalized();
  if (n == Vec3d(0)) n = fallback == Vec3d(0) ? Vec3d(0, 0, 1) : fallback;
  return Vec3(n);
}

}  // namespace

std::vector<double> triangle_areas(const Mesh& mesh) {
  std::vector<double> areas;
  areas.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) areas.push_back(0.5 * area_vector_double(mesh, t).length());
  return areas;
}

double surface_area(const Mesh& mesh) {
  double sum = 0;
  for (const Triangle& t : mesh.triangles) sum += area_vector_double(mesh, t).length();
  return 0.5 * sum;
}

double signed_volume(const Mesh& mesh) {
  if (mesh.triangles.empty()) return 0;
  // Tetrahedra to a point of the mesh instead of the origin: less cancellation for meshes far away from it.
  const Vec3d apex(mesh.positions[mesh.triangles[0][0]]);
  double sum = 0;
  for (const Triangle& t : mesh.triangles)
    sum += area_vector_double(mesh, t).dot(Vec3d(mesh.positions[t[0]]) - apex);
  return sum / 6.0;
}

Box3 bounds(const Mesh& mesh) {
  Box3 box;
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) box.extendBy(mesh.positions[v]);
  return box;
}

void transform_mesh(Mesh& mesh, const Matrix4& to_world, const std::string& place) {
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column)
      if (!std::isfinite(to_world[row][column]))
        fail(ErrorCode::kValue, place, "the transform has an entry that is not a finite number");
  const Vec3d projective(to_world[0][3], to_world[1][3], to_world[2][3]);
  if (!(projective.length() < 1e-9 && std::abs(to_world[3][3] - 1) < 1e-9))
    fail(ErrorCode::kValue, place, "the transform is not affine: its last row has to be 0 0 0 1");
  const Vec3d x(to_world[0][0], to_world[0][1], to_world[0][2]);
  const Vec3d y(to_world[1][0], to_world[1][1], to_world[1][2]);
  const Vec3d z(to_world[2][0], to_world[2][1], to_world[2][2]);
  const Vec3d origin(to_world[3][0], to_world[3][1], to_world[3][2]);
  // The axes without their lengths: a mere change of units, however large, is never called singular.
  const Vec3d xu = x.normalized(), yu = y.normalized(), zu = z.normalized();
  const double determinant = xu.dot(yu.cross(zu));
  if (!(std::abs(determinant) > 1e-12))
    fail(ErrorCode::kValue, place, "the transform is singular: it would flatten the shape");

  for (Vec3& p : mesh.positions) {
    p = Vec3(x * double{p.x} + y * double{p.y} + z * double{p.z} + origin);
    if (!is_finite(p)) fail(ErrorCode::kValue, place, "the transform moves the shape out of range");
  }
  // Inverse transpose: the cofactors over the determinant, of which only the sign outlives normalization.
  const double sign = std::copysign(1.0, determinant);
  const Vec3d nx = yu.cross(zu) * (sign / x.length());
  const Vec3d ny = zu.cross(xu) * (sign / y.length());
  const Vec3d nz = xu.cross(yu) * (sign / z.length());
  for (Vec3& n : mesh.normals)
    n = Vec3((nx * double{n.x} + ny * double{n.y} + nz * double{n.z}).normalized());
  if (determinant < 0)
    for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
}

void flip_normals(Mesh& mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  for (Vec3& n : mesh.normals) n = -n;
}

std::vector<std::uint32_t> weld_map(const Mesh& mesh) {
  const std::size_t count = mesh.positions.size();
  std::vector<std::uint32_t> map(count);
  // Open addressing; a slot holds the first vertex of its position.
  constexpr std::uint32_t kFree = 0xffffffffu;
  std::vector<std::uint32_t> slots(std::bit_ceil(2 * count + 1), kFree);
  const std::size_t mask = slots.size() - 1;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec3& p = mesh.positions[i];
    const auto same = [&](const Vec3& q) {
      return bits_of(p.x) == bits_of(q.x) && bits_of(p.y) == bits_of(q.y) && bits_of(p.z) == bits_of(q.z);
    };
    std::size_t at = hash_words(bits_of(p.x) << 32 | bits_of(p.y), bits_of(p.z)) & mask;
    while (slots[at] != kFree && !same(mesh.positions[slots[at]])) at = (at + 1) & mask;
    if (slots[at] == kFree) slots[at] = i;
    map[i] = slots[at];
  }
  return map;
}

void compute_normals(Mesh& mesh, double max_smooth_angle) {
  const CornerTable table = make_corner_table(mesh);
  const bool smooth_all = max_smooth_angle >= 180;
  // A hair wider than asked, so that faces exactly at the limit do not depend on rounding.
  const double min_cosine = smooth_all ? -2.0 : std::cos(max_smooth_angle * (kPiD / 180)) - 1e-7;
  // Comparing all pairs of corners around a vertex is quadratic: absurdly large fans are smoothed as a whole.
  constexpr std::size_t kMaxCompared = 1024;

  std::vector<Vec3> corner_normals(table.corners.size());
  parallel_for(mesh.positions.size(), 4096, [&](std::size_t begin, std::size_t end) {
    std::vector<Corner> around;
    for (std::size_t v = begin; v < end; ++v) {
      const std::span<const std::uint32_t> corners(table.corners.data() + table.starts[v],
                                                   table.starts[v + 1] - table.starts[v]);
      around.clear();
      Vec3d total(0), any_face(0);
      for (const std::uint32_t index : corners) {
        around.push_back(make_corner(mesh, index));
        total += around.back().weighted;
        if (any_face == Vec3d(0)) any_face = around.back().face_normal;
      }
      for (std::size_t i = 0; i < corners.size(); ++i) {
        const Corner& corner = around[i];
        const bool smooth_whole =
            smooth_all || corners.size() > kMaxCompared || corner.face_normal == Vec3d(0);
        Vec3d sum(0);
        if (!smooth_whole)
          for (const Corner& other : around)
            if (&other == &corner || corner.face_normal.dot(other.face_normal) >= min_cosine)
              sum += other.weighted;
        corner_normals[corners[i]] =
            smooth_whole ? to_unit_normal(total, any_face) : to_unit_normal(sum, corner.face_normal);
      }
    }
  });

  // A vertex stays one where all of its corners agree, else it gets one copy for each normal. Corners of one
  // smooth group sum the same terms in the same order, so equality is exact.
  constexpr std::uint32_t kNone = 0xffffffffu;
  const std::size_t old_count = mesh.positions.size();
  mesh.normals.assign(old_count, Vec3(0));
  std::vector<std::uint32_t> next_copy(old_count, kNone);
  std::vector<bool> used(old_count, false);
  for (std::size_t i = 0; i < table.corners.size(); ++i) {
    std::uint32_t& corner = mesh.triangles[i / 3][i % 3];
    const Vec3& normal = corner_normals[i];
    std::uint32_t v = corner;
    if (!used[v]) {
      used[v] = true;
      mesh.normals[v] = normal;
      continue;
    }
    while (mesh.normals[v] != normal && next_copy[v] != kNone) v = next_copy[v];
    if (mesh.normals[v] != normal) {
      const auto copy = static_cast<std::uint32_t>(mesh.positions.size());
      const Vec3 position = mesh.positions[v];
      mesh.positions.push_back(position);
      mesh.normals.push_back(normal);
      if (!mesh.uvs.empty()) {
        const Vec2 uv = mesh.uvs[v];
        mesh.uvs.push_back(uv);
      }
      next_copy.push_back(kNone);
      next_copy[v] = copy;
      v = copy;
    }
    corner = v;
  }
  for (std::size_t v = 0; v < old_count; ++v)
    if (!used[v]) mesh.normals[v] = Vec3(0, 0, 1);
}

}  // namespace nacre
