// Limits on the number of threads.
#include "nacre/base/parallel.h"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

namespace nacre {

int thread_count() noexcept {
  const auto limit = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  return std::min(static_cast<int>(limit), tbb::this_task_arena::max_concurrency());
}

ThreadLimit::ThreadLimit(int threads) {
  if (threads > 0)
    control_ = std::make_unique<tbb::global_control>(tbb::global_control::max_allowed_parallelism,
                                                     static_cast<std::size_t>(threads));
}
ThreadLimit::~ThreadLimit() = default;

}  // namespace nacre
