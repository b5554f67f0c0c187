// The pixel loop: runs of pixels in parallel, each in waves of rays so that every stage is timed as a whole.
#include "nacre/render/render.h"

#include <atomic>

#include "nacre/base/parallel.h"
#include "nacre/base/random.h"
#include "nacre/cache/exitance.h"
#include "nacre/optics/fresnel.h"
#include "nacre/render/camera.h"
#include "nacre/transport/light.h"
#include "render/pixels.h"

namespace nacre {
namespace {

// Longest chain of mirror reflections and refractions.
constexpr int kMaxWaves = 12;
// Bounces at which both ways through glass are followed, and the share of a pixel below which a way is not.
constexpr int kSplitWaves = 4;
constexpr float kLeastThroughput = 1e-4f;
constexpr std::size_t kPathsPerTask = 1 << 15;

// A ray on its way, what it is worth and which layer it adds to.
struct Path {
  Ray ray;
  Rgb throughput;
  std::uint32_t pixel;   // index into the rendered rectangle, row by row
  std::uint32_t sample;  // of the pixel
  Layer layer;
  Hit hit;
  std::uint32_t branch = 1;  // which of the ways through glass this one is
};

// Seconds of all threads per stage, and counts.
struct Totals {
  std::atomic<double> primary{0}, diffusion{0}, surface{0};
  std::atomic<std::uint64_t> rays{0}, shading_points{0}, evaluations{0};
};

// One medium as seen from outside.
struct Material {
  Exitance exitance;
  float eta;
  float exit_factor;  // 1/pi, or 1/(pi T) to lose nothing at the exit
};

class PixelLoop {
 public:
  PixelLoop(const World& world, const Cache& cache, const RenderParams& params)
      : world_(world),
        params_(params),
        camera_(world.scene->cameras[params.camera], params.width, params.height),
        filter_(world.scene->films[params.camera]),
        light_samples_(world.scene->integrator.emitter_samples),
        bounces_(world.scene->integrator.kind == IntegratorKind::kPath ? world.scene->integrator.bounces()
                                                                       : 0) {
    const double tolerance = params.method == Method::kExact ? 0 : params.tolerance;
    for (std::size_t m = 0; m < world.scene->media.size(); ++m) {
      const Medium& medium = world.scene->media[m];
      const double transmittance =
          medium.convention == Convention::kConserving ? mean_transmittance(medium.eta()) : 1.0;
      materials_.push_back({Exitance(cache.groups[m], medium, tolerance), medium.eta(),
                            static_cast<float>(1 / (kPiD * transmittance))});
    }
  }

  void render_pixels(std::size_t begin, std::size_t end, PixelBuffer& pixels, Totals& totals) const {
    std::vector<Path> paths = start_paths(begin, end);
    std::vector<Path> next;
    for (int wave = 0; wave < kMaxWaves && !paths.empty(); ++wave) {
      {
        const StageClock clock(wave == 0 ? totals.primary : totals.surface);
        for (Path& path : paths) path.hit = world_.tracer.intersect(path.ray);
        if (wave == 0) record_first_hits(paths, pixels);
        totals.rays += paths.size();
      }
      {
        const StageClock clock(totals.diffusion);
        add_diffusion(paths, wave, pixels, totals);
      }
      const StageClock clock(totals.surface);
      next.clear();
      for (Path& path : paths)
        if (path.hit) shade(path, wave, pixels, next);
      paths.swap(next);
    }
  }

 private:
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

  // A pixel's place in the whole picture.
  std::array<int, 2> place(std::uint32_t pixel) const {
    const auto width = static_cast<std::uint32_t>(params_.crop_width);
    return {params_.crop_x + static_cast<int>(pixel % width),
            params_.crop_y + static_cast<int>(pixel / width)};
  }

  // Random numbers follow that place, so that a crop repeats them.
  std::uint64_t pixel_key(std::uint32_t pixel, std::uint64_t purpose) const {
    const auto [x, y] = place(pixel);
    return hash_words(params_.seed, static_cast<std::uint64_t>(x), static_cast<std::uint64_t>(y), purpose);
  }

  std::vector<Path> start_paths(std::size_t begin, std::size_t end) const {
    std::vector<Path> paths;
    paths.reserve((end - begin) * static_cast<std::size_t>(params_.samples_per_pixel));
    for (auto pixel = static_cast<std::uint32_t>(begin); pixel < end; ++pixel) {
      const std::uint64_t key = pixel_key(pixel, 0);
      const auto [x, y] = place(pixel);
      const Vec2 centre(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      for (std::uint32_t sample = 0; sample < static_cast<std::uint32_t>(params_.samples_per_pixel);
           ++sample) {
        const Vec2 at = centre + filter_.sample(sobol_2d(sample, key));
        paths.push_back({camera_.at(at), {1, 1, 1}, pixel, sample, Layer::kSurface, {}});
      }
    }
    return paths;
  }

  void record_first_hits(std::vector<Path>& paths, PixelBuffer& pixels) const {
    for (Path& path : paths) {
      if (!path.hit) continue;
      const std::size_t index = path.pixel;
      pixels.coverage[index] += 1;
      if (path.sample != 0) continue;
      const SurfacePoint point = surface_point(world_, path.hit);
      pixels.position[index] = point.position;
      pixels.normal[index] = point.shading_normal;
      pixels.depth[index] = path.hit.t;
      pixels.object_id[index] = static_cast<float>(path.hit.mesh + 1);
    }
  }

  // The points of one medium together, so that those near each other share their work.
  void add_diffusion(const std::vector<Path>& paths, int wave, PixelBuffer& pixels, Totals& totals) const {
    std::uint64_t evaluations = 0;
    for (std::size_t m = 0; m < materials_.size(); ++m) {
      const Material& material = materials_[m];
      std::vector<const Path*> hits;
      std::vector<Vec3> points;
      for (const Path& path : paths) {
        if (!path.hit || world_.shape(path.hit).medium != static_cast<int>(m)) continue;
        hits.push_back(&path);
        points.push_back(hit_position(world_.shape(path.hit).mesh, path.hit));
      }
      std::vector<Rgb> exitance(points.size());
      if (params_.method == Method::kExact)
        material.exitance.eval_exact(points, exitance, evaluations);
      else
        material.exitance.eval(points, exitance, evaluations);
      for (std::size_t i = 0; i < hits.size(); ++i) {
        const Path& path = *hits[i];
        const float cos_o = exit_cosine(surface_point(world_, path.hit), path.ray.direction);
        const float through = (1 - fresnel_reflectance(cos_o, material.eta)) * material.exit_factor;
        pixels.add(wave == 0 ? Layer::kDiffusion : path.layer, path.pixel,
                   path.throughput * exitance[i] * through);
      }
      totals.shading_points += hits.size();
    }
    totals.evaluations += evaluations;
  }

  // Cosine between the way out and the interpolated normal on the visible side. Where interpolation turns the
  // normal away from the eye the surface is seen at grazing angles.
  static float exit_cosine(const SurfacePoint& point, const Vec3& direction) {
    const float side = dot(point.geometric_normal, direction) > 0 ? -1.0f : 1.0f;
    return std::clamp(-side * dot(point.shading_normal, direction), 1e-3f, 1.0f);
  }

  void shade(const Path& path, int wave, PixelBuffer& pixels, std::vector<Path>& next) const {
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
      pixels.add(path.layer, path.pixel,
                 path.throughput *
                     (reflect_direct_light(world_, bsdf, point, out, light_samples_, key, first_sample) +
                      reflect_bounced_light(bsdf, point, out, hash_words(key, 1), path.sample)));
    }
    if (bsdf.specular && (front || bsdf.transmits || shape.medium != kNone))
      continue_specular(path, bsdf, point, wave, shape.medium != kNone, next);
  }

  // What a diffuse surface reflects of light that other surfaces send to it, by one ray; a direct integrator
  // leaves it out.
  Rgb reflect_bounced_light(const Bsdf& bsdf, const SurfacePoint& point, const Vec3& out, std::uint64_t key,
                            std::uint32_t sample) const {
    const float cos_o = dot(point.shading_normal, out);
    if (bounces_ <= 0 || is_black(bsdf.diffuse) || cos_o <= 0) return {0, 0, 0};
    const Vec3 local = sample_cosine_hemisphere(sobol_2d(sample, key));
    const Vec3 direction = make_frame(point.shading_normal).to_world(local);
    if (local.z <= 0 || dot(direction, point.geometric_normal) <= 0) return {0, 0, 0};
    // The cosine and its density leave pi.
    return eval_diffuse(bsdf, local.z, cos_o) * kPi *
           trace_bounced_light(world_, {point.origin(1), direction}, bounces_, hash_words(key, sample));
  }

  void continue_specular(const Path& path, const Bsdf& bsdf, const SurfacePoint& point, int wave,
                         bool translucent, std::vector<Path>& next) const {
    const Vec3 out = -path.ray.direction;
    const bool front = dot(point.geometric_normal, out) > 0;
    const float side = front ? 1.0f : -1.0f;
    const float eta = front || translucent ? bsdf.eta : 1 / bsdf.eta;
    const float cos_o = exit_cosine(point, path.ray.direction);
    const float reflectance = fresnel_reflectance(cos_o, eta);
    Path child = path;
    if (translucent && wave == 0) child.layer = Layer::kSpecular;

    // Glass sends light both ways, first along both of them, deeper down along one that is chosen by its
    // reflectance; everything else only reflects.
    float reflected = reflectance, refracted = bsdf.transmits ? 1 - reflectance : 0.0f;
    if (bsdf.transmits && wave >= kSplitWaves) {
      Rng rng(hash_words(pixel_key(path.pixel, 100 + static_cast<std::uint64_t>(wave)), path.sample,
                         path.branch));
      const bool reflects = rng.next_float() < reflectance;
      reflected = reflects ? 1.0f : 0.0f;
      refracted = 1 - reflected;
    }
    Vec3 transmitted;
    if (refracted > 0 && refract(out, point.shading_normal * side, eta, transmitted)) {
      Path through = child;
      through.branch = 2 * path.branch + 1;
      through.throughput *= bsdf.specular_transmittance * refracted;
      through.ray = {point.origin(-side), transmitted.normalized()};
      if (max_channel(through.throughput) > kLeastThroughput) next.push_back(through);
    }
    child.branch = 2 * path.branch;
    child.throughput *= bsdf.specular_reflectance * reflected;
    Vec3 direction = reflect(out, point.shading_normal * side).normalized();
    // An interpolated normal can mirror the ray into the surface; the plane of the triangle is the limit.
    const float below = dot(direction, point.geometric_normal) * side;
    if (below <= 0) direction = (direction - point.geometric_normal * (side * (below - 1e-3f))).normalized();
    child.ray = {point.origin(side), direction};
    if (max_channel(child.throughput) > kLeastThroughput) next.push_back(child);
  }

  const World& world_;
  const RenderParams& params_;
  CameraRays camera_;
  FilterSampler filter_;
  int light_samples_;
  int bounces_;
  std::vector<Material> materials_;
};

}  // namespace

RenderParams default_render_params(const Scene& scene, std::size_t camera) {
  RenderParams params;
  params.camera = camera;
  params.width = params.crop_width = scene.films[camera].width;
  params.height = params.crop_height = scene.films[camera].height;
  params.samples_per_pixel = scene.samples_per_pixel;
  return params;
}

Image render(const World& world, const Cache& cache, const RenderParams& params, Progress& progress,
             Report& report) {
  PixelBuffer pixels(params.crop_width, params.crop_height);
  Totals totals;
  Stopwatch watch;
  Stopwatch setup;
  const PixelLoop loop(world, cache, params);
  report.seconds["diffusion"] += setup.seconds();  // tabulated profiles
  const std::size_t pixel_count =
      static_cast<std::size_t>(params.crop_width) * static_cast<std::size_t>(params.crop_height);
  const std::size_t per_task =
      std::max<std::size_t>(1, kPathsPerTask / static_cast<std::size_t>(params.samples_per_pixel));
  const std::size_t tasks = (pixel_count + per_task - 1) / per_task;
  progress.begin("rendering", "pixels", pixel_count);
  parallel_for(tasks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t task = begin; task < end; ++task) {
      const std::size_t first = task * per_task, last = std::min(first + per_task, pixel_count);
      loop.render_pixels(first, last, pixels, totals);
      progress.advance(last - first);
    }
  });
  progress.end();

  // Stages are sums over threads; what the threads spent between them (waiting for the last row) is shared
  // out alike.
  const double loop_seconds = watch.seconds() - report.seconds["diffusion"];
  const double busy = totals.primary + totals.diffusion + totals.surface;
  const double share = busy > 0 ? loop_seconds / busy : 0;
  report.seconds["primary_rays"] += totals.primary * share;
  report.seconds["diffusion"] += totals.diffusion * share;
  report.seconds["surface"] += totals.surface * share;
  report.counts["pixels"] += pixel_count;
  report.counts["rays"] += totals.rays;
  report.counts["shading_points"] += totals.shading_points;
  report.counts["kernel_evaluations"] += totals.evaluations;
  return pixels.make_image(params);
}

}  // namespace nacre
