// A table of names that never moves.
#include "base/files_in_use.h"

#include <unistd.h>

#include <array>
#include <atomic>
#include <cstring>
#include <utility>

namespace nacre {
namespace {

enum SlotState : int { kFree, kBeingFilled, kTemporary, kMapping };

struct Slot {
  std::atomic<int> state{kFree};
  std::array<char, 4096> path{};
  const char* data = nullptr;
  std::size_t size = 0;
};

std::array<Slot, 256> slots;

}  // namespace

FileInUse::FileInUse(const std::string& path, const void* data, std::size_t size) {
  if (path.size() >= slots[0].path.size()) return;
  for (std::size_t i = 0; i < slots.size(); ++i) {
    Slot& slot = slots[i];
    int expected = kFree;
    if (!slot.state.compare_exchange_strong(expected, kBeingFilled)) continue;
    std::memcpy(slot.path.data(), path.c_str(), path.size() + 1);
    slot.data = static_cast<const char*>(data);
    slot.size = size;
    slot.state.store(data ? kMapping : kTemporary);
    slot_ = static_cast<int>(i);
    return;
  }
}

FileInUse::FileInUse(FileInUse&& other) noexcept : slot_(std::exchange(other.slot_, -1)) {}

FileInUse& FileInUse::operator=(FileInUse&& other) noexcept {
  std::swap(slot_, other.slot_);
  return *this;
}

FileInUse::~FileInUse() {
  if (slot_ >= 0) slots[static_cast<std::size_t>(slot_)].state.store(kFree);
}

void remove_temporaries() noexcept {
  for (const Slot& slot : slots)
    if (slot.state.load() == kTemporary) ::unlink(slot.path.data());
}

const char* mapped_at(const void* address) noexcept {
  const char* const at = static_cast<const char*>(address);
  for (const Slot& slot : slots)
    if (slot.state.load() == kMapping && at >= slot.data && at < slot.data + slot.size)
      return slot.path.data();
  return nullptr;
}

}  // namespace nacre
