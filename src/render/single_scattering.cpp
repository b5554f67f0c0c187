// Sampling of first-order scattering.
#include "nacre/render/single_scattering.h"

#include <array>

#include "nacre/base/random.h"
#include "nacre/optics/fresnel.h"
#include "nacre/optics/phase.h"
#include "render/interior.h"

namespace nacre {
namespace {

// Distances along the view ray, none longer than `limit`: free flights of the three channels at their own
// rates, and at twice those, which is how light falls off that comes from in front and is attenuated on its
// way in as well. All densities are combined by the balance heuristic: a sample is drawn from their mean, by
// inverting its cumulative distribution as a whole, so that evenly spread numbers give evenly spread
// distances.
class FreeFlight {
 public:
  FreeFlight(const Rgb& sigma_t, float limit) : limit_(double{limit}) {
    for (int k = 0; k < 3; ++k)
      for (const float factor : {1.0f, 2.0f})
        if (sigma_t[k] > 0) add(double{sigma_t[k] * factor});
  }
  bool possible() const { return count_ > 0 && limit_ > 0; }

  double sample(double u) const {
    // The mean's quantile lies between those of its terms.
    double low = limit_, high = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      const double quantile = -std::log1p(-u * reach_[i]) / rate_[i];
      low = std::min(low, quantile);
      high = std::max(high, quantile);
    }
    double t = low;
    for (int step = 0; step < 60 && high - low > 1e-7 * high; ++step) {
      double cumulative = 0, density = 0;
      for (std::size_t i = 0; i < count_; ++i) {
        const double rest = std::exp(-rate_[i] * t);
        cumulative += (1 - rest) / reach_[i];
        density += rate_[i] * rest / reach_[i];
      }
      const double above = cumulative - u * static_cast<double>(count_);
      (above > 0 ? high : low) = t;
      const double newton = t - above / density;
      if (std::abs(newton - t) <= 1e-7 * t) break;
      t = newton > low && newton < high ? newton : (low + high) / 2;
    }
    return std::min(t, limit_);
  }
  double pdf(double t) const {
    double sum = 0;
    for (std::size_t i = 0; i < count_; ++i) sum += rate_[i] * std::exp(-rate_[i] * t) / reach_[i];
    return sum / static_cast<double>(count_);
  }

 private:
  void add(double rate) {
    rate_[count_] = rate;
    reach_[count_++] = -std::expm1(-rate * limit_);
  }

  double limit_;
  std::array<double, 6> rate_{}, reach_{};  // reach: probability of a flight shorter than the limit
  std::size_t count_ = 0;
};

}  // namespace

struct SingleScattering::Impl {
  const World& world;
  Interior interior;
  Rgb sigma_s, sigma_t;  // per scene unit
  Rgb g;
  float eta;
  bool conserving;

  // Whether light goes in at all, and how: inward is unit length and below the triangle's plane.
  bool refract_view(const SurfacePoint& point, const Vec3& out, Vec3& inward, float& transmittance) const {
    const Vec3 normal = point.normal_towards(out);
    transmittance = 1 - fresnel_reflectance(std::min(dot(normal, out), 1.0f), eta);
    if (!refract(out, normal, eta, inward)) return false;
    inward = inward.normalized();
    // An interpolated normal may refract the ray along the triangle or out of it; then the triangle's own
    // one decides.
    const Vec3 plane = point.geometric_normal * point.side(out);
    constexpr float kSteepEnough = -0.01f;
    if (dot(inward, plane) < kSteepEnough) return true;
    if (!refract(out, plane, eta, inward)) return false;
    inward = inward.normalized();
    return true;
  }

  // What reaches `at` from one light sample, per unit of scattering: attenuated irradiance times the phase
  // function.
  Rgb connect(const InteriorPoint& at, const Vec3& inward, const LightSample& sample, InteriorRoom& room,
              LostSamples& lost) const {
    if (is_black(sample.irradiance)) return {0, 0, 0};
    const LightSegment segment = interior.trace_light(at, sample, room);
    ++lost.taken;
    lost.lost += segment.lost;
    if (segment.blocked || is_black(segment.transmittance)) return {0, 0, 0};
    const float cosine = dot(segment.direction, inward);
    Rgb factor = segment.transmittance;
    if (conserving) factor *= segment.cos_entry / (eta * eta * segment.cos_refracted);
    Rgb value;
    for (int k = 0; k < 3; ++k)
      // Light travels along -direction and on along -inward: the cosine between them is that of the two.
      value[k] = sample.irradiance[k] * factor[k] * std::exp(-sigma_t[k] * segment.length) *
                 eval_henyey_greenstein(std::clamp(cosine, -1.0f, 1.0f), g[k]);
    return value;
  }
};

SingleScattering::SingleScattering(const World& world, std::size_t medium, const Medium& m) {
  impl_ = std::make_unique<const Impl>(Impl{world, Interior(world, medium), m.sigma_s * m.scale,
                                            (m.sigma_s + m.sigma_a) * m.scale, m.g, m.eta(),
                                            m.convention == Convention::kConserving});
}
SingleScattering::~SingleScattering() = default;
SingleScattering::SingleScattering(SingleScattering&&) noexcept = default;

Rgb SingleScattering::estimate(const SurfacePoint& point, const Vec3& out, int samples, std::uint64_t key,
                               std::uint32_t first_sample, LostSamples& lost) const {
  const Impl& m = *impl_;
  Rgb sum(0, 0, 0);
  Vec3 inward;
  float transmittance = 0;
  if (samples <= 0 || is_black(m.sigma_s) || !m.refract_view(point, out, inward, transmittance)) return sum;
  InteriorRoom room;
  const ViewSegment view = m.interior.trace_view(point, out, inward, room);
  ++lost.taken;
  lost.lost += view.lost;
  const FreeFlight flight(m.sigma_t, view.length);
  if (!flight.possible()) return sum;

  for (int i = 0; i < samples; ++i) {
    const std::uint32_t index = first_sample + static_cast<std::uint32_t>(i);
    const Vec3 u = sobol_3d(index, key);
    const auto distance = static_cast<float>(flight.sample(double{u.x}));
    const InteriorPoint at = view.at(distance);
    Rgb arriving(0, 0, 0);
    const auto gather = [&](const Connection& connection) {
      arriving += m.connect(at, inward, connection.sample, room, lost);
    };
    const std::size_t lights = m.world.scene->lights.size();
    if (lights > kMaxConnectedLights)
      for_each_connection(m.world, at.position, kNoNormal, 1, key, index, gather);
    else  // the same point of every light: what it has to be spread evenly with is the distance
      for (std::size_t light = 0; light < lights; ++light)
        gather(connect_to_light(m.world, light, at.position, kNoNormal, {u.y, u.z}, 1));
    const auto pdf = static_cast<float>(flight.pdf(double{distance}));
    for (int k = 0; k < 3; ++k)
      sum[k] += arriving[k] * m.sigma_s[k] * std::exp(-m.sigma_t[k] * distance) / pdf;
  }
  return sum * (transmittance / static_cast<float>(samples));
}

}  // namespace nacre
