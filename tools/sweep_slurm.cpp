// Submitting, watching and retrying the shards of a sweep.
#include "sweep_slurm.h"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <set>
#include <thread>
#include <utility>

#include "nacre/base/simd.h"
#include "shell.h"
#include "slurm.h"
#include "sweep_record.h"

namespace nacre::tools {
namespace {

// Pictures that share rays are rendered together, so a shard is better not a single one. Slurm numbers tasks
// to 1000, unless told otherwise.
constexpr std::size_t kPicturesPerShard = 4, kMostShards = 1000;
constexpr int kRetries = 2;
// Between two questions to Slurm, which has other things to do: it grows as the jobs do.
constexpr double kShortestWait = 1, kLongestWait = 15;

volatile std::sig_atomic_t interrupted = 0;

// While it lives, SIGINT and SIGTERM only leave a note.
class SignalNote {
 public:
  SignalNote() : interrupt_(std::signal(SIGINT, note)), terminate_(std::signal(SIGTERM, note)) {}
  ~SignalNote() {
    std::signal(SIGINT, interrupt_);
    std::signal(SIGTERM, terminate_);
  }
  SignalNote(const SignalNote&) = delete;
  SignalNote& operator=(const SignalNote&) = delete;

 private:
  static void note(int signal) { interrupted = signal; }
  void (*interrupt_)(int);
  void (*terminate_)(int);
};

std::set<std::string> list_files(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    names.insert(entry.path().filename().string());
  return names;
}

// The points that are not proved complete.
std::vector<std::size_t> find_missing(const SlurmSweep& sweep) {
  // A network file system looks for what others wrote when a folder is opened.
  list_files(sweep.folder);
  list_files(sweep.folder + "/points");
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < sweep.keys.size(); ++i)
    if (!find_complete(sweep.folder, i, sweep.keys[i])) missing.push_back(i);
  return missing;
}

// From 1.
std::vector<std::size_t> find_shards(const std::vector<std::size_t>& points, std::size_t shards) {
  std::set<std::size_t> numbers;
  for (const std::size_t point : points) numbers.insert(point % shards + 1);
  return {numbers.begin(), numbers.end()};
}

std::string log_folder(const SlurmSweep& sweep) { return sweep.folder + "/slurm"; }

// The array, and the job that merges.
std::vector<std::string> submit(const SlurmSweep& sweep, const std::vector<std::string>& options,
                                const std::vector<std::size_t>& tasks, std::size_t shards) {
  const std::string folder = std::filesystem::absolute(log_folder(sweep)).string();
  std::string run = "#!/bin/sh\nexec " + quote_words(sweep.command);
  if (std::ranges::none_of(sweep.command, [](const std::string& w) { return w.starts_with("--threads="); }))
    run += " --threads=\"${SLURM_CPUS_ON_NODE:-1}\"";
  SlurmJob job{.name = "nacre-sweep",
               .script = fmt::format("{} --shard=\"$SLURM_ARRAY_TASK_ID/{}\"\n", run, shards),
               .script_path = folder + "/shard.sh",
               .log_folder = folder,
               .log_name = "shard-%a.log",
               .tasks = tasks,
               .after = "",
               .options = options};
  std::vector<std::string> jobs{submit_job(job)};
  job.name = "nacre-merge";
  job.script = run + "\n";
  job.script_path = folder + "/merge.sh";
  job.log_name = "merge.log";
  job.tasks.clear();
  job.after = jobs[0];
  try {
    jobs.push_back(submit_job(job));
  } catch (...) {
    cancel_jobs(jobs);
    throw;
  }
  return jobs;
}

[[noreturn]] void die_of_signal(const std::vector<std::string>& jobs, const std::string& folder,
                                Session& session) {
  const char* const fate = cancel_jobs(jobs) ? "are cancelled" : "may go on: scancel them";
  session.progress().warn(
      fmt::format("interrupted; Slurm jobs {} {}; what is complete stays in {}, and the same command goes on "
                  "with the rest",
                  fmt::join(jobs, " and "), fate, folder));
  std::signal(interrupted, SIG_DFL);
  std::raise(interrupted);
  std::abort();
}

void say_states(const SlurmTasks& tasks, Session& session) {
  std::string text;
  for (const auto& [state, count] : tasks)
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, state);
  session.progress().say("Slurm: " + text);
}

// Until the jobs are over, however they end.
void wait_for(const std::vector<std::string>& jobs, const SlurmSweep& sweep,
              const std::vector<std::size_t>& missing, Session& session) {
  Progress& progress = session.progress();
  std::size_t arrived = 0;
  const auto look = [&] {
    const std::set<std::string> records = list_files(sweep.folder + "/points");
    const auto now = static_cast<std::size_t>(std::ranges::count_if(missing, [&](std::size_t point) {
      return records.contains(std::filesystem::path(record_path(sweep.folder, point)).filename().string());
    }));
    if (now > arrived) progress.advance(now - std::exchange(arrived, now));
  };
  SlurmTasks tasks, said;
  bool answers = true;
  double pause = kShortestWait;
  for (Stopwatch watch, whole;;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    if (interrupted != 0) die_of_signal(jobs, sweep.folder, session);
    if (watch.seconds() < pause) continue;
    look();
    const bool answered = query_jobs(jobs, tasks);
    if (answers && !answered) progress.warn("Slurm does not answer squeue; asking again");
    answers = answered;
    if (answered && tasks.empty()) return;
    // Of a change of kind, not of number.
    if (answered && !std::ranges::equal(tasks, said, {}, &SlurmTasks::value_type::first,
                                        &SlurmTasks::value_type::first)) {
      say_states(tasks, session);
      said = tasks;
    }
    pause = std::clamp(whole.seconds() / 10, kShortestWait, kLongestWait);
    watch = Stopwatch();
  }
}

[[noreturn]] void fail_missing(const SlurmSweep& sweep, const std::vector<std::size_t>& missing,
                               std::size_t shards, int attempts) {
  constexpr std::size_t kNamed = 8;
  const auto list = [&](const std::vector<std::size_t>& numbers, const auto& name) {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < std::min(numbers.size(), kNamed); ++i) names.push_back(name(numbers[i]));
    return fmt::format("{}{}", fmt::join(names, ", "), numbers.size() > kNamed ? ", ..." : "");
  };
  fail(ErrorCode::kIo, sweep.folder, "{} of {} pictures failed in {} attempt{}: {}; why is in {}",
       missing.size(), sweep.keys.size(), attempts, attempts == 1 ? "" : "s", list(missing, picture_name),
       list(find_shards(missing, shards),
            [&](std::size_t shard) { return fmt::format("{}/shard-{}.log", log_folder(sweep), shard); }));
}

}  // namespace

void add_engine_options(CLI::App& command, EngineOptions& options) {
  command
      .add_option("--engine", options.engine,
                  "Who renders: local (default), or slurm, shards as jobs of a cluster; waits for them")
      ->check(CLI::IsMember({"local", "slurm"}));
  command
      .add_option("--shards", options.shards,
                  "With --engine slurm: number of shards (default: one for four pictures)")
      ->check(CLI::Range(1, 1 << 20));
  command
      .add_option("--retries", options.retries,
                  "With --engine slurm: how often shards that failed are submitted again (default: 2)")
      ->check(CLI::Range(0, 1000));
  command
      .add_option("--slurm-option", options.slurm,
                  "With --engine slurm: an option of sbatch, as partition=render; several by --slurm-option "
                  "again")
      ->allow_extra_args(false);
}

void check_engine_options(const EngineOptions& options) {
  if (!options.uses_slurm()) {
    if (options.shards || options.retries || !options.slurm.empty())
      throw UsageError("--shards, --retries and --slurm-option go with --engine slurm");
    return;
  }
  for (const std::string& option : options.slurm) parse_slurm_option(option);
  require_slurm();
}

std::vector<std::string> find_words(const CLI::App& command) {
  const std::set<std::string> own{"engine", "shards", "retries", "slurm-option", "report", "quiet", "simd"};
  std::vector<std::string> words{std::filesystem::read_symlink("/proc/self/exe").string(),
                                 command.get_name()};
  const std::vector<std::string> given = option_words(command, own);
  words.insert(words.end(), given.begin(), given.end());
  words.push_back("--simd=" + simd_target());
  return words;
}

void run_on_slurm(const SlurmSweep& sweep, const EngineOptions& options, Session& session) {
  const std::size_t shards =
      options.shards ? static_cast<std::size_t>(*options.shards)
                     : std::clamp<std::size_t>(sweep.keys.size() / kPicturesPerShard, 1, kMostShards);
  std::vector<std::string> slurm_options;
  for (const std::string& option : options.slurm) slurm_options.push_back(parse_slurm_option(option));
  std::filesystem::create_directories(log_folder(sweep));
  const SignalNote note;
  const int attempts = options.retries.value_or(kRetries) + 1;
  std::vector<std::size_t> missing = find_missing(sweep);
  for (int attempt = 1; !missing.empty(); ++attempt) {
    // What is there is new.
    for (const std::size_t point : missing) std::filesystem::remove(record_path(sweep.folder, point));
    const std::vector<std::size_t> tasks = find_shards(missing, shards);
    session.progress().begin("sweep", "pictures", missing.size());
    const std::vector<std::string> jobs = submit(sweep, slurm_options, tasks, shards);
    session.progress().say(fmt::format("Slurm job {}: {} shard{}; job {} merges; logs are in {}", jobs[0],
                                       tasks.size(), tasks.size() == 1 ? "" : "s", jobs[1],
                                       log_folder(sweep)));
    wait_for(jobs, sweep, missing, session);
    missing = find_missing(sweep);
    if (missing.empty())
      session.progress().end();
    else if (attempt == attempts)
      fail_missing(sweep, missing, shards, attempts);
    else
      session.progress().warn(fmt::format("{} pictures failed; submitting them again", missing.size()));
  }
}

}  // namespace nacre::tools
