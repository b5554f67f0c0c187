// What a sweep renders: the points of a plan.
#pragma once

#include <string>
#include <vector>

#include "nacre/scene/vary.h"

namespace nacre::tools {

/// One thing that varies, and what it takes on.
struct SweepAxis {
  std::string name;  // the key, with * where values multiply
  std::vector<Setting> values;
};

struct SweepPlan {
  std::vector<SweepAxis> axes;               // empty for a plan from a file
  std::vector<std::vector<Setting>> points;  // each in the order of the axes
};

/// "KEY=A:B:COUNT[:log]", "KEY*=A:B:COUNT[:log]" or "KEY=v1;v2;...". Throws UsageError.
SweepAxis parse_axis(const std::string& text);
/// Every combination, the last axis fastest; or all axes together, step by step. Throws UsageError for axes
/// of different lengths, the same key twice, more than a million points.
SweepPlan make_plan(const std::vector<std::string>& axes, bool together);
/// A table with a header line of keys (.csv), or a list of objects (.json). Throws Error with `path` and
/// line.
SweepPlan load_plan(const std::string& path);

}  // namespace nacre::tools
