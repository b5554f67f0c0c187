// label: image
// The hierarchical sum against the exact one on the picture that people will make first.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "nacre/bake/bake.h"
#include "nacre/geometry/mesh_file.h"
#include "nacre/geometry/primitives.h"
#include "nacre/render/render.h"
#include "nacre/scene/scene_file.h"

namespace nacre {
namespace {

// The bunny where tools/fetch_meshes.sh has put it; where there is no npm, a sphere with bumps and ears of
// its own.
std::string test_mesh(const std::string& folder) {
  const std::string bunny = NACRE_SOURCE_DIR "/scenes/meshes/bunny.obj";
  if (std::filesystem::exists(bunny)) return bunny;
  Mesh mesh = make_sphere();
  for (Vec3& p : mesh.positions) {
    const float bumps = 1 + 0.1f * std::sin(7 * p.x) * std::sin(6 * p.y) * std::sin(5 * p.z);
    const float ears =
        1 + 1.2f * std::exp(-40 * square(std::abs(p.x) - 0.4f) - 40 * square(p.z)) * std::max(0.0f, p.y);
    p *= bumps * ears;
  }
  mesh.normals.clear();
  const std::string path = folder + "/bumps.obj";
  save_mesh(mesh, path);
  return path;
}

TEST(Bunny, DefaultToleranceIsWithinOnePercentOfExact) {
  std::string folder = (std::filesystem::path(testing::TempDir()) / "nacre-bunny-XXXXXX").string();
  ASSERT_NE(::mkdtemp(folder.data()), nullptr);
  const Scene scene = make_showcase_scene(test_mesh(folder), make_medium(*find_preset("Marble")), 50);
  std::filesystem::remove_all(folder);
  const World world = make_world(scene, true);
  Progress progress;
  Report report;
  Warnings warnings;
  BakeParams bake_params;
  bake_params.irradiance_samples = 8;
  const Cache cache = bake(world, plan_bake(scene, bake_params), bake_params, progress, report);
  EXPECT_GT(cache.groups[0].size(), 50000u);

  RenderParams params = default_render_params(scene, 0);
  params.width = params.height = params.crop_width = params.crop_height = 120;
  params.samples_per_pixel = 1;
  const Image fast = render(world, cache, params, progress, report, warnings);
  const std::uint64_t evaluations = report.counts["kernel_evaluations"];
  params.method = Method::kExact;
  const Image exact = render(world, cache, params, progress, report, warnings);
  const ImageDifference difference = compare_images(fast, exact, "diffusion");
  EXPECT_LE(difference.relative_rmse, 0.01);
  EXPECT_GT(difference.relative_rmse, 0);  // else the fast way was not taken
  EXPECT_LT(10 * evaluations, report.counts["kernel_evaluations"]);
}

}  // namespace
}  // namespace nacre
