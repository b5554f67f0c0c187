// What shows the pictures of a sweep together.
#pragma once

#include <optional>
#include <vector>

#include "sweep_points.h"
#include "sweep_record.h"

namespace nacre::tools {

/// Writes previews at one exposure (without one the lowest that suits a picture), contact_sheet.png,
/// index.html and manifest.json, once every picture is there.
void assemble_sweep(const SweepOptions& options, const SweepPlan& plan, const std::vector<SweepPoint>& points,
                    const std::vector<SweepRecord>& records, std::optional<double> exposure,
                    Session& session);

}  // namespace nacre::tools
