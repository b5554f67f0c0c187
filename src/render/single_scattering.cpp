// Sampling of first-order scattering.
#include "nacre/render/single_scattering.h"

#include <algorithm>
#include <array>
#include <vector>

#include "nacre/base/random.h"
#include "nacre/optics/fresnel.h"
#include "nacre/optics/phase.h"
#include "render/interior.h"

namespace nacre {
namespace {

// A channel's rate, its double, of the thinnest and the densest member of a family.
constexpr std::size_t kMostRates = 12;

// Distances along the view ray, none longer than `limit`: free flights at given rates, those of the three
// channels and twice those, which is how light falls off that comes from in front and is attenuated on its
// way in as well. All densities are combined by the balance heuristic: a sample is drawn from their mean, by
// inverting its cumulative distribution as a whole, so that evenly spread numbers give evenly spread
// distances.
class FreeFlight {
 public:
  FreeFlight(std::span<const float> rates, float limit) : limit_(double{limit}) {
    for (const float rate : rates) add(double{rate});
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
  std::array<double, kMostRates> rate_{}, reach_{};  // reach: probability of a flight shorter than the limit
  std::size_t count_ = 0;
};

}  // namespace

struct SingleScattering::Impl {
  const World& world;
  Interior interior;
  struct Material {
    Rgb sigma_s, sigma_t;  // per scene unit
    Rgb g;
  };
  std::vector<Material> materials;
  // What shares points and connections.
  struct Group {
    std::vector<float> rates;            // of free flights
    std::vector<std::uint32_t> members;  // materials
  };
  std::vector<Group> groups;
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

  // Adds what reaches `at` from one light sample, per unit of scattering: attenuated irradiance times the
  // phase function.
  void connect(const Group& group, const InteriorPoint& at, const Vec3& inward, const LightSample& sample,
               InteriorRoom& room, LostSamples& lost, std::span<Rgb> arriving) const {
    if (is_black(sample.irradiance)) return;
    const LightSegment segment = interior.trace_light(at, sample, room);
    ++lost.taken;
    lost.lost += segment.lost;
    if (segment.blocked || is_black(segment.transmittance)) return;
    // Light travels along -direction and on along -inward: the cosine between them is that of the two.
    const float cosine = std::clamp(dot(segment.direction, inward), -1.0f, 1.0f);
    Rgb factor = segment.transmittance;
    if (conserving) factor *= segment.cos_entry / (eta * eta * segment.cos_refracted);
    for (const std::uint32_t i : group.members) {
      const Material& m = materials[i];
      for (int k = 0; k < 3; ++k)
        arriving[i][k] += sample.irradiance[k] * factor[k] * std::exp(-m.sigma_t[k] * segment.length) *
                          eval_henyey_greenstein(cosine, m.g[k]);
    }
  }
};

SingleScattering::SingleScattering(const World& world, std::size_t medium, const MaterialFamily& family) {
  const float eta = world.media[medium].eta();
  Impl impl{
      world, Interior(world, medium), {}, {}, eta, family.media[0].convention == Convention::kConserving};
  std::vector<std::uint32_t> own;
  for (const std::uint32_t index : family.wanted) {
    const Medium& m = family.media[index];
    if (m.eta() != eta) continue;
    own.push_back(index);
    impl.materials.push_back({m.sigma_s * m.scale, (m.sigma_s + m.sigma_a) * m.scale, m.g});
  }
  for (const std::vector<std::uint32_t>& alike : group_by_extinction(family.media)) {
    Impl::Group group;
    std::vector<Medium> members;
    for (const std::uint32_t index : alike) {
      members.push_back(family.media[index]);
      const auto wanted = std::ranges::find(own, index);
      if (wanted != own.end()) group.members.push_back(static_cast<std::uint32_t>(wanted - own.begin()));
    }
    const auto [thinnest, densest] = find_extinctions(members);
    for (int k = 0; k < 3; ++k)
      for (const float factor : {1.0f, 2.0f}) {
        if (thinnest[k] > 0) group.rates.push_back(thinnest[k] * factor);
        if (densest[k] > thinnest[k]) group.rates.push_back(densest[k] * factor);
      }
    if (!group.members.empty()) impl.groups.push_back(std::move(group));
  }
  impl_ = std::make_unique<const Impl>(std::move(impl));
}
SingleScattering::~SingleScattering() = default;
SingleScattering::SingleScattering(SingleScattering&&) noexcept = default;

Rgb SingleScattering::estimate(const SurfacePoint& point, const Vec3& out, int samples, std::uint64_t key,
                               std::uint32_t first_sample, LostSamples& lost) const {
  std::vector<Rgb> radiance(impl_->materials.size());
  estimate(point, out, samples, key, first_sample, lost, radiance);
  return radiance[0];
}

void SingleScattering::estimate(const SurfacePoint& point, const Vec3& out, int samples, std::uint64_t key,
                                std::uint32_t first_sample, LostSamples& lost,
                                std::span<Rgb> radiance) const {
  const Impl& m = *impl_;
  std::ranges::fill(radiance, Rgb(0, 0, 0));
  Vec3 inward;
  float transmittance = 0;
  const auto scatters = [](const Impl::Material& material) { return !is_black(material.sigma_s); };
  if (samples <= 0 || std::ranges::none_of(m.materials, scatters) ||
      !m.refract_view(point, out, inward, transmittance))
    return;
  InteriorRoom room;
  const ViewSegment view = m.interior.trace_view(point, out, inward, room);
  ++lost.taken;
  lost.lost += view.lost;
  std::vector<Rgb> arriving(m.materials.size());
  for (const Impl::Group& group : m.groups) {
    const FreeFlight flight(group.rates, view.length);
    if (!flight.possible()) continue;
    for (int i = 0; i < samples; ++i) {
      const std::uint32_t index = first_sample + static_cast<std::uint32_t>(i);
      const Vec3 u = sobol_3d(index, key);
      const auto distance = static_cast<float>(flight.sample(double{u.x}));
      const InteriorPoint at = view.at(distance);
      std::ranges::fill(arriving, Rgb(0, 0, 0));
      const auto gather = [&](const Connection& connection) {
        m.connect(group, at, inward, connection.sample, room, lost, arriving);
      };
      const std::size_t lights = m.world.scene->lights.size();
      if (lights > kMaxConnectedLights)
        for_each_connection(m.world, at.position, kNoNormal, 1, key, index, gather);
      else  // the same point of every light: what it has to be spread evenly with is the distance
        for (std::size_t light = 0; light < lights; ++light)
          gather(connect_to_light(m.world, light, at.position, kNoNormal, {u.y, u.z}, 1));
      const auto pdf = static_cast<float>(flight.pdf(double{distance}));
      for (const std::uint32_t j : group.members) {
        const Impl::Material& material = m.materials[j];
        for (int k = 0; k < 3; ++k)
          radiance[j][k] +=
              arriving[j][k] * material.sigma_s[k] * std::exp(-material.sigma_t[k] * distance) / pdf;
      }
    }
  }
  for (Rgb& value : radiance) value *= transmittance / static_cast<float>(samples);
}

}  // namespace nacre
