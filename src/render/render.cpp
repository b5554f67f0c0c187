// A picture: pixels in parallel, times and counts.
#include "nacre/render/render.h"

#include <cmath>
#include <filesystem>
#include <limits>

#include "nacre/base/parallel.h"
#include "nacre/base/random.h"
#include "render/pixel_loop.h"

namespace nacre {
namespace {

constexpr int kPathsPerTile = 1 << 14;
constexpr std::uint32_t kUnused = 0xffffffffu;
constexpr std::size_t kNoMedium = std::numeric_limits<std::size_t>::max();

// Pixels that are looked at, a hundred for each that is wanted, before hardly any shows a translucent
// surface.
constexpr std::uint64_t kLeastTries = 1000;

// Rays that are lost in closed objects, too: they met an edge or a vertex to the last bit.
constexpr double kLostShare = 1e-6;

Warnings describe_lost_samples(const Scene& scene, const Totals& totals) {
  Warnings warnings;
  for (std::size_t m = 0; m < scene.media.size(); ++m)
    if (static_cast<double>(totals.lost[m]) > kLostShare * static_cast<double>(totals.taken[m]))
      warnings.push_back(fmt::format(
          "{}: {} of {} single-scattering rays found no way out of {}, as through a hole; "
          "its bounding box ended them: close its surface, keep the camera out of it, or take the shading "
          "there as a guess",
          scene.media[m].place, totals.lost[m].load(), totals.taken[m].load(), medium_label(scene, m)));
  return warnings;
}

// Squares, in which neighbours find what others have brought near: triangles, nodes, texels.
std::vector<Tile> make_tiles(const RenderParams& params) {
  int edge = 1;
  while (4 * edge * edge * params.samples_per_pixel <= kPathsPerTile) edge *= 2;
  std::vector<Tile> tiles;
  for (int y = 0; y < params.crop_height; y += edge)
    for (int x = 0; x < params.crop_width; x += edge)
      tiles.push_back({x, y, std::min(edge, params.crop_width - x), std::min(edge, params.crop_height - y)});
  return tiles;
}

// The families of which anything is wanted, and where in them pictures are.
std::pair<std::vector<MaterialFamily>, std::vector<MaterialFamilies::Place>> choose_families(
    const MaterialSweep& sweep) {
  std::vector<MaterialFamily> families;
  std::vector<MaterialFamilies::Place> of_picture;
  std::vector<std::uint32_t> chosen(sweep.plan.families.size(), kUnused);  // where they are now
  for (const std::uint32_t index : sweep.wanted) {
    const auto [f, member] = sweep.plan.places[index];
    if (chosen[f] == kUnused) {
      chosen[f] = static_cast<std::uint32_t>(families.size());
      families.push_back(sweep.plan.families[f]);
    }
    std::vector<std::uint32_t>& wanted = families[chosen[f]].wanted;
    of_picture.push_back({chosen[f], static_cast<std::uint32_t>(wanted.size())});
    wanted.push_back(member);
  }
  return {families, of_picture};
}

// A world for each index of refraction that is wanted.
Boundaries make_boundaries(const World& world, const MaterialSweep& sweep) {
  if (sweep.medium >= world.media.size())
    return {kNoMedium, {world}, std::vector<std::uint32_t>(sweep.wanted.size(), 0)};
  Boundaries boundaries{sweep.medium, {}, {}};
  for (const std::uint32_t index : sweep.wanted) {
    const auto [f, member] = sweep.plan.places[index];
    const Medium& material = sweep.plan.families[f].media[member];
    std::vector<World>& worlds = boundaries.worlds;
    const auto found = std::ranges::find(worlds, material.eta(),
                                         [&](const World& w) { return w.media[sweep.medium].eta(); });
    boundaries.of_picture.push_back(static_cast<std::uint32_t>(found - worlds.begin()));
    if (found == worlds.end()) {
      Medium medium = world.media[sweep.medium];
      medium.int_ior = material.int_ior;
      medium.ext_ior = material.ext_ior;
      worlds.push_back(fill_medium(world, sweep.medium, medium));
    }
  }
  return boundaries;
}

}  // namespace

const World& Renderer::world() const { return boundaries_->worlds[0]; }

RenderParams default_render_params(const Scene& scene, std::size_t camera) {
  RenderParams params;
  params.camera = camera;
  params.width = params.crop_width = scene.films[camera].width;
  params.height = params.crop_height = scene.films[camera].height;
  params.samples_per_pixel = scene.samples_per_pixel;
  return params;
}

Renderer::Renderer(const World& world, const Cache& cache, const RenderParams& params, Report& report)
    : boundaries_(std::make_unique<const Boundaries>(Boundaries{kNoMedium, {world}, {0}})) {
  const StageTimer timer(report, "diffusion");  // tables of profiles, nodes on surfaces
  for (std::size_t m = 0; m < world.media.size(); ++m) {
    Filling& filling = media_.emplace_back();
    filling.families.emplace_back(boundaries_->worlds, m, MaterialFamily{{world.media[m]}},
                                  m < cache.groups.size() ? &cache.groups[m] : nullptr, params);
    filling.of_picture = {{0, 0}};
  }
}

Renderer::Renderer(const World& world, const ScaledCache& cache, const RenderParams& params, Report& report,
                   const MaterialSweep& sweep)
    : boundaries_(std::make_unique<const Boundaries>(make_boundaries(world, sweep))) {
  std::vector<double> etas;
  for (const Medium& medium : world.media) etas.push_back(double{medium.eta()});
  const auto [families, of_picture] = choose_families(sweep);
  std::vector<float> least;           // eta, of each cache
  std::vector<std::size_t> cache_of;  // a family
  for (const MaterialFamily& family : families) {
    const StageTimer timer(report, "read_cache");
    const float eta = eta_range(family).least;
    const auto found = std::ranges::find(least, eta);
    cache_of.push_back(static_cast<std::size_t>(found - least.begin()));
    if (found != least.end()) continue;
    least.push_back(eta);
    if (sweep.medium < etas.size()) etas[sweep.medium] = double{eta};
    caches_.push_back(cache.relit(etas));
  }
  const StageTimer timer(report, "diffusion");
  for (std::size_t m = 0; m < world.media.size(); ++m) {
    Filling& filling = media_.emplace_back();
    if (m != sweep.medium) {
      filling.families.emplace_back(std::span(boundaries_->worlds).first(1), m,
                                    MaterialFamily{{world.media[m]}}, &caches_[0].groups[m], params);
      filling.of_picture.resize(sweep.wanted.size(), {0, 0});
      continue;
    }
    for (std::size_t f = 0; f < families.size(); ++f)
      filling.families.emplace_back(boundaries_->worlds, m, families[f], &caches_[cache_of[f]].groups[m],
                                    params, [&](double eta) { return cache.irradiance(m, eta); });
    filling.of_picture = of_picture;
  }
}
Renderer::~Renderer() = default;

void Renderer::fill(Report& report) const {
  const StageTimer timer(report, "diffusion");
  std::uint64_t evaluations = 0;
  for (const Filling& medium : media_)
    for (const Translucency& family : medium.families) family.fill(evaluations);
  report.counts["kernel_evaluations"] += evaluations;
}

void Renderer::load_exitance(const std::string& path) const {
  if (!std::filesystem::exists(path)) return;
  const std::vector<KeptExitance> file = nacre::load_exitance(path);
  std::vector<KeptExitance> own;
  for (const Filling& medium : media_) own.push_back(medium.families[0].keep());
  check_exitance_keys(path, file, own);
  for (std::size_t m = 0; m < media_.size(); ++m) media_[m].families[0].restore(file[m]);
}

bool Renderer::save_exitance(const std::string& path) const {
  std::vector<KeptExitance> own;
  std::vector<std::vector<std::uint32_t>> block_of;
  bool any = false;
  for (const Filling& medium : media_) {
    own.push_back(medium.families[0].keep());
    block_of.push_back(medium.families[0].block_of_node());
    any = any || !own.back().key.empty();
  }
  if (any) extend_exitance(path, std::move(own), block_of);
  return any;
}

std::size_t Renderer::filled_node_count() const {
  std::size_t count = 0;
  for (const Filling& medium : media_) count += medium.families[0].filled_node_count();
  return count;
}

Image render(const World& world, const Cache& cache, const RenderParams& params, Progress& progress,
             Report& report, Warnings& warnings) {
  return Renderer(world, cache, params, report).render(params, progress, report, warnings);
}

Image Renderer::render(const RenderParams& params, Progress& progress, Report& report,
                       Warnings& warnings) const {
  return std::move(render_sweep(params, progress, report, warnings)[0]);
}

std::vector<Image> Renderer::render_sweep(const RenderParams& params, Progress& progress, Report& report,
                                          Warnings& warnings) const {
  std::vector<PixelBuffer> pictures(boundaries_->of_picture.size(),
                                    PixelBuffer(params.crop_width, params.crop_height, params.aovs));
  Totals totals(world().scene->media.size());
  const Stopwatch watch;
  const PixelLoop loop(*boundaries_, media_, params);
  const std::size_t pixel_count =
      static_cast<std::size_t>(params.crop_width) * static_cast<std::size_t>(params.crop_height);
  const std::vector<Tile> tiles = make_tiles(params);
  progress.begin("rendering", "pixels", pixel_count);
  parallel_for(tiles.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      loop.render_tile(tiles[i], pictures, totals);
      progress.advance(static_cast<std::size_t>(tiles[i].width) * static_cast<std::size_t>(tiles[i].height));
    }
  });
  progress.end();

  // Stages are sums over threads; what the threads spent between them (waiting for the last row) is shared
  // out alike.
  const double loop_seconds = watch.seconds();
  const double busy = totals.primary + totals.diffusion + totals.single + totals.surface;
  const double share = busy > 0 ? loop_seconds / busy : 0;
  report.seconds["primary_rays"] += totals.primary * share;
  report.seconds["diffusion"] += totals.diffusion * share;
  report.seconds["single_scattering"] += totals.single * share;
  report.seconds["surface"] += totals.surface * share;
  report.counts["pixels"] += pixel_count;
  report.counts["rays"] += totals.rays;
  report.counts["shading_points"] += totals.shading_points;
  report.counts["kernel_evaluations"] += totals.evaluations;
  for (std::size_t m = 0; m < world().scene->media.size(); ++m) {
    std::vector<std::string> paths;
    for (const Translucency& family : media_[m].families) paths.push_back(family.describe_path());
    report.notes["diffusion of " + medium_label(*world().scene, m)] =
        fmt::format("{}", fmt::join(paths, "; "));
  }
  for (std::string& warning : describe_lost_samples(*world().scene, totals))
    warnings.push_back(std::move(warning));
  std::vector<Image> images;
  images.reserve(pictures.size());
  for (const PixelBuffer& pixels : pictures) images.push_back(pixels.make_image(params));
  return images;
}

Verification Renderer::verify(const RenderParams& params, int count) const {
  const PixelLoop loop(*boundaries_, media_, params);
  const std::uint64_t pixels =
      static_cast<std::uint64_t>(params.crop_width) * static_cast<std::uint64_t>(params.crop_height);
  const auto wanted = static_cast<std::size_t>(count);
  const std::uint64_t most = 100 * wanted + 100 * kLeastTries;
  std::vector<Hit> hits;
  for (std::uint64_t i = 0; hits.size() < wanted && i < most; ++i) {
    const std::uint64_t pixel = hash_words(params.seed, 0x766572, i) % pixels;
    const Hit hit = loop.first_hit(static_cast<std::uint32_t>(pixel));
    if (!hit || world().shape(hit).medium == kNone) continue;
    if (!world().scene->media[static_cast<std::size_t>(world().shape(hit).medium)].lambert)
      hits.push_back(hit);
  }
  if (hits.empty()) return {};
  std::vector<Rgb> values(hits.size()), exact(hits.size());
  parallel_for(hits.size(), 8, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      media_[static_cast<std::size_t>(world().shape(hits[i]).medium)].families[0].eval_exitance(
          std::span(hits).subspan(i, 1), std::span(values).subspan(i, 1), std::span(exact).subspan(i, 1));
  });
  const auto as_image = [](const std::vector<Rgb>& radiances) {
    Image image;
    image.full_width = image.width = static_cast<int>(radiances.size());
    image.full_height = image.height = 1;
    for (int k = 0; k < 3; ++k) {
      Channel channel{std::string(1, "RGB"[k]), {}};
      for (const Rgb& radiance : radiances) channel.values.push_back(radiance[k]);
      image.channels.push_back(std::move(channel));
    }
    return image;
  };
  const ImageDifference difference = compare_images(as_image(values), as_image(exact), "");
  double anywhere = 0;
  for (std::size_t i = 0; i < hits.size(); ++i)
    for (int k = 0; k < 3; ++k)
      if (const double sum = double{exact[i][k]}; sum >= double{std::numeric_limits<float>::min()})
        anywhere = std::max(anywhere, std::abs(double{values[i][k]} / sum - 1));
  return {hits.size(), difference.relative_rmse, difference.largest_relative, anywhere};
}

}  // namespace nacre
