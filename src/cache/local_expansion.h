// A smooth function around a point: the far part of a sum, for all receivers of a cell at once.
#pragma once

#include <array>

#include "nacre/base/math.h"
#include "nacre/cache/kernel.h"

namespace nacre {

/// Taylor series to second order of sums of R_d, three channels side by side.
struct LocalExpansion {
  Float4 value = broadcast(0);
  std::array<Float4, 3> gradient{value, value, value};
  std::array<Float4, 6> hessian{value, value, value, value, value, value};  // xx yy zz yz zx xy

  /// Adds `power` R(|offset + x|) as a function of x around 0.
  void add(const Float4& power, const Kernel::Jet& jet, const Vec3& offset) noexcept {
    const Float4 radial = power * jet.radial, bend = power * jet.bend;
    const Float4 x = broadcast(offset.x), y = broadcast(offset.y), z = broadcast(offset.z);
    value += power * jet.value;
    gradient[0] += radial * x;
    gradient[1] += radial * y;
    gradient[2] += radial * z;
    const Float4 bend_x = bend * x, bend_y = bend * y, bend_z = bend * z;
    hessian[0] += bend_x * x + radial;
    hessian[1] += bend_y * y + radial;
    hessian[2] += bend_z * z + radial;
    hessian[3] += bend_y * z;
    hessian[4] += bend_z * x;
    hessian[5] += bend_x * y;
  }

  Float4 eval(const Vec3& at) const noexcept {
    const Float4 x = broadcast(at.x), y = broadcast(at.y), z = broadcast(at.z);
    const std::array<Float4, 3> slope = bent(at);
    return value + (gradient[0] + broadcast(0.5f) * slope[0]) * x +
           (gradient[1] + broadcast(0.5f) * slope[1]) * y + (gradient[2] + broadcast(0.5f) * slope[2]) * z;
  }

  /// The same function around another point.
  LocalExpansion moved(const Vec3& to) const noexcept {
    LocalExpansion result = *this;
    result.value = eval(to);
    const std::array<Float4, 3> slope = bent(to);
    for (std::size_t i = 0; i < 3; ++i) result.gradient[i] += slope[i];
    return result;
  }

 private:
  // The Hessian times a vector.
  std::array<Float4, 3> bent(const Vec3& v) const noexcept {
    const Float4 x = broadcast(v.x), y = broadcast(v.y), z = broadcast(v.z);
    return {hessian[0] * x + hessian[5] * y + hessian[4] * z,
            hessian[5] * x + hessian[1] * y + hessian[3] * z,
            hessian[4] * x + hessian[3] * y + hessian[2] * z};
  }
};

}  // namespace nacre
