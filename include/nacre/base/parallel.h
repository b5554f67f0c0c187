// Loops over all cores. The only header that includes TBB's algorithms.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <cstddef>
#include <memory>

namespace tbb::detail::d1 {
class global_control;
}

namespace nacre {

/// Calls body(begin, end) on disjoint ranges that cover [0, count), of at most about `grain` items, on all
/// threads. The first exception is rethrown after the others have stopped.
template <class Body>
void parallel_for(std::size_t count, std::size_t grain, const Body& body) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, grain ? grain : 1),
                    [&](const tbb::blocked_range<std::size_t>& r) { body(r.begin(), r.end()); });
}

template <class Iterator, class Less>
void parallel_sort(Iterator begin, Iterator end, const Less& less) {
  tbb::parallel_sort(begin, end, less);
}

/// Number of threads that loops may use now.
int thread_count() noexcept;

/// Limits all loops of the process while it lives; 0 means every core. For `main` only.
class ThreadLimit {
 public:
  explicit ThreadLimit(int threads);
  ~ThreadLimit();

 private:
  std::unique_ptr<tbb::detail::d1::global_control> control_;
};

}  // namespace nacre
