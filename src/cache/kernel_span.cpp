// Materials are added to the basis one by one, each time the one that those before it come least near to.
#include "cache/kernel_span.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "nacre/base/math.h"
#include "nacre/base/parallel.h"

namespace nacre {
namespace {

constexpr double kRowsPerOctave = 16;
constexpr double kNearest = 1.0 / 16;  // of the narrowest width: nearer, profiles are flat
constexpr double kNegligible = 1e-7;
constexpr double kRounding = 3e-7;  // relative, of a sum in single precision
constexpr double kDark = 1e-24;     // total of a profile of which single precision makes nothing

// One channel of all materials.
class ChannelSpan {
 public:
  ChannelSpan(std::span<const Response> responses, std::size_t channel, double farthest) {
    double nearest = farthest;
    for (std::size_t m = 0; m < responses.size(); ++m)
      if (const Profile& profile = responses[m].profiles[channel]; profile.total > kDark) {
        members_.push_back(m);
        nearest = std::min(nearest, kNearest * profile.width);
      }
    const auto rows =
        2 + static_cast<Eigen::Index>(kRowsPerOctave * std::log2(std::max(farthest / nearest, 1.0)));
    const Eigen::Index angles = std::max<Eigen::Index>(std::ssize(responses[0].entering), 1);
    values_.resize(rows * angles, std::ssize(members_));
    scales_.resize(rows * angles, std::ssize(members_));
    parallel_for(members_.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Response& response = responses[members_[i]];
        const Profile& profile = response.profiles[channel];
        const auto column = static_cast<Eigen::Index>(i);
        for (Eigen::Index row = 0; row < rows; ++row) {
          const double r = nearest * std::exp2(static_cast<double>(row) / kRowsPerOctave);
          const double value = eval_profile(profile, r),
                       least = std::max(value, kNegligible * profile.total / (kPi * square(r)));
          for (Eigen::Index angle = 0; angle < angles; ++angle) {
            const double share =
                response.entering.empty() ? 1 : response.entering[static_cast<std::size_t>(angle)];
            values_(row * angles + angle, column) = share * value;
            scales_(row * angles + angle, column) = 1 / (share * least);
          }
        }
      }
    });
  }

  // Adds to the basis until it is good enough; false if that takes all members.
  bool find_basis(double error) {
    weights_.assign(members_.size(), Eigen::VectorXd());
    std::vector<double> errors(members_.size(), 1);
    while (basis_.size() < std::min(members_.size(), kMostInSpan + 1)) {
      const auto worst = std::ranges::max_element(errors);
      if (*worst <= error) return true;
      basis_.push_back(worst - errors.begin());
      parallel_for(members_.size(), 1, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) errors[i] = fit(i);
      });
    }
    take_all();
    return members_.empty();
  }

  std::size_t size() const { return basis_.size(); }
  std::size_t member(std::size_t j) const { return members_[static_cast<std::size_t>(basis_[j])]; }
  void read_weights(std::size_t channel, KernelSpan& span) const {
    for (std::size_t i = 0; i < members_.size(); ++i)
      for (std::size_t j = 0; j < basis_.size(); ++j)
        span.weights[members_[i]][j][channel] = static_cast<float>(weights_[i][static_cast<Eigen::Index>(j)]);
  }

 private:
  void take_all() {
    basis_.clear();
    for (Eigen::Index i = 0; i < std::ssize(members_); ++i) {
      basis_.push_back(i);
      weights_[static_cast<std::size_t>(i)] = Eigen::VectorXd::Unit(std::ssize(members_), i);
    }
  }

  // The weights that come nearest to a member; returns their largest error.
  double fit(std::size_t i) {
    const auto column = static_cast<Eigen::Index>(i);
    Eigen::MatrixXd terms = scales_.col(column).asDiagonal() * values_(Eigen::all, basis_);
    const Eigen::VectorXd norms = terms.colwise().norm();
    terms = terms * norms.cwiseInverse().asDiagonal();
    const Eigen::VectorXd wanted = scales_.col(column).cwiseProduct(values_.col(column));
    weights_[i] = terms.colPivHouseholderQr().solve(wanted);
    const double error = (terms * weights_[i] - wanted).lpNorm<Eigen::Infinity>(),
                 cancelled = (terms.cwiseAbs() * weights_[i].cwiseAbs()).maxCoeff();
    weights_[i] = weights_[i].cwiseQuotient(norms);
    constexpr double kHuge = 1e30;  // of which single precision makes something
    const double sum = error + kRounding * cancelled;
    return sum < kHuge && weights_[i].lpNorm<Eigen::Infinity>() < kHuge ? sum : kHuge;
  }

  std::vector<std::size_t> members_;  // that scatter in this channel
  // R_d times what enters, and over what its error is measured: distances and angles x members.
  Eigen::MatrixXd values_, scales_;
  std::vector<Eigen::Index> basis_;
  std::vector<Eigen::VectorXd> weights_;
};

}  // namespace

std::optional<KernelSpan> find_span(std::span<const Response> responses, double farthest, double error) {
  std::vector<ChannelSpan> channels;
  KernelSpan span;
  bool are_fewer = false;
  for (std::size_t k = 0; k < 3; ++k) {
    ChannelSpan& channel = channels.emplace_back(responses, k, farthest);
    are_fewer |= channel.find_basis(error);
    span.counts[k] = channel.size();
  }
  const std::size_t size = std::ranges::max(span.counts);
  if (!are_fewer || size == 0) return std::nullopt;
  span.basis.assign(size, ChannelChoice{});
  span.weights.assign(responses.size(), std::vector<std::array<float, 3>>(size, {0, 0, 0}));
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t j = 0; j < channels[k].size(); ++j) span.basis[j][k] = channels[k].member(j);
    channels[k].read_weights(k, span);
  }
  return span;
}

}  // namespace nacre
