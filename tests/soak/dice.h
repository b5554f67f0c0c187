// Random choices.
#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "nacre/base/random.h"

namespace nacre::soak {

class Dice {
 public:
  explicit Dice(std::uint64_t key) : rng_(key) {}
  bool chance(double probability) { return rng_.next_double() < probability; }
  double uniform(double low, double high) { return low + (high - low) * rng_.next_double(); }
  /// Every power of ten is as likely.
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  /// From low to high, both included.
  int integer(int low, int high) {
    return low + static_cast<int>(rng_.next_bits() % static_cast<std::uint64_t>(high - low + 1));
  }
  template <class Value>
  Value one_of(std::initializer_list<Value> values) {
    return values.begin()[integer(0, static_cast<int>(values.size()) - 1)];
  }
  std::uint64_t bits() { return rng_.next_bits(); }

 private:
  Rng rng_;
};

}  // namespace nacre::soak
