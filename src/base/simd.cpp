// Highway's run-time dispatch by names.
#include "nacre/base/simd.h"

#include <hwy/targets.h>

#include <algorithm>
#include <bit>
#include <cctype>

namespace nacre {
namespace {

// Those that inner loops are compiled for; a lower bit is a better target.
constexpr std::int64_t kCompiled = HWY_ATTAINABLE_TARGETS;

std::string name_of(std::int64_t target) {
  if (target == HWY_EMU128 || target == HWY_SCALAR) return "scalar";
  std::string name = hwy::TargetName(target);
  std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
  return name;
}

std::vector<std::int64_t> targets() {
  std::vector<std::int64_t> result;
  const std::int64_t supported = (hwy::SupportedTargets() | HWY_BASELINE_SCALAR) & kCompiled;
  for (std::int64_t rest = supported; rest != 0; rest &= rest - 1) result.push_back(rest & -rest);
  return result;
}

}  // namespace

std::vector<std::string> simd_targets() {
  std::vector<std::string> names;
  const std::int64_t chosen = hwy::SupportedTargets();
  hwy::SetSupportedTargetsForTest(0);  // what the processor has, whatever was chosen
  for (const std::int64_t target : targets()) names.push_back(name_of(target));
  if (chosen != hwy::SupportedTargets()) hwy::SetSupportedTargetsForTest(chosen);  // asking changes nothing
  return names;
}

std::string simd_target() { return name_of(targets().front()); }

bool choose_simd_target(const std::string& name) {
  hwy::SetSupportedTargetsForTest(0);
  for (const std::int64_t target : targets())
    if (name_of(target) == name) {
      hwy::SetSupportedTargetsForTest(target);
      hwy::GetChosenTarget().Update(target);
      return true;
    }
  return false;
}

}  // namespace nacre
