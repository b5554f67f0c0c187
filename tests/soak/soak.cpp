// Random scenes one after the other in one process, for as long as wanted.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <string_view>
#include <vector>

#include "nacre/base/report.h"
#include "soak/trial.h"

namespace nacre::soak {
namespace {

namespace fs = std::filesystem;

double resident_megabytes() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t size = 0, resident = 0;
  file >> size >> resident;
  return static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

struct Worst {
  std::size_t trials = 0, points = 0;
  double share = 0;    // of the tolerance, the largest
  double largest = 0;  // error of a point
};

struct Totals {
  std::size_t trials = 0, refused = 0, samples = 0;
  std::map<bool, Worst> worst;  // by whether certified
  std::vector<double> memory;   // MB after each trial

  void add(const Trial& trial) {
    ++trials;
    samples += trial.samples;
    memory.push_back(resident_megabytes());
    if (!trial.refusal.empty()) {
      ++refused;
      return;
    }
    Worst& w = worst[trial.certified];
    ++w.trials;
    w.points += trial.points;
    w.share = std::max(w.share, (trial.certified ? trial.largest : trial.relative_rmse) / trial.tolerance);
    w.largest = std::max(w.largest, trial.largest);
  }
  double median_memory(std::size_t begin, std::size_t end) const {
    std::vector<double> part(memory.begin() + static_cast<std::ptrdiff_t>(begin),
                             memory.begin() + static_cast<std::ptrdiff_t>(end));
    std::ranges::nth_element(part, part.begin() + static_cast<std::ptrdiff_t>(part.size() / 2));
    return part[part.size() / 2];
  }
  // Scenes are of bounded size, so what they take settles: the last quarter of them takes no more than the
  // second.
  bool memory_grows() const {
    const std::size_t n = memory.size();
    return n >= 200 && median_memory(3 * n / 4, n) > 1.25 * median_memory(n / 4, n / 2);
  }
  void print() const {
    fmt::print("{} scenes, {} of them refused, {} cache samples\n", trials, refused, samples);
    for (const auto& [certified, w] : worst)
      fmt::print(
          "{}: {} scenes, {} points against the exact sum, worst {} {:.3f} of the tolerance, largest error "
          "of a point {:.3g} %\n",
          certified ? "certified" : "calibrated", w.trials, w.points, certified ? "error" : "relative RMSE",
          w.share, 100 * w.largest);
    const std::size_t n = memory.size();
    if (n >= 4)
      fmt::print(
          "memory: {:.0f} MB after the first scene, {:.0f} after the last; median of the second quarter "
          "{:.0f} MB, of the last {:.0f} MB\n",
          memory.front(), memory.back(), median_memory(n / 4, n / 2), median_memory(3 * n / 4, n));
  }
};

int soak(double minutes, std::uint64_t first_seed, const std::string& folder) {
  const Stopwatch watch;
  Totals totals;
  double next_print = 60;
  int violations = 0;
  for (std::uint64_t seed = first_seed; watch.seconds() < 60 * minutes; ++seed) {
    const fs::path place = fs::path(folder) / fmt::format("seed-{}", seed);
    fs::create_directories(place);
    const Trial trial = run_trial(seed, place.string());
    totals.add(trial);
    if (trial.violation.empty()) {
      fs::remove_all(place);
    } else {
      ++violations;
      fmt::print("VIOLATION: seed {}: {} ({}); see {}\n", seed, trial.violation, trial.options,
                 place.string());
    }
    if (!trial.refusal.empty()) fmt::print("seed {} refused: {}\n", seed, trial.refusal);
    if (watch.seconds() > next_print) {
      fmt::print("{:.0f} s: ", watch.seconds());
      totals.print();
      next_print += 60;
    }
    std::fflush(stdout);
  }
  totals.print();
  if (totals.memory_grows()) fmt::print("VIOLATION: memory grows\n");
  return violations > 0 || totals.memory_grows() ? 1 : 0;
}

}  // namespace
}  // namespace nacre::soak

int main(int argc, char** argv) {
  double minutes = 0;
  std::uint64_t seed = 0;
  const auto read = [&](int i, auto& value) {
    const char* const end = argv[i] + std::strlen(argv[i]);
    return std::from_chars(argv[i], end, value).ptr == end;
  };
  if (argc != 4 || !read(1, minutes) || !read(2, seed) || !(minutes > 0)) {
    fmt::print(stderr, "usage: nacre_soak MINUTES FIRST_SEED FOLDER\n");
    return 2;
  }
  return nacre::soak::soak(minutes, seed, argv[3]);
}
