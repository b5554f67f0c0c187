// In place of TBB's header. ThreadSanitizer sees only what is compiled with it, so it takes work that TBB's own
// threads hand to each other for races; it sees through these plain ones. More of them than cores, so that they
// meet in more orders.
#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "tbb/blocked_range.h"

namespace tbb {

template <class Value, class Body>
void parallel_for(const blocked_range<Value>& range, const Body& body) {
  std::atomic<Value> next{range.begin()};
  std::exception_ptr first;
  std::mutex mutex;
  const auto work = [&] {
    try {
      for (Value begin; (begin = next.fetch_add(range.grainsize())) < range.end();)
        body(blocked_range<Value>(begin, std::min(begin + range.grainsize(), range.end()), range.grainsize()));
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!first) first = std::current_exception();
      next = range.end();
    }
  };
  const Value pieces = (range.end() - range.begin() + range.grainsize() - 1) / range.grainsize();
  std::vector<std::thread> threads;
  for (Value i = 1; i < std::min<Value>(pieces, 4); ++i) threads.emplace_back(work);
  work();
  for (std::thread& thread : threads) thread.join();
  if (first) std::rethrow_exception(first);
}

}  // namespace tbb
