// A sweep as jobs of Slurm: an array of shards, and a job after it that merges what they rendered.
#pragma once

#include <string>
#include <vector>

#include "common.h"

namespace nacre::tools {

struct EngineOptions {
  std::string engine = "local";
  std::optional<int> shards, retries;
  std::vector<std::string> slurm;
  bool uses_slurm() const { return engine == "slurm"; }
};

void add_engine_options(CLI::App& command, EngineOptions& options);
/// Throws UsageError where an option has nothing to act on, Error where there is no Slurm.
void check_engine_options(const EngineOptions& options);

/// A sweep, as its shards are told of it.
struct SlurmSweep {
  std::vector<std::string> command;  // its words, from find_words
  std::string folder;
  std::vector<std::string> keys;  // of all points, as records have them
};
/// The words of a subcommand as it was given, without engine, reports and the like: what a shard is run by.
std::vector<std::string> find_words(const CLI::App& command);

/// Submits every shard that is not complete, waits, and submits what failed again. Throws Error(kIo) that
/// names pictures and logs if some are missing after the last attempt. On SIGINT and SIGTERM it cancels its
/// jobs and dies by that signal.
void run_on_slurm(const SlurmSweep& sweep, const EngineOptions& options, Session& session);

}  // namespace nacre::tools
