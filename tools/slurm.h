// Jobs of the Slurm workload manager, by its own commands: sbatch, squeue, scancel.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace nacre::tools {

/// Throws Error(kNotFound) where there is no sbatch in the PATH.
void require_slurm();

/// "partition=render" to "--partition=render"; what begins with - stays. Throws UsageError for what a job of
/// nacre sets itself.
std::string parse_slurm_option(const std::string& text);

/// What sbatch is told of a job.
struct SlurmJob {
  std::string name;
  std::string script, script_path;   // a shell script, and where to keep it
  std::string log_folder, log_name;  // what the job says is appended there; %a in the name is the task
  std::vector<std::size_t> tasks;    // of an array; empty: one job without
  std::string after;                 // id of the job that has to succeed first, "" for none
  std::vector<std::string> options;  // of sbatch, from parse_slurm_option
};
/// Writes the script, submits it and returns the job's id. Throws Error(kIo) with what sbatch said.
std::string submit_job(const SlurmJob& job);

/// How many tasks wait or run, by state and what they wait for: "running", "pending (Resources)".
using SlurmTasks = std::map<std::string, std::size_t>;
/// Those of some jobs, empty when all are over. False if Slurm could not be asked.
bool query_jobs(const std::vector<std::string>& jobs, SlurmTasks& tasks);

/// Ends what is left of some jobs. False if they may go on.
bool cancel_jobs(const std::vector<std::string>& jobs);

}  // namespace nacre::tools
