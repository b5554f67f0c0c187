// Bars and lines.
#include "nacre/base/progress.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>

#include "nacre/base/error.h"

namespace nacre {
namespace {

std::string format_time(double seconds) {
  const long s = std::lround(seconds);
  if (s >= 3600) return fmt::format("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
  return fmt::format("{}:{:02}", s / 60, s % 60);
}

}  // namespace

void print_message(const std::string& text) noexcept { std::fputs(text.c_str(), stderr); }

void Progress::begin(std::string stage, std::string unit, std::uint64_t total) {
  const std::lock_guard lock(mutex_);
  stage_ = std::move(stage);
  unit_ = std::move(unit);
  total_ = total;
  done_ = 0;
  watch_ = Stopwatch();
  next_print_ms_ = style_ == ProgressStyle::kBar ? 200 : 5000;
}

void Progress::advance(std::uint64_t units) {
  done_ += units;
  if (!shows_progress()) return;
  const auto now = static_cast<std::int64_t>(watch_.seconds() * 1000);
  std::int64_t due = next_print_ms_;
  // The thread that moves the due time on is the one that prints.
  if (now < due ||
      !next_print_ms_.compare_exchange_strong(due, now + (style_ == ProgressStyle::kBar ? 200 : 5000)))
    return;
  const std::lock_guard lock(mutex_);
  print(false);
}

void Progress::end() {
  const std::lock_guard lock(mutex_);
  if (shows_progress()) print(true);
}

void Progress::say(const std::string& line) {
  const std::lock_guard lock(mutex_);
  if (!shows_progress()) return;
  print_message(fmt::format("{}{}\n", style_ == ProgressStyle::kBar ? "\r\033[K" : "", one_line(line)));
}

void Progress::warn(const std::string& line) {
  const std::lock_guard lock(mutex_);
  if (style_ == ProgressStyle::kSilent) return;
  print_message(
      fmt::format("{}nacre: warning: {}\n", style_ == ProgressStyle::kBar ? "\r\033[K" : "", one_line(line)));
}

void Progress::print(bool final) {
  const double elapsed = watch_.seconds();
  const std::uint64_t done = done_;
  const double fraction =
      total_ ? std::min(1.0, static_cast<double>(done) / static_cast<double>(total_)) : 1.0;
  const char* start = style_ == ProgressStyle::kBar ? "\r\033[K" : "";
  if (final) {
    print_message(fmt::format("{}{}: {} {} in {:.2f} s\n", start, stage_, total_, unit_, elapsed));
    return;
  }
  const std::string left = fraction > 0 ? format_time(elapsed * (1 - fraction) / fraction) : "?";
  if (style_ == ProgressStyle::kBar) {
    constexpr int kWidth = 30;
    const int filled = static_cast<int>(fraction * kWidth);
    print_message(fmt::format("{}{} [{:=>{}}{:->{}}] {:3.0f} %  {} left", start, stage_, "", filled, "",
                              kWidth - filled, 100 * fraction, left));
    std::fflush(stderr);
  } else {
    print_message(fmt::format("{}: {:.0f} %, {} left\n", stage_, 100 * fraction, left));
  }
}

}  // namespace nacre
