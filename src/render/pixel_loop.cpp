// Primary rays, what translucent and opaque surfaces send back, and rays on from there.
#include "render/pixel_loop.h"

#include "nacre/base/random.h"
#include "nacre/optics/fresnel.h"

namespace nacre {
namespace {

// Longest path of a direct integrator, which mirror and glass alone can make long, and of any other: by then
// Russian roulette has ended all but one in a million.
constexpr int kMaxDirectWaves = 12, kMaxWaves = 300;
// Edges at which both ways at smooth boundaries are followed, and edges before Russian roulette.
constexpr int kSplitWaves = 4, kSureDepth = 5;
// Below this number of samples per pixel the negative lobes of filters are left out.
constexpr int kLeastSignedSamples = 16;
// The share of a pixel below which a way is not followed.
constexpr float kLeastThroughput = 1e-4f;

// Filters have negative weights, too.
float magnitude(const Rgb& throughput) { return std::max(max_channel(throughput), max_channel(-throughput)); }

// Adds the time of its life to a sum over threads.
class StageClock {
 public:
  explicit StageClock(std::atomic<double>& sum) : sum_(sum) {}
  ~StageClock() { sum_ += watch_.seconds(); }
  StageClock(const StageClock&) = delete;
  StageClock& operator=(const StageClock&) = delete;

 private:
  std::atomic<double>& sum_;
  Stopwatch watch_;
};

}  // namespace

PixelLoop::PixelLoop(const Boundaries& boundaries, std::span<const Filling> media, const RenderParams& params)
    : boundaries_(boundaries),
      world_(boundaries.worlds[0]),
      params_(params),
      camera_(world_.scene->cameras[params.camera], params.width, params.height),
      filter_(world_.scene->films[params.camera]),
      light_samples_(world_.scene->integrator.emitter_samples),
      media_(media) {
  const auto count = static_cast<std::uint32_t>(boundaries.worlds.size());
  audiences_.push_back({kEvery, {}});
  for (std::uint32_t b = 0; b < count; ++b) audiences_.push_back({b, {}});
  for (std::size_t p = 0; p < boundaries.of_picture.size(); ++p)
    for (const std::uint32_t i : {0u, 1 + boundaries.of_picture[p]}) audiences_[i].pictures.push_back(p);
  const Integrator& integrator = world_.scene->integrator;
  counts_mirrors_ = integrator.kind == IntegratorKind::kPath;
  depth_limit_ = !counts_mirrors_ ? 2 : integrator.max_depth < 0 ? kMaxWaves : integrator.max_depth;
  wave_limit_ = counts_mirrors_ ? std::min(depth_limit_, kMaxWaves) : kMaxDirectWaves;
}

void PixelLoop::render_tile(const Tile& tile, std::span<PixelBuffer> pictures, Totals& totals) const {
  std::vector<Path> paths, next;
  {
    const StageClock clock(totals.surface);
    paths = start_paths(tile, pictures);
  }
  for (int wave = 0; wave < wave_limit_ && !paths.empty(); ++wave) {
    {
      const StageClock clock(wave == 0 ? totals.primary : totals.surface);
      for (Path& path : paths) path.hit = world_.tracer.intersect(path.ray.ray);
    }
    totals.rays += paths.size();
    if (wave == 0) {
      const StageClock clock(totals.surface);
      record_first_hits(paths, pictures);
    }
    for (const Audience& audience : audiences_) add_translucency(paths, audience, wave, pictures, totals);
    const StageClock clock(totals.surface);
    next.clear();
    for (const Path& path : paths) shade(path, wave, pictures, next);
    paths.swap(next);
  }
}

std::array<int, 2> PixelLoop::place(std::uint32_t pixel) const {
  const auto width = static_cast<std::uint32_t>(params_.crop_width);
  return {params_.crop_x + static_cast<int>(pixel % width), params_.crop_y + static_cast<int>(pixel / width)};
}

// Random numbers follow that place, so that a crop repeats them.
std::uint64_t PixelLoop::pixel_key(std::uint32_t pixel, std::uint64_t purpose) const {
  const auto [x, y] = place(pixel);
  return hash_words(params_.seed, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y), purpose);
}

PixelLoop::PixelStart PixelLoop::pixel_start(std::uint32_t pixel) const {
  const std::uint64_t key = pixel_key(pixel, 0);
  const auto [x, y] = place(pixel);
  return {{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f}, key, hash_words(key, 1)};
}

PixelLoop::CameraSample PixelLoop::camera_sample(const PixelStart& start, std::uint32_t sample) const {
  const FilterSample offset = filter_.sample(sobol_2d(sample, start.key));
  return {camera_.at(start.centre + offset.offset, sobol_2d(sample, start.lens_key)), offset.weight};
}

Hit PixelLoop::first_hit(std::uint32_t pixel) const {
  return world_.tracer.intersect(camera_sample(pixel_start(pixel), 0).ray);
}

std::vector<PixelLoop::Path> PixelLoop::start_paths(const Tile& tile, std::span<PixelBuffer> pictures) const {
  std::vector<Path> paths;
  paths.reserve(static_cast<std::size_t>(tile.width * tile.height) *
                static_cast<std::size_t>(params_.samples_per_pixel));
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    for (int x = tile.x; x < tile.x + tile.width; ++x) {
      const auto pixel = static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(params_.crop_width) +
                         static_cast<std::uint32_t>(x);
      const PixelStart start = pixel_start(pixel);
      for (std::uint32_t sample = 0; sample < static_cast<std::uint32_t>(params_.samples_per_pixel);
           ++sample) {
        const CameraSample seen = camera_sample(start, sample);
        Path path;
        path.ray.ray = seen.ray;
        // Of a few samples the weights might hardly add up to anything.
        const float weight = params_.samples_per_pixel < kLeastSignedSamples ? 1.0f : seen.weight;
        path.throughput = Rgb(weight);
        for (PixelBuffer& pixels : pictures) pixels.weight[pixel] += weight;
        path.pixel = pixel;
        path.sample = sample;
        paths.push_back(path);
      }
    }
  }
  return paths;
}

void PixelLoop::record_first_hits(std::vector<Path>& paths, std::span<PixelBuffer> pictures) const {
  for (Path& path : paths) {
    if (!path.hit) continue;
    const std::size_t index = path.pixel;
    // The weight of the filter.
    for (PixelBuffer& pixels : pictures) pixels.coverage[index] += path.throughput.x;
    if (path.sample != 0) continue;
    const SurfacePoint point = surface_point(world_, path.hit);
    const int medium = world_.shape(path.hit).medium;
    for (PixelBuffer& pixels : pictures) {
      pixels.position[index] = point.position;
      pixels.normal[index] = point.shading_normal;
      pixels.depth[index] = path.hit.t;
      pixels.object_id[index] = static_cast<float>(path.hit.mesh + 1);
      if (medium == kNone || (pixels.irradiance.empty() && pixels.irradiance_error.empty())) continue;
      const BakedLight baked = media_[static_cast<std::size_t>(medium)].families[0].nearest_light(point);
      if (!pixels.irradiance.empty()) pixels.irradiance[index] = baked.irradiance;
      if (!pixels.irradiance_error.empty()) pixels.irradiance_error[index] = baked.error;
    }
  }
}

// The points of one medium together, so that those near each other share their work.
void PixelLoop::add_translucency(const std::vector<Path>& paths, const Audience& audience, int wave,
                                 std::span<PixelBuffer> pictures, Totals& totals) const {
  std::vector<const Path*> owners;
  std::vector<Hit> hits;
  std::vector<ExitPoint> points;
  for (std::size_t m = 0; m < world_.scene->media.size(); ++m) {
    owners.clear();
    hits.clear();
    points.clear();
    // Those that the audience sees through.
    std::vector<std::uint32_t> boundaries{audience.boundary};
    if (audience.boundary == kEvery) boundaries[0] = 0;
    if (audience.boundary == kEvery && m == boundaries_.medium)
      for (std::uint32_t b = 1; b < boundaries_.worlds.size(); ++b) boundaries.push_back(b);
    std::vector<std::vector<Rgb>> transmittances(boundaries_.worlds.size());
    {
      const StageClock clock(totals.surface);
      for (const Path& path : paths) {
        if (!path.hit || path.depth >= depth_limit_ || path.boundary != audience.boundary ||
            world_.shape(path.hit).medium != static_cast<int>(m))
          continue;
        owners.push_back(&path);
        hits.push_back(path.hit);
        points.push_back(
            {path.hit, surface_point(world_, path.hit), -path.ray.ray.direction,
             pixel_key(path.pixel, 200 + hash_words(static_cast<std::uint64_t>(wave), path.branch)),
             path.sample});
        for (const std::uint32_t b : boundaries)
          transmittances[b].push_back(
              exit_transmittance(boundaries_.worlds[b], path.hit, points.back().surface, points.back().out));
      }
      totals.shading_points += points.size();
    }
    if (points.empty()) continue;
    const Filling& filling = media_[m];
    // By family, all materials of a point side by side.
    std::vector<std::vector<Rgb>> exitances(filling.families.size()), scattered(filling.families.size());
    const auto is_seen = [&](std::size_t f) {
      return std::ranges::any_of(audience.pictures,
                                 [&](std::size_t p) { return filling.of_picture[p].family == f; });
    };
    {
      const StageClock clock(totals.diffusion);
      std::uint64_t evaluations = 0;
      for (std::size_t f = 0; f < exitances.size(); ++f) {
        if (!is_seen(f)) continue;
        const Translucency& family = filling.families[f];
        exitances[f].resize(points.size() * family.material_count());
        family.eval_diffusion(hits, points, exitances[f], evaluations);
      }
      totals.evaluations += evaluations;
    }
    for (std::size_t f = 0; f < scattered.size(); ++f) {
      const Translucency& family = filling.families[f];
      if (!family.has_single_scattering() || !is_seen(f)) continue;
      const StageClock clock(totals.single);
      const std::size_t count = family.material_count();
      scattered[f].resize(points.size() * count);
      LostSamples lost;
      for (std::size_t i = 0; i < points.size(); ++i)
        for (const std::uint32_t b : boundaries)
          family.estimate_single_scattering(m == boundaries_.medium ? b : 0, points[i], lost,
                                            std::span(scattered[f]).subspan(i * count, count));
      totals.lost[m] += lost.lost;
      totals.taken[m] += lost.taken;
    }
    const StageClock clock(totals.surface);
    for (const std::size_t p : audience.pictures) {
      const auto [f, material] = filling.of_picture[p];
      const Translucency& family = filling.families[f];
      const auto add_to = [&](Layer layer, std::size_t i, const Rgb& radiance) {
        pictures[p].add(wave == 0 ? layer : owners[i]->layer, owners[i]->pixel,
                        owners[i]->throughput * radiance);
      };
      const std::vector<Rgb>& leaving =
          transmittances[boundaries.size() > 1 ? boundaries_.of_picture[p] : boundaries[0]];
      const std::size_t count = family.material_count();
      for (std::size_t i = 0; i < points.size(); ++i)
        add_to(Layer::kDiffusion, i,
               exitances[f][i * count + material] * (leaving[i] * family.exit_factor(material)));
      for (std::size_t i = 0; i < points.size() && !scattered[f].empty(); ++i)
        add_to(Layer::kSingle, i, scattered[f][i * count + material]);
    }
  }
}

void PixelLoop::add(const Path& path, Layer layer, const Rgb& value, std::span<PixelBuffer> pictures) const {
  if (value == Rgb(0, 0, 0)) return;  // there are as many as pictures to add it to
  for (const std::size_t p : audience(path.boundary).pictures) pictures[p].add(layer, path.pixel, value);
}

// Adds what a path meets on surfaces, and follows it on: by each boundary that the audience sees.
void PixelLoop::shade(const Path& path, int wave, std::span<PixelBuffer> pictures,
                      std::vector<Path>& next) const {
  add(path, path.layer, path.throughput * emitted_radiance(world_of(path.boundary), path.ray, path.hit),
      pictures);
  if (!path.hit || path.depth >= depth_limit_) return;
  const bool parts = path.boundary == kEvery && boundaries_.worlds.size() > 1 &&
                     world_.shape(path.hit).medium == static_cast<int>(boundaries_.medium);
  if (!parts) return scatter(path, wave, pictures, next);
  Path part = path;
  for (part.boundary = 0; part.boundary < boundaries_.worlds.size(); ++part.boundary)
    scatter(part, wave, pictures, next);
}

void PixelLoop::scatter(const Path& path, int wave, std::span<PixelBuffer> pictures,
                        std::vector<Path>& next) const {
  const World& world = world_of(path.boundary);
  ScatterPoint at = scatter_point(world, path.hit, -path.ray.ray.direction);
  Bsdf& bsdf = at.surface.bsdf;
  const bool translucent = world.shape(path.hit).medium != kNone;
  const Layer layer = wave == 0 && translucent ? Layer::kSpecular : path.layer;
  const std::uint64_t key =
      pixel_key(path.pixel, hash_words(1, static_cast<std::uint64_t>(wave), path.branch));
  if (bsdf.specular && !bsdf.rough() && wave < kSplitWaves && path.scattered == 0) {
    // Light goes both ways, and into the base: first along all of them, deeper down along one.
    const SmoothRays rays = smooth_rays(at, path.ray);
    Path branch = path;
    branch.branch = 2 * path.branch;
    follow(branch, rays.reflected, layer, key, next);
    ++branch.branch;
    follow(branch, rays.transmitted, layer, key, next);
    if (is_black(bsdf.diffuse)) return;
    bsdf.specular = false;
  }
  const int samples = path.scattered == 0 ? light_samples_ : 1;
  add(path, layer,
      path.throughput * reflect_direct_light(world, at, samples, key,
                                             path.sample * static_cast<std::uint32_t>(samples),
                                             Continuation::kGoesOn),
      pictures);
  follow(path, next_ray(world, at, path.ray, samples, key, path.sample), layer, key, next);
}

void PixelLoop::follow(const Path& from, const NextRay& ray, Layer layer, std::uint64_t key,
                       std::vector<Path>& next) const {
  Path path = from;
  path.throughput *= ray.weight;
  if (!(magnitude(path.throughput) > (ray.delta ? kLeastThroughput : 0.0f))) return;
  path.ray = ray.ray;
  path.layer = layer;
  path.depth += !ray.delta || counts_mirrors_;
  path.scattered += !ray.delta;
  if (path.depth > kSureDepth) {  // Russian roulette
    const float survive = std::min(0.95f, magnitude(path.throughput));
    if (to_unit_float(static_cast<std::uint32_t>(hash_words(key, 3, path.sample, path.branch))) >= survive)
      return;
    path.throughput /= survive;
  }
  next.push_back(path);
}

}  // namespace nacre
