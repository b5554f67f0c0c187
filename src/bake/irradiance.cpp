// Transmitted irradiance at samples, and how certain it is.
#include "nacre/transport/irradiance.h"

#include "bake/journal.h"
#include "nacre/bake/bake.h"
#include "nacre/base/parallel.h"
#include "nacre/base/random.h"

namespace nacre {
namespace {

// Points that are computed, and kept in the journal, together.
constexpr std::size_t kChunk = 512;

// Points whose irradiance is below this share of the mean are as good as dark.
constexpr double kDarkShare = 0.01;

// Whether estimates differ by chance: not if every light is looked at in its one direction.
bool has_chance(const World& world, int bounces, const TranslucentAnswer& answer) {
  const std::vector<Light>& lights = world.scene->lights;
  if (bounces > 0 || answer || lights.size() > kMaxConnectedLights) return true;
  for (std::size_t i = 0; i < lights.size(); ++i)
    if (world.sends(i) && !is_delta(lights[i])) return true;
  return false;
}

// E_t for the medium's index and, perhaps, for kEtaNodes.
using Estimates = std::array<Rgb, 1 + kEtaNodes.size()>;

class Estimator {
 public:
  Estimator(const World& world, const ReceiverPoints& points, float eta, const IrradianceParams& params,
            const TranslucentAnswer& answer)
      : world_(world),
        points_(points),
        params_(params),
        answer_(answer),
        random_(has_chance(world, params.bounces, answer)) {
    etas_[0] = eta;
    std::ranges::copy(kEtaNodes, etas_.begin() + 1);
  }
  bool is_random() const { return random_; }

  /// Returns the standard error of the mean channel; 0 for a single estimate.
  double operator()(std::size_t i, int samples, Estimates& mean) const {
    const Vec3& normal = points_.normals[i];
    Receiver at{points_.positions[i], normal,
                offset_from_surface(points_.positions[i], normal, points_.extents[i]), etas_[0]};
    if (!points_.albedos.empty()) at.albedo = points_.albedos[i];
    const std::size_t count = params_.every_eta ? etas_.size() : 1;
    const std::uint64_t key = hash_words(params_.seed, i);
    const int batches = random_ ? std::min(samples, kIrradianceBatches) : 1;
    mean.fill(Rgb(0, 0, 0));
    std::array<double, kIrradianceBatches> of_batch{};
    for (int b = 0; b < batches; ++b) {
      // Those left over by division go to the first ones.
      const int own = random_ ? samples / batches + (b < samples % batches) : samples;
      Estimates estimates;
      estimate_irradiances(world_, at, std::span(etas_).first(count), own, params_.bounces,
                           hash_words(key, static_cast<std::uint64_t>(b)), answer_,
                           std::span(estimates).first(count));
      for (std::size_t e = 0; e < count; ++e) mean[e] += estimates[e] / static_cast<float>(batches);
      of_batch[static_cast<std::size_t>(b)] = double{mean_channel(estimates[0])};
    }
    if (batches < 2) return 0;
    double sum = 0, squares = 0;
    for (int b = 0; b < batches; ++b) sum += of_batch[static_cast<std::size_t>(b)];
    for (int b = 0; b < batches; ++b)
      squares += square(of_batch[static_cast<std::size_t>(b)] - sum / batches);
    return std::sqrt(squares / (batches * (batches - 1)));
  }

 private:
  const World& world_;
  const ReceiverPoints& points_;
  const IrradianceParams& params_;
  const TranslucentAnswer& answer_;
  bool random_;
  std::array<float, 1 + kEtaNodes.size()> etas_;
};

}  // namespace

SampleLight compute_irradiance(const World& world, const ReceiverPoints& points, float eta,
                               const IrradianceParams& params, Progress& progress,
                               const TranslucentAnswer& answer) {
  const std::size_t count = points.positions.size();
  const Estimator estimate(world, points, eta, params, answer);
  SampleLight light;
  light.irradiance.resize(count);
  const bool knows_error = !estimate.is_random() || params.samples > 1;
  if (knows_error) light.errors.resize(count);
  if (params.every_eta) light.ratios.resize(count);
  const auto keep = [&](std::size_t i, const Estimates& mean, double error) {
    light.irradiance[i] = mean[0];
    if (knows_error) light.errors[i] = static_cast<float>(error);
    if (params.every_eta) light.ratios[i] = encode_eta_ratios(std::span(mean).subspan<1, kEtaNodes.size()>());
  };
  // In chunks that are the same in every run of a bake, each computed or found in the journal.
  const auto for_each_point = [&](const char* stage, std::uint64_t pass, const auto& compute) {
    progress.begin(stage, "samples", count);
    parallel_for((count + kChunk - 1) / kChunk, 1, [&](std::size_t first, std::size_t last) {
      for (std::size_t chunk = first; chunk < last; ++chunk) {
        const std::size_t begin = chunk * kChunk, size = std::min(kChunk, count - begin);
        const auto bytes = [&](auto& values) {
          return std::as_writable_bytes(values.empty() ? std::span(values)
                                                       : std::span(values).subspan(begin, size));
        };
        const std::array<std::span<std::byte>, 3> parts{bytes(light.irradiance), bytes(light.errors),
                                                        bytes(light.ratios)};
        if (!params.journal || !params.journal->restore({pass, begin}, parts)) {
          for (std::size_t i = begin; i < begin + size; ++i) compute(i);
          const std::array<std::span<const std::byte>, 3> done{parts[0], parts[1], parts[2]};
          if (params.journal) params.journal->keep({pass, begin}, done);
        }
        progress.advance(size);
      }
    });
    progress.end();
  };
  for_each_point("computing irradiance", 2 * params.pass, [&](std::size_t i) {
    Estimates mean;
    const double error = estimate(i, params.samples, mean);
    keep(i, mean, error);
  });
  if (!(params.error > 0) || !estimate.is_random() || !knows_error) return light;

  double sum = 0;
  for (const Rgb& e : light.irradiance) sum += double{mean_channel(e)};
  const double dark = kDarkShare * sum / static_cast<double>(count);
  for_each_point("refining irradiance", 2 * params.pass + 1, [&](std::size_t i) {
    for (int factor = 2; factor <= kMostRefinement; factor *= 2) {
      const double allowed = params.error * std::max(double{mean_channel(light.irradiance[i])}, dark);
      if (double{light.errors[i]} <= allowed) break;
      Estimates mean;
      const double error = estimate(i, factor * params.samples, mean);
      keep(i, mean, error);
    }
  });
  return light;
}

}  // namespace nacre
