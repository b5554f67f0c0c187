#include "nacre/base/large_array.h"

#include <sys/mman.h>

#include <cstdlib>
#include <new>

namespace nacre {

void* allocate_large(std::size_t bytes) {
  constexpr std::size_t kPage = std::size_t{2} << 20, kAlignment = 64;
  const std::size_t alignment = bytes >= 4 * kPage ? kPage : kAlignment;
  void* const memory = std::aligned_alloc(alignment, (bytes + alignment) / alignment * alignment);
  if (!memory) throw std::bad_alloc();
  // Advice: a system without large pages does without.
  if (alignment == kPage) ::madvise(memory, bytes, MADV_HUGEPAGE);
  return memory;
}

void free_large(void* memory) noexcept { std::free(memory); }

}  // namespace nacre
