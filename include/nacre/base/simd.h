// Which vector instructions the inner loops use.
#pragma once

#include <string>
#include <vector>

namespace nacre {

/// Names of what this processor can run, best first, in lower case: "avx3", "avx2", "sse4", "ssse3", ...; the
/// last is "scalar", plain C++.
std::vector<std::string> simd_targets();
/// The one in use: the best, unless another was chosen. Results of two may differ by rounding.
std::string simd_target();
/// Chooses one for the whole process; false if `name` is none of simd_targets(). Not while others compute.
bool choose_simd_target(const std::string& name);

}  // namespace nacre
