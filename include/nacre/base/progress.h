// Progress of long stages: a bar with the time left on a terminal, plain lines elsewhere, warnings alone, or
// nothing.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

#include "nacre/base/report.h"

namespace nacre {

/// Prints on standard error. Where that is closed or on a full disk nobody can be told, and work goes on.
void print_message(const std::string& text) noexcept;

enum class ProgressStyle { kSilent, kWarnings, kLines, kBar };

/// Shared by the threads of one stage after another. Writes to standard error.
class Progress {
 public:
  explicit Progress(ProgressStyle style = ProgressStyle::kSilent) : style_(style) {}
  /// Starts a stage of `total` units ("samples", "pixels").
  void begin(std::string stage, std::string unit, std::uint64_t total);
  /// Counts finished units; safe from any thread, prints at most a few times per second.
  void advance(std::uint64_t units);
  /// Ends the stage with a line that says how long it took.
  void end();
  /// One line of information, above the bar if there is one. Silent with kSilent and kWarnings.
  void say(const std::string& line);
  /// One line that begins with "nacre: warning: ". Silent with kSilent alone.
  void warn(const std::string& line);

 private:
  bool shows_progress() const { return style_ == ProgressStyle::kLines || style_ == ProgressStyle::kBar; }
  void print(bool final);
  ProgressStyle style_;
  std::string stage_, unit_;
  std::uint64_t total_ = 0;
  std::atomic<std::uint64_t> done_{0};
  std::atomic<std::int64_t> next_print_ms_{0};
  Stopwatch watch_;
  std::mutex mutex_;
};

}  // namespace nacre
