// label: unit
// Pieces that are no boundary of a body, and those that look like it and are.
#include "nacre/geometry/piece_faults.h"

#include <gtest/gtest.h>

#include "transport/scene_parts.h"

namespace nacre {
namespace {

using namespace testing_support;

std::vector<FaultyPieces> find(const std::vector<Mesh>& meshes, float near = 0) {
  std::vector<const Mesh*> pointers;
  for (const Mesh& mesh : meshes) pointers.push_back(&mesh);
  return find_faulty_pieces(pointers, near);
}

void expect_one(const std::vector<FaultyPieces>& found, PieceFault fault, std::size_t mesh, std::size_t other,
                std::size_t pieces = 1) {
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].fault, fault);
  EXPECT_EQ(found[0].mesh, mesh);
  EXPECT_EQ(found[0].other, other);
  EXPECT_EQ(found[0].pieces, pieces);
}

Mesh joined(const std::vector<Mesh>& meshes) {
  Mesh all;
  for (const Mesh& mesh : meshes) {
    const auto base = static_cast<std::uint32_t>(all.positions.size());
    all.positions.insert(all.positions.end(), mesh.positions.begin(), mesh.positions.end());
    for (const Triangle& t : mesh.triangles) all.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
  }
  return all;
}

const Vec3 kFar(40, -7, 3);

TEST(PieceFaults, ExactCopies) {
  expect_one(find({make_sphere(), make_cube(), make_sphere()}), PieceFault::kCopy, 2, 0);
  const Mesh cube = placed(make_cube(), 0.3f, kFar);
  expect_one(find({cube, cube}), PieceFault::kCopy, 1, 0);
  // Of one mesh, over other triangles.
  Mesh other = cube;
  for (std::size_t i = 0; i < other.triangles.size(); i += 2) {
    Triangle &s = other.triangles[i], &t = other.triangles[i + 1];
    ASSERT_TRUE(s[0] == t[0] && s[2] == t[1]);  // two halves of a face: the other diagonal
    const Triangle a{s[0], s[1], t[2]}, b{s[1], s[2], t[2]};
    s = a;
    t = b;
  }
  expect_one(find({cube, other}), PieceFault::kCopy, 1, 0);
}

TEST(PieceFaults, NearCopiesAreNearerThanSaid) {
  const Mesh ball = placed(make_sphere(), 2, kFar);
  for (const float radius : {1.99f, 2.01f}) {
    expect_one(find({ball, placed(make_sphere(), radius, kFar)}, 0.02f), PieceFault::kNearCopy, 1, 0);
    expect_one(find({ball, placed(make_sphere(), radius, kFar)}, 0.005f), PieceFault::kInside,
               radius < 2 ? 1 : 0, radius < 2 ? 0 : 1);
  }
  EXPECT_TRUE(find({ball, placed(make_sphere(), 2, kFar + Vec3(1, 0, 0))}, 0.02f).empty());
}

TEST(PieceFaults, PiecesInside) {
  const Mesh big = placed(make_cube(), 3, kFar), small = placed(make_sphere(), 0.5f, kFar);
  expect_one(find({big, small}), PieceFault::kInside, 1, 0);
  expect_one(find({small, big}), PieceFault::kInside, 0, 1);
  std::vector<Mesh> parts{big};
  for (int i = 0; i < 5; ++i)
    parts.push_back(placed(make_cube(), 0.1f, kFar + Vec3(static_cast<float>(i) * 0.4f - 0.9f, 0.1f, 0)));
  expect_one(find({joined(parts)}), PieceFault::kInside, 0, 0, 5);
  // In two bodies together, in neither alone.
  expect_one(find({placed(make_cube(), 1, {-0.9f, 0, 0}), placed(make_cube(), 1, {0.9f, 0, 0}),
                   placed(make_sphere(), 0.5f, {0, 0, 0})}),
             PieceFault::kInside, 2, 0);
}

TEST(PieceFaults, ShellsWithoutThickness) {
  expect_one(find({placed(make_cube(), Vec3(1, 2, 1e-7f), {0, 0, 0})}), PieceFault::kFlat, 0, 0);
  expect_one(find({make_rectangle(), flipped(make_rectangle())}), PieceFault::kBackSide, 1, 0);
  expect_one(find({make_sphere(), flipped(make_sphere())}), PieceFault::kBackSide, 1, 0);
}

TEST(PieceFaults, SoundBodiesAreNotSuspected) {
  const Mesh ball = placed(make_sphere(), 1, kFar), cube = placed(make_cube(), 1, kFar);
  const std::vector<std::vector<Mesh>> sound{
      {ball},
      {make_rectangle()},
      {placed(make_cube(), Vec3(1, 1, 1e-3f), kFar)},                                         // a thin plate
      {ball, placed(flipped(make_sphere()), 0.9f, kFar)},                                     // a hollow ball
      {ball, placed(flipped(make_sphere()), 0.9f, kFar), placed(make_sphere(), 0.5f, kFar)},  // and one in it
      {ball, placed(make_sphere(), 0.5f, kFar + Vec3(0.8f, 0, 0))},                           // a bulge
      {cube, placed(make_cube(), 1, kFar + Vec3(2, 0, 0))},                                   // touching
      {cube, placed(make_cube(), 0.2f, kFar + Vec3(0, 0.3f, 1.2f))},  // touching, small on large
      {make_rectangle(), placed(make_rectangle(), 1, {2, 0, 0})},     // a sheet of two
      {ball, Mesh()},
      {Mesh()},
      {}};
  for (std::size_t i = 0; i < sound.size(); ++i) EXPECT_TRUE(find(sound[i], 0.005f).empty()) << i;
}

// A body under an open bowl is not inside of it.
TEST(PieceFaults, OpenPiecesHoldNothing) {
  Mesh bowl = placed(make_sphere(), 3, kFar);
  std::erase_if(bowl.triangles, [&](const Triangle& t) { return bowl.positions[t[0]].z > kFar.z + 0.5f; });
  EXPECT_TRUE(find({bowl, placed(make_sphere(), 0.5f, kFar)}).empty());
}

}  // namespace
}  // namespace nacre
