// Slurm's commands, and reading what they say.
#include "slurm.h"

#include <unistd.h>

#include <algorithm>
#include <sstream>

#include "common.h"
#include "nacre/base/file.h"
#include "shell.h"

namespace nacre::tools {
namespace {

// What an error quotes has to fit its line.
std::string join_lines(std::string text) {
  while (text.ends_with('\n')) text.pop_back();
  for (std::size_t at; (at = text.find('\n')) != std::string::npos;) text.replace(at, 1, "; ");
  return text;
}

// sbatch replaces %a and the like in names of files.
std::string escape_percent(const std::string& path) {
  std::string escaped;
  for (const char c : path) escaped += c == '%' ? std::string("%%") : std::string(1, c);
  return escaped;
}

// --parsable gives "ID" or "ID;cluster"; a site may print more before it. "" if there is none.
std::string find_job_id(const std::string& output) {
  std::istringstream lines(output);
  std::string id;
  for (std::string line; std::getline(lines, line);) {
    const std::string number = line.substr(0, line.find(';'));
    if (!number.empty() && std::ranges::all_of(number, [](unsigned char c) { return std::isdigit(c); }))
      id = number;
  }
  return id;
}

}  // namespace

void require_slurm() {
  constexpr int kNotThere = 127;
  const CommandResult result = run_command({"sbatch", "--version"});
  if (result.exit_code != 0 && result.exit_code != kNotThere)
    fail(ErrorCode::kIo, "--engine slurm",
         "sbatch does not work here: {}; is this machine part of a cluster?",
         result.output.substr(0, result.output.find('\n')));
  if (result.exit_code == kNotThere)
    fail(ErrorCode::kNotFound, "--engine slurm",
         "there is no sbatch in the PATH; run this where Slurm jobs are submitted, or give each machine a "
         "--shard");
}

std::string parse_slurm_option(const std::string& text) {
  std::string option = text.starts_with("-") ? text : "--" + text;
  const std::string name = option.substr(0, option.find('='));
  // sbatch takes beginnings of long names, and values right behind short ones.
  const auto means = [&](const std::string& known) {
    return known.starts_with("--") ? name.size() > 3 && known.starts_with(name)
                                   : name.size() > 1 && name[1] != '-' && name.starts_with(known);
  };
  for (const char* const own :
       {"--array", "-a", "--dependency", "-d", "--output", "-o", "--error", "-e", "--parsable", "--wrap",
        "--quiet", "-Q", "--chdir", "-D", "--wait", "-W", "--kill-on-invalid-dep", "--open-mode"})
    if (means(own)) throw UsageError("--slurm-option " + text + ": that is nacre's to set");
  for (const char* const other : {"--test-only", "--help", "-h", "--usage", "--version", "-V"})
    if (means(other)) throw UsageError("--slurm-option " + text + ": with that sbatch submits nothing");
  return option;
}

std::string submit_job(const SlurmJob& job) {
  AtomicFile script(job.script_path);
  script.write(job.script.data(), job.script.size());
  script.commit();
  std::vector<std::string> words{"sbatch", "--job-name=" + job.name};
  words.insert(words.end(), job.options.begin(), job.options.end());
  words.insert(words.end(), {"--parsable", "--open-mode=append",
                             "--output=" + escape_percent(job.log_folder) + "/" + job.log_name});
  if (!job.tasks.empty()) words.push_back(fmt::format("--array={}", fmt::join(job.tasks, ",")));
  if (!job.after.empty())
    words.insert(words.end(), {"--dependency=afterok:" + job.after, "--kill-on-invalid-dep=yes"});
  words.push_back(job.script_path);
  const CommandResult result = run_command(words);
  std::string id = find_job_id(result.output);
  if (result.exit_code != 0 || id.empty())
    fail(ErrorCode::kIo, "--engine slurm", "{}", join_lines(result.output));
  return id;
}

bool query_jobs(const std::vector<std::string>& jobs, SlurmTasks& tasks) {
  tasks.clear();
  // All jobs of the user: of one that is long over squeue says that its id is invalid.
  const CommandResult result = run_command(
      {"squeue", "--noheader", "--array", fmt::format("--user={}", ::geteuid()), "--format=%F %T %r"});
  if (result.exit_code != 0) return false;
  std::istringstream lines(result.output);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string id, state, reason;
    words >> id >> state >> std::ws;
    std::getline(words, reason);
    if (std::ranges::find(jobs, id) == jobs.end()) continue;
    std::ranges::transform(state, state.begin(), [](unsigned char c) { return std::tolower(c); });
    ++tasks[state == "pending" ? fmt::format("{} ({})", state, reason) : state];
  }
  return true;
}

bool cancel_jobs(const std::vector<std::string>& jobs) {
  std::vector<std::string> words{"scancel"};
  words.insert(words.end(), jobs.begin(), jobs.end());
  return run_command(words).exit_code == 0;
}

}  // namespace nacre::tools
