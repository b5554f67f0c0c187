// What a command did and how long it took: stages and counts by the names that users see in --report.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>

namespace nacre {

/// Seconds since construction.
class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Stages are "load", "build_bvh", "place_samples", ... They add up to the command's total.
struct Report {
  std::map<std::string, double> seconds;
  std::map<std::string, std::uint64_t> counts;
  std::map<std::string, std::string> notes;
};

/// Adds the time of its life to one stage.
class StageTimer {
 public:
  StageTimer(Report& report, std::string stage) : report_(report), stage_(std::move(stage)) {}
  ~StageTimer() { report_.seconds[stage_] += watch_.seconds(); }
  StageTimer(const StageTimer&) = delete;
  StageTimer& operator=(const StageTimer&) = delete;

 private:
  Report& report_;
  std::string stage_;
  Stopwatch watch_;
};

/// Largest resident size of this process so far, bytes.
std::uint64_t peak_memory_bytes();

}  // namespace nacre
