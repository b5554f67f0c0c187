// Primary rays, what translucent and opaque surfaces send back, mirror reflections and refractions.
#include "render/pixel_loop.h"

#include "nacre/base/random.h"
#include "nacre/optics/fresnel.h"
#include "nacre/transport/light.h"

namespace nacre {
namespace {

// Longest chain of mirror reflections and refractions.
constexpr int kMaxWaves = 12;
// Bounces at which both ways through glass are followed, and the share of a pixel below which a way is not.
constexpr int kSplitWaves = 4;
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

PixelLoop::PixelLoop(const World& world, const Cache& cache, const RenderParams& params)
    : world_(world),
      params_(params),
      camera_(world.scene->cameras[params.camera], params.width, params.height),
      filter_(world.scene->films[params.camera]),
      light_samples_(world.scene->integrator.emitter_samples),
      bounces_(world.scene->integrator.kind == IntegratorKind::kPath ? world.scene->integrator.bounces()
                                                                     : 0) {
  for (std::size_t m = 0; m < world.scene->media.size(); ++m)
    media_.emplace_back(world, m, m < cache.groups.size() ? &cache.groups[m] : nullptr, params);
}

void PixelLoop::render_pixels(std::size_t begin, std::size_t end, PixelBuffer& pixels, Totals& totals) const {
  std::vector<Path> paths = start_paths(begin, end);
  std::vector<Path> next;
  for (int wave = 0; wave < kMaxWaves && !paths.empty(); ++wave) {
    {
      const StageClock clock(wave == 0 ? totals.primary : totals.surface);
      for (Path& path : paths) path.hit = world_.tracer.intersect(path.ray);
      if (wave == 0) record_first_hits(paths, pixels);
      totals.rays += paths.size();
    }
    add_translucency(paths, wave, pixels, totals);
    const StageClock clock(totals.surface);
    next.clear();
    for (Path& path : paths)
      if (path.hit) shade(path, wave, pixels, next);
    paths.swap(next);
  }
}

// A pixel's place in the whole picture.
std::array<int, 2> PixelLoop::place(std::uint32_t pixel) const {
  const auto width = static_cast<std::uint32_t>(params_.crop_width);
  return {params_.crop_x + static_cast<int>(pixel % width), params_.crop_y + static_cast<int>(pixel / width)};
}

// Random numbers follow that place, so that a crop repeats them.
std::uint64_t PixelLoop::pixel_key(std::uint32_t pixel, std::uint64_t purpose) const {
  const auto [x, y] = place(pixel);
  return hash_words(params_.seed, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y), purpose);
}

std::vector<PixelLoop::Path> PixelLoop::start_paths(std::size_t begin, std::size_t end) const {
  std::vector<Path> paths;
  paths.reserve((end - begin) * static_cast<std::size_t>(params_.samples_per_pixel));
  for (auto pixel = static_cast<std::uint32_t>(begin); pixel < end; ++pixel) {
    const std::uint64_t key = pixel_key(pixel, 0), lens_key = hash_words(key, 1);
    const auto [x, y] = place(pixel);
    const Vec2 centre(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
    for (std::uint32_t sample = 0; sample < static_cast<std::uint32_t>(params_.samples_per_pixel); ++sample) {
      const FilterSample offset = filter_.sample(sobol_2d(sample, key));
      const Ray ray = camera_.at(centre + offset.offset, sobol_2d(sample, lens_key));
      paths.push_back({ray, Rgb(offset.weight), pixel, sample, Layer::kSurface, {}});
    }
  }
  return paths;
}

void PixelLoop::record_first_hits(std::vector<Path>& paths, PixelBuffer& pixels) const {
  for (Path& path : paths) {
    if (!path.hit) continue;
    const std::size_t index = path.pixel;
    pixels.coverage[index] += path.throughput.x;  // the weight of the filter
    if (path.sample != 0) continue;
    const SurfacePoint point = surface_point(world_, path.hit);
    pixels.position[index] = point.position;
    pixels.normal[index] = point.shading_normal;
    pixels.depth[index] = path.hit.t;
    pixels.object_id[index] = static_cast<float>(path.hit.mesh + 1);
  }
}

// The points of one medium together, so that those near each other share their work.
void PixelLoop::add_translucency(const std::vector<Path>& paths, int wave, PixelBuffer& pixels,
                                 Totals& totals) const {
  std::vector<const Path*> hits;
  std::vector<ExitPoint> points;
  std::vector<Rgb> radiance;
  for (std::size_t m = 0; m < media_.size(); ++m) {
    const Translucency& medium = media_[m];
    hits.clear();
    points.clear();
    const auto add = [&](Layer layer) {
      for (std::size_t i = 0; i < hits.size(); ++i)
        pixels.add(wave == 0 ? layer : hits[i]->layer, hits[i]->pixel, hits[i]->throughput * radiance[i]);
    };
    {
      const StageClock clock(totals.diffusion);
      for (const Path& path : paths) {
        if (!path.hit || world_.shape(path.hit).medium != static_cast<int>(m)) continue;
        hits.push_back(&path);
        points.push_back(
            {surface_point(world_, path.hit), -path.ray.direction,
             pixel_key(path.pixel, 200 + hash_words(static_cast<std::uint64_t>(wave), path.branch)),
             path.sample});
      }
      radiance.assign(points.size(), Rgb(0, 0, 0));
      std::uint64_t evaluations = 0;
      medium.eval_diffusion(points, radiance, evaluations);
      add(Layer::kDiffusion);
      totals.evaluations += evaluations;
      totals.shading_points += points.size();
    }
    if (!medium.has_single_scattering()) continue;
    const StageClock clock(totals.single);
    LostSamples lost;
    for (std::size_t i = 0; i < points.size(); ++i)
      radiance[i] = medium.estimate_single_scattering(points[i], lost);
    add(Layer::kSingle);
    totals.lost[m] += lost.lost;
    totals.taken[m] += lost.taken;
  }
}

void PixelLoop::shade(const Path& path, int wave, PixelBuffer& pixels, std::vector<Path>& next) const {
  const Shape& shape = world_.shape(path.hit);
  const Bsdf& bsdf = world_.bsdfs[path.hit.mesh];
  const SurfacePoint point = surface_point(world_, path.hit);
  const Vec3 out = -path.ray.direction;
  const bool front = dot(point.geometric_normal, out) > 0;
  if (shape.light != kNone && front) {
    const auto& light =
        std::get<AreaLight>(world_.scene->lights[static_cast<std::size_t>(shape.light)].model);
    pixels.add(path.layer, path.pixel, path.throughput * light.radiance);
  }
  if (front) {
    const std::uint64_t key = pixel_key(path.pixel, 1 + static_cast<std::uint64_t>(wave));
    const auto first_sample = path.sample * static_cast<std::uint32_t>(light_samples_);
    pixels.add(
        path.layer, path.pixel,
        path.throughput * (reflect_direct_light(world_, bsdf, point, out, light_samples_, key, first_sample) +
                           reflect_bounced_light(bsdf, point, out, hash_words(key, 1), path.sample)));
  }
  if (bsdf.specular && (front || bsdf.transmits || shape.medium != kNone))
    continue_specular(path, bsdf, point, wave, shape.medium != kNone, next);
}

// What a diffuse surface reflects of light that other surfaces send to it, by one ray; a direct integrator
// leaves it out.
Rgb PixelLoop::reflect_bounced_light(const Bsdf& bsdf, const SurfacePoint& point, const Vec3& out,
                                     std::uint64_t key, std::uint32_t sample) const {
  const float cos_o = dot(point.shading_normal, out);
  if (bounces_ <= 0 || is_black(bsdf.diffuse) || cos_o <= 0) return {0, 0, 0};
  const Vec3 local = sample_cosine_hemisphere(sobol_2d(sample, key));
  const Vec3 direction = make_frame(point.shading_normal).to_world(local);
  if (local.z <= 0 || dot(direction, point.geometric_normal) <= 0) return {0, 0, 0};
  // The cosine and its density leave pi.
  return eval_diffuse(bsdf, local.z, cos_o) * kPi *
         trace_bounced_light(world_, {point.origin(1), direction}, bounces_, hash_words(key, sample));
}

void PixelLoop::continue_specular(const Path& path, const Bsdf& bsdf, const SurfacePoint& point, int wave,
                                  bool translucent, std::vector<Path>& next) const {
  const Vec3 out = -path.ray.direction;
  const bool front = dot(point.geometric_normal, out) > 0;
  const float side = front ? 1.0f : -1.0f;
  const float eta = front || translucent ? bsdf.eta : 1 / bsdf.eta;
  const Vec3 normal = point.normal_towards(out);
  const float reflectance = fresnel_reflectance(std::min(dot(normal, out), 1.0f), eta);
  Path child = path;
  if (translucent && wave == 0) child.layer = Layer::kSpecular;

  // Glass sends light both ways, first along both of them, deeper down along one that is chosen by its
  // reflectance; everything else only reflects.
  float reflected = reflectance, refracted = bsdf.transmits ? 1 - reflectance : 0.0f;
  if (bsdf.transmits && wave >= kSplitWaves) {
    Rng rng(
        hash_words(pixel_key(path.pixel, 100 + static_cast<std::uint64_t>(wave)), path.sample, path.branch));
    const bool reflects = rng.next_float() < reflectance;
    reflected = reflects ? 1.0f : 0.0f;
    refracted = 1 - reflected;
  }
  Vec3 transmitted;
  if (refracted > 0 && refract(out, normal, eta, transmitted)) {
    Path through = child;
    through.branch = 2 * path.branch + 1;
    through.throughput *= bsdf.specular_transmittance * refracted;
    through.ray = {point.origin(-side), transmitted.normalized()};
    if (magnitude(through.throughput) > kLeastThroughput) next.push_back(through);
  }
  child.branch = 2 * path.branch;
  child.throughput *= bsdf.specular_reflectance * reflected;
  child.ray = {point.origin(side), reflect(out, normal).normalized()};
  if (magnitude(child.throughput) > kLeastThroughput) next.push_back(child);
}

}  // namespace nacre
