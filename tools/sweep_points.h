// The points of a sweep.
#pragma once

#include <string>
#include <vector>

#include "nacre/cache/material_family.h"
#include "render_options.h"
#include "sweep_plan.h"
#include "sweep_slurm.h"

namespace nacre::tools {

struct SweepOptions : RenderOptions {
  std::vector<std::string> vary;
  std::string plan, medium, camera, output, shard;
  EngineOptions engine;
  bool zip = false;
  std::vector<std::string> words;  // what pictures depend on, as it was given
};

/// One point of the plan, and what it makes of the scene.
struct SweepPoint {
  std::size_t index;
  const std::vector<Setting>* settings;
  std::string camera;
  std::vector<std::string> lights;  // arguments of --light
  Medium material;
  std::string key = "";    // of all that its picture depends on
  std::string whole = "";  // the same of the picture that it is a part of
};

/// Throws UsageError for options that do not go together.
void check_sweep_options(const SweepOptions& options);
/// The same with the plan's keys.
void check_sweep_keys(const SweepOptions& options, const SweepPlan& plan);
/// The medium that varies; 0 if none has to. Throws UsageError, Error(kValue).
std::size_t find_medium(const Scene& scene, const std::string& id, bool needed);
/// Point `index` of the plan. Throws Error(kValue) that names it for a setting that the scene does not have.
SweepPoint make_sweep_point(const SweepOptions& options, const Scene& scene, std::size_t medium,
                            std::size_t index, const std::vector<Setting>& settings);
/// A hash of `conditions` and of what is the point's own.
std::string make_sweep_key(KeyValues conditions, const SweepPoint& point, const MaterialFamilies& materials);
/// The command that makes one point's picture: the same for every shard and every way to it.
std::string describe_command(const SweepOptions& options, const SweepPoint& point);

}  // namespace nacre::tools
