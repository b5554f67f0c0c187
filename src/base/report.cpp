// Memory use of the process.
#include "nacre/base/report.h"

#include <sys/resource.h>

namespace nacre {

std::uint64_t peak_memory_bytes() {
  struct rusage usage;
  if (::getrusage(RUSAGE_SELF, &usage) != 0) return 0;
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace nacre
