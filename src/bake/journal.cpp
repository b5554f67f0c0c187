// Records in a file, found again after a crash.
#include "bake/journal.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>

#include "nacre/base/error.h"

namespace nacre {
namespace {

struct Head {
  std::array<char, 8> magic;
  std::array<char, 40> key;  // padded with zeros
  std::uint64_t version;
  std::uint64_t checksum;  // of what is before it
};
static_assert(sizeof(Head) == 64);
constexpr std::array<char, 8> kMagic{'\x89', 'N', 'C', 'R', 'B', 'J', '\r', '\n'};
constexpr std::uint64_t kVersion = 1;

struct RecordHead {
  std::uint64_t pass, begin, bytes;
  std::uint64_t checksum;  // of the three numbers before it and the bytes that follow
};

Head make_head(const std::string& key) {
  Head head{kMagic, {}, kVersion, 0};
  key.copy(head.key.data(), head.key.size());
  head.checksum = XXH3_64bits(&head, offsetof(Head, checksum));
  return head;
}

std::uint64_t checksum_of(const RecordHead& head, std::span<const std::byte> payload) {
  return XXH3_64bits_withSeed(payload.data(), payload.size(),
                              XXH3_64bits(&head, offsetof(RecordHead, checksum)));
}

bool read_at(int descriptor, void* to, std::uint64_t bytes, std::uint64_t offset) {
  auto* at = static_cast<char*>(to);
  while (bytes > 0) {
    const ssize_t n = ::pread(descriptor, at, bytes, static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    at += n;
    offset += static_cast<std::uint64_t>(n);
    bytes -= static_cast<std::uint64_t>(n);
  }
  return true;
}

}  // namespace

Journal::Journal(std::string path, const std::string& key, double after)
    : path_(std::move(path)), key_(key), after_(after) {
  if (!path_.empty()) open_existing();
}

Journal::~Journal() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void Journal::open_existing() {
  descriptor_ = ::open(path_.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
  if (descriptor_ < 0) {
    if (errno != ENOENT) failed_ = true;  // what cannot be opened is left alone
    return;
  }
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    ::close(descriptor_);
    descriptor_ = -1;
    fail(ErrorCode::kIo, path_, "another bake is writing to it; wait for that one, or stop it");
  }
  const Head wanted = make_head(key_);
  Head head{};
  const ssize_t there = ::pread(descriptor_, head.magic.data(), head.magic.size(), 0);
  if (there > 0 && !std::equal(head.magic.begin(), head.magic.begin() + there, kMagic.begin())) {
    ::close(descriptor_);
    descriptor_ = -1;
    fail(ErrorCode::kValue, path_,
         "is not what an interrupted bake leaves, and would be replaced; give it another name");
  }
  const bool whole = read_at(descriptor_, &head, sizeof head, 0);
  ready_ = whole && std::memcmp(&head, &wanted, sizeof head) == 0;
  found_other_ = whole && !ready_;
  if (!ready_) return;
  const std::uint64_t end = read_records();
  if (::ftruncate(descriptor_, static_cast<off_t>(end)) != 0) failed_ = true;
  ::lseek(descriptor_, 0, SEEK_END);
}

// Returns where the last good record ends.
std::uint64_t Journal::read_records() {
  constexpr std::uint64_t kMostBytes = 1 << 24;  // far above what a record holds
  std::uint64_t at = sizeof(Head);
  std::vector<std::byte> payload;
  RecordHead head;
  while (read_at(descriptor_, &head, sizeof head, at) && head.bytes <= kMostBytes) {
    payload.resize(head.bytes);
    if (!read_at(descriptor_, payload.data(), head.bytes, at + sizeof head) ||
        checksum_of(head, payload) != head.checksum)
      break;
    records_[{head.pass, head.begin}] = {at + sizeof head, head.bytes};
    at += sizeof head + head.bytes;
  }
  return at;
}

bool Journal::restore(const Place& place, std::span<const std::span<std::byte>> parts) const {
  const auto found = records_.find(place);
  if (found == records_.end()) return false;
  std::uint64_t bytes = 0, at = found->second.offset;
  for (const auto& part : parts) bytes += part.size();
  if (bytes != found->second.bytes) return false;
  for (const auto& part : parts) {
    if (!read_at(descriptor_, part.data(), part.size(), at)) return false;
    at += part.size();
  }
  return true;
}

bool Journal::append(std::span<const std::byte> bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor_, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return false;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return true;
}

bool Journal::create() {
  if (descriptor_ < 0) {
    descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (descriptor_ < 0 || ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) return false;
  }
  const Head head = make_head(key_);
  return ::ftruncate(descriptor_, 0) == 0 && ::lseek(descriptor_, 0, SEEK_SET) == 0 &&
         append(std::as_bytes(std::span(&head, 1)));
}

void Journal::keep(const Place& place, std::span<const std::span<const std::byte>> parts) {
  if (path_.empty() || watch_.seconds() < after_) return;
  std::vector<std::byte> record(sizeof(RecordHead));
  for (const auto& part : parts) record.insert(record.end(), part.begin(), part.end());
  const auto payload = std::span(record).subspan(sizeof(RecordHead));
  RecordHead head{place.pass, place.begin, payload.size(), 0};
  head.checksum = checksum_of(head, payload);
  std::memcpy(record.data(), &head, sizeof head);
  const std::scoped_lock lock(mutex_);
  if (failed_) return;
  if (!ready_) ready_ = create();
  // In one call: what a crash cuts off is the end of the file.
  failed_ = !ready_ || !append(record);
}

}  // namespace nacre
