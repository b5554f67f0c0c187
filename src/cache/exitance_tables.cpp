// What the hierarchical sum prepares for a material: nodes as its loops read them, and how spread out a node
// may be at which distance.
#include <algorithm>
#include <cmath>

#include "cache/kernel_set.h"
#include "cache/kernel_span.h"
#include "cache/morton.h"
#include "nacre/base/error.h"
#include "nacre/base/parallel.h"
#include "nacre/cache/exitance.h"
#include "nacre/optics/eta_change.h"

namespace nacre {
namespace {

// The estimate of a node's error takes all its samples to lie where the profile bends most and adds up errors
// that mostly cancel, the more of them the smaller they are. What happens is smaller by this factor at a
// tolerance of 0.001, times (tolerance / 0.001)^kGrowth at larger ones, for every profile, material and shape
// (tests/cache/exitance_test.cpp; light of several colours is the worst), which `tolerance`, a relative RMSE
// over a picture, makes use of.
constexpr double kCalibration = 11.5, kGrowth = 0.26;

// Light that falls on fewer pieces of a mean free path is summed as so few nodes that less cancels; and
// nothing does where there is but one, which is never allowed less than this.
constexpr double kManyPieces = 400, kAlone = 2.5;
// Pieces are no smaller than this share of the body.
constexpr double kSmallestPiece = 1.0 / 256;

// A series may err in the corners of its cell; in the rest of it, and over all directions, it errs by this
// share of the bound on its third derivatives.
constexpr double kSeriesWeight = 0.1;

// What single precision adds to a relative error: sums of 64 terms a lane, a few hundred of them a series.
constexpr double kRounding = 3e-5;

// From this tolerance on, tables are read without interpolation.
constexpr double kMiddlesTolerance = 0.005;

// Of the tolerance, what a few kernels may miss those of a family by.
constexpr double kSpanShare = 0.05;

constexpr float kNoLimit = 1e30f;

Medium in_units(Medium medium, float unit) {
  medium.scale /= unit;
  return medium;
}

}  // namespace

Exitance::Exitance(const CacheGroup& group, const MaterialFamily& family, double tolerance, Promise promise,
                   const IrradianceForEta& irradiance)
    : group_(group),
      unit_(std::ldexp(1.0f, -std::clamp(std::ilogb(shortest_length(family.media)), -100, 100))),
      spacing_(double{unit_} * hexagonal_spacing(group)),
      material_count_(family.wanted.size()),
      promise_(promise),
      allowance_(tolerance) {
  make_kernels(family);
  if (group.size() == 0) return;
  const OctreeNode root = make_octree_node(0);
  const Vec3 least = Vec3(root.centre[0], root.centre[1], root.centre[2]) - Vec3(root.radius),
             size(2 * root.radius);
  // Whole blocks around all samples, and no more than 2^20 cells an axis. Cells are for receivers, too, which
  // lie closer than a mean free path only where each of them has to be certain.
  const double length = double{unit_} * shortest_length(family.media);
  cell_size_ = std::max({kCellSpacings * spacing_, promise == Promise::kCertified ? 0 : kCellLengths * length,
                         0x1p-20 * double{size.x}});
  if (!(cell_size_ > 0)) cell_size_ = 1;
  if (!(spacing_ > 0)) spacing_ = cell_size_;
  if (promise == Promise::kCalibrated) {
    const double most = kCalibration * std::pow(tolerance / 0.001, kGrowth);
    piece_share_ = std::clamp(std::sqrt(lit_pieces(length) / kManyPieces), std::min(kAlone / most, 1.0), 1.0);
    allowance_ *= most * piece_share_;
  }
  cells_per_unit_ = 1 / cell_size_;
  for (int axis = 0; axis < 3; ++axis)
    origin_[axis] = (std::floor(double{least[axis]} / cell_size_) - (1 << kBlockLevels)) * cell_size_;
  const EtaRange etas = eta_range(family);
  if (etas.is_mixed() && (!(tolerance > 0) || promise == Promise::kCertified || !irradiance))
    fail(ErrorCode::kValue, group.name,
         "materials of several indices of refraction are summed up one by one");
  if (!(tolerance > 0)) return;
  if (promise == Promise::kCertified) {
    double tables = 0, jets = 0;
    for (const Kernel& kernel : kernels_) {
      tables = std::max(tables, kernel.relative_error(size.length()) + kRounding);
      jets = std::max(jets, kernel.relative_error_of_jets(size.length()));
    }
    allowance_ = tolerance - tables;
    moment_slack_ += static_cast<float>(jets);
    if (!(allowance_ > tables)) {
      const double digit = std::pow(10.0, std::floor(std::log10(2 * tables)));
      fail(ErrorCode::kLimit, group.name,
           "a tolerance of {:g} cannot be certified, tables and rounding may err by {:.2g}; take one of "
           "{:.1g} or more, or --method exact",
           tolerance, tables, digit * (std::floor(2 * tables / digit) + 1));
    }
  }
  if (promise == Promise::kCalibrated && tolerance >= kMiddlesTolerance)
    for (Kernel& kernel : kernels_) kernel.make_middles();
  if (family.media.size() > 1) make_set(family, tolerance, size.length());
  const std::vector<std::uint32_t> origins = copy_octree();
  add_all_moments({});
  if (etas.is_mixed()) make_powers(origins, double{etas.most}, irradiance);
  make_tables();
}

// How many nodes of about that radius would have the light if each had as much.
double Exitance::lit_pieces(double radius) const {
  radius = std::max(radius, kSmallestPiece * double{make_octree_node(0).radius});
  std::vector<std::uint32_t> open{0};
  Vec3d sum(0, 0, 0), squares(0, 0, 0);
  while (!open.empty()) {
    const OctreeNode node = make_octree_node(open.back());
    open.pop_back();
    if (double{node.radius} > radius && node.child_count() > 0) {
      for (std::uint32_t c = 0; c < node.child_count(); ++c) open.push_back(node.first_child + c);
      continue;
    }
    const Vec3d power(node.power[0], node.power[1], node.power[2]);
    sum += power;
    squares += power * power;
  }
  double fewest = kNoLimit;
  for (int k = 0; k < 3; ++k)
    if (squares[k] > 0) fewest = std::min(fewest, square(sum[k]) / squares[k]);
  return fewest;
}

Exitance::~Exitance() = default;

// Kernels of the materials, and those that errors are held against.
void Exitance::make_kernels(const MaterialFamily& family) {
  const auto profiles = [&](std::size_t i) {
    return resolved_profiles(in_units(family.media[i], unit_), spacing_);
  };
  const std::vector<ChannelChoice> extremes = find_extremes(family.media);
  // Errors are held against the extremes alone.
  for (const std::uint32_t material : family.wanted) {
    const ChannelChoice own{material, material, material};
    const bool is_guide = std::ranges::find(extremes, own) != extremes.end();
    kernels_.emplace_back(profiles(material),
                          is_guide ? Kernel::Envelopes::kWith : Kernel::Envelopes::kWithout);
  }
  double fastest = 0;
  for (const ChannelChoice& choice : extremes) {
    Guide& guide = guides_.emplace_back();
    const auto wanted = std::ranges::find(family.wanted, choice[0]);
    if (choice[0] == choice[1] && choice[1] == choice[2] && wanted != family.wanted.end()) {
      guide.kernel = static_cast<std::size_t>(wanted - family.wanted.begin());
    } else {
      guide.kernel = kernels_.size();
      kernels_.emplace_back(
          std::array{profiles(choice[0])[0], profiles(choice[1])[1], profiles(choice[2])[2]});
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const Profile profile = make_profiles(in_units(family.media[choice[k]], unit_))[k];
      if (!(profile.total > 0)) continue;
      fastest = std::max(fastest, profile.decay());
      guide.lit[static_cast<int>(k)] = static_cast<float>(profile.total);
      const auto& before = std::span(extremes).first(guides_.size() - 1);
      guide.limits[k] =
          std::ranges::none_of(before, [&](const ChannelChoice& other) { return other[k] == choice[k]; });
    }
  }
  // If light is absorbed rather than scattered R_d falls within a mean free path, and in the dark the sum is
  // a few nodes, whose errors do not cancel. Hardly any less where it falls within one or more, a tenth at
  // half.
  if (promise_ == Promise::kCalibrated)
    own_share_ = 1 / (1 + 0.4 * std::pow(fastest * double{unit_} * shortest_length(family.media), 6));
}

// Many materials are combinations of a few kernels. Those are of the whole family, whatever is wanted of it.
void Exitance::make_set(const MaterialFamily& family, double tolerance, double farthest) {
  const bool mixed = eta_range(family).is_mixed();
  kernel_count_ = material_count_;
  std::optional<KernelSpan> span;
  std::vector<Response> responses;
  if (promise_ == Promise::kCalibrated && family.media.size() > kFewMaterials) {
    for (const Medium& medium : family.media)
      responses.push_back({resolved_profiles(in_units(medium, unit_), spacing_),
                           mixed ? entering_shares(double{medium.eta()}) : std::vector<double>{}});
    span = find_span(responses, farthest, kSpanShare * tolerance);
  }
  if (!span) {
    std::vector<ChannelChoice> choices;
    for (const std::uint32_t material : family.wanted) choices.push_back({material, material, material});
    add_set(std::span(kernels_).first(material_count_), {material_count_, material_count_, material_count_},
            choices, family);
    return;
  }
  kernel_count_ = span->basis.size();
  std::vector<Kernel> kernels;
  for (const ChannelChoice& choice : span->basis) {
    kernels.emplace_back(std::array{responses[choice[0]].profiles[0], responses[choice[1]].profiles[1],
                                    responses[choice[2]].profiles[2]},
                         Kernel::Envelopes::kWithout);
    if (tolerance >= kMiddlesTolerance) kernels.back().make_middles();
  }
  add_set(kernels, span->counts, span->basis, family);
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t j = 0; j < span->counts[k]; ++j)
      for (const std::uint32_t material : family.wanted) weights_.push_back(span->weights[material][j][k]);
}

// `choices` are the materials that kernels are of, by channel.
void Exitance::add_set(std::span<const Kernel> kernels, const std::array<std::size_t, 3>& counts,
                       std::span<const ChannelChoice> choices, const MaterialFamily& family) {
  KernelLights lights;
  if (eta_range(family).is_mixed())
    for (const ChannelChoice& choice : choices)
      for (std::size_t k = 0; k < 3; ++k) {
        const double eta = double{family.media[choice[k]].eta()};
        const auto known = std::ranges::find(light_etas_, eta);
        if (k == 0) lights.emplace_back();
        lights.back()[k] = static_cast<std::uint32_t>(known - light_etas_.begin());
        if (known == light_etas_.end()) light_etas_.push_back(eta);
      }
  set_ = std::make_unique<const KernelSet>(kernels, counts, KernelSet::Tables::kAny, lights);
  if (!set_->interpolated())
    dark_set_ = std::make_unique<const KernelSet>(kernels, counts, KernelSet::Tables::kExact, lights);
}

// Samples at distances up to rho around their centroid, seen from within R of a target's centre: with their
// second moments, a node errs in channel k by at most P_k (T_k (spread (rho/3 + R) + R^3/6) + S_k lean + H_k
// tint), where S, H and T bound first, second and third derivatives: what is left out are third moments, the
// change of second moments' contribution over the target, its series' third order, and what differs between
// channels. As a point, by P_k (H_k spread + S_k lean). Allowed is P_k (own K_k + share_k). Divided by P_k
// T_k, and the least of channels taken, that leaves tables over distance against a node's own numbers.
void Exitance::make_tables() {
  DistanceBins all = kernels_[guides_[0].kernel].bound_bins();
  for (const Guide& guide : guides_) {
    const DistanceBins bins = kernels_[guide.kernel].bound_bins();
    all = {std::min(all.first, bins.first), std::max(all.last, bins.last), all.shift};
  }
  const auto bin_of = [&](double distance) {
    const auto r2 = static_cast<float>(std::clamp(square(distance), 1e-36, 1e36));
    return std::clamp(std::bit_cast<std::int32_t>(r2) >> all.shift, all.first, all.last);
  };
  const double largest = cell_size_ * (1 << kBlockLevels);
  const OctreeNode root = make_octree_node(0);
  // The first bin holds all that is nearer and is never accepted.
  bins_ = {bin_of(cell_size_ / 16), 0, all.shift};
  bins_.last = std::max(bin_of(2 * std::sqrt(3.0) * double{root.radius} + 4 * largest), bins_.first + 1);
  const auto count = static_cast<std::size_t>(bins_.last - bins_.first) + 1;
  constexpr std::size_t kVector = 64;  // floats in the longest vector there is
  const std::size_t padded = (count + kVector - 1) / kVector * kVector;
  lean_.assign(padded, 0);
  bend_.assign(padded, 0);
  for (Guide& guide : guides_) make_tables(guide, count);
}

void Exitance::make_tables(Guide& guide, std::size_t count) {
  const Kernel& kernel = kernels_[guide.kernel];
  const OctreeNode root = make_octree_node(0);
  const std::size_t padded = lean_.size();
  const bool certified = promise_ == Promise::kCertified;
  const double own = 0.5 * allowance_ * own_share_, largest = cell_size_ * (1 << kBlockLevels);
  const double weight = (certified ? 1 : kSeriesWeight) / 6;
  const auto edge2 = [&](std::size_t bin) {
    return std::bit_cast<float>((bins_.first + static_cast<std::int32_t>(bin)) << bins_.shift);
  };
  const double area = double{unit_} * double{unit_} * group_.surface_area;
  for (int k = 0; k < 3; ++k) {
    guide.limits[static_cast<std::size_t>(k)] &= root.power[k] > 0;
    guide.lit[k] *= area > 0 ? static_cast<float>(double{root.power[k]} / area) : 0.0f;
  }
  for (auto& channel : guide.per_third) channel.assign(padded, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const Kernel::Bounds& bounds = kernel.bounds(edge2(i));
    for (int k = 0; k < 3; ++k)
      if (root.power[k] > 0) {
        const float third = std::max(bounds.third[k], 1 / kNoLimit);
        guide.per_third[static_cast<std::size_t>(k)][i] = 1 / third;
        lean_[i] = std::max(lean_[i], std::min(bounds.slope[k] / third, kNoLimit));
        bend_[i] = std::max(bend_[i], std::min(bounds.hessian[k] / third, kNoLimit));
      }
  }
  const double smallest = cell_size_ * kSmallestRadius;
  const int radii = 1 + static_cast<int>(std::ceil(kRadiiPerOctave * std::log2(largest / smallest)));
  guide.radii.resize(static_cast<std::size_t>(radii));
  parallel_for(guide.radii.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = begin; j < end; ++j) {
      const double radius = smallest * std::exp2(static_cast<double>(j) / kRadiiPerOctave);
      for (std::size_t k = 0; k < 3; ++k) {
        auto &as_point = guide.radii[j].as_point[k], &in_series = guide.radii[j].in_series[k];
        as_point.assign(padded, kNoLimit);
        in_series.assign(padded, kNoLimit);
        if (!(root.power[k] > 0)) continue;
        for (std::size_t i = 0; i < count; ++i) {
          const auto channel = static_cast<int>(k);
          // From the middle of the target to the node, or from its far side to the node's.
          const double near = std::sqrt(double{edge2(i + 1)});
          const double there = certified ? (1 + 2 * kCertifiedRatio) * near + 2 * radius : near + radius;
          const double value = own * double{kernel.eval(static_cast<float>(square(there)))[channel]};
          const Kernel::Bounds& bounds = kernel.bounds(edge2(i));
          const double bend = double{bounds.hessian[channel]}, slope = double{bounds.slope[channel]};
          double series = weight * radius * radius * radius * double{bounds.third[channel]};
          if (certified)
            series += kernel.relative_error_of_jets(std::sqrt(edge2(i + 1))) * radius *
                      (slope + 0.5 * bend * radius);
          const auto limit = [&](double allowed) {
            return static_cast<float>(
                std::clamp(allowed * double{guide.per_third[k][i]}, -double{kNoLimit}, double{kNoLimit}));
          };
          as_point[i] = limit(value);
          in_series[i] = limit(value - series);
        }
      }
    }
  });
}

std::uint64_t Exitance::cell_code(const Vec3& x) const noexcept {
  std::uint64_t code = 0;
  for (int axis = 0; axis < 3; ++axis)
    code |= spread_bits(static_cast<std::uint64_t>(std::clamp(
                (static_cast<double>(unit_ * x[axis]) - origin_[axis]) * cells_per_unit_, 0.0, 0x1p21 - 1)))
            << axis;
  return code;
}

bool Exitance::in_grid(const Vec3& x) const noexcept {
  const Vec3d offset = (Vec3d(unit_ * x) - origin_) * cells_per_unit_;
  return std::min({offset.x, offset.y, offset.z}) >= 0 && std::max({offset.x, offset.y, offset.z}) < 0x1p21;
}

}  // namespace nacre
