// Reading cache files: any byte may be hostile, so every count, offset, link and number is checked before
// use.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#include <xxhash.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "cache/cache_layout.h"
#include "nacre/base/error.h"
#include "nacre/base/parallel.h"
#include "nacre/cache/cache_file.h"

namespace nacre {
namespace {

// A read-only private mapping of a whole file.
class MappedFile {
 public:
  explicit MappedFile(const std::string& path) {
    // Not blocking: a pipe has to be refused, not waited for.
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (descriptor < 0) {
      const int error = errno;
      fail(error == ENOENT || error == ENOTDIR ? ErrorCode::kNotFound : ErrorCode::kIo, path,
           "cannot read the cache: {}", std::strerror(error));
    }
    struct stat status;
    if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) {
      ::close(descriptor);
      fail(ErrorCode::kNotACache, path, "is not a regular file");
    }
    size_ = static_cast<std::uint64_t>(status.st_size);
    if (size_ > 0) {
      void* address = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, descriptor, 0);
      const int error = errno;
      ::close(descriptor);
      if (address == MAP_FAILED) fail(ErrorCode::kIo, path, "cannot map the cache: {}", std::strerror(error));
      data_ = static_cast<const unsigned char*>(address);
    } else {
      ::close(descriptor);
    }
  }
  ~MappedFile() {
    if (data_) ::munmap(const_cast<unsigned char*>(data_), size_);
  }
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  const unsigned char* data() const { return data_; }
  std::uint64_t size() const { return size_; }

 private:
  const unsigned char* data_ = nullptr;
  std::uint64_t size_ = 0;
};

// The sections of one file, and the errors that name them.
class Reader {
 public:
  explicit Reader(std::string path) : path_(std::move(path)), file_(std::make_shared<MappedFile>(path_)) {
    check_header();
    check_table();
  }

  std::uint32_t group_count() const { return header_.group_count; }
  std::shared_ptr<const void> storage() const { return file_; }

  std::span<const unsigned char> section(layout::Kind kind, std::uint32_t group) const {
    const auto& entry = find(kind, group);
    return {file_->data() + entry.offset, entry.size};
  }

  template <class T>
  std::span<const T> array(layout::Kind kind, std::uint32_t group) const {
    const auto bytes = section(kind, group);
    if (bytes.size() % sizeof(T) != 0) damaged(kind, group, "its size is no multiple of its element's");
    return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
  }

  [[noreturn]] void damaged(layout::Kind kind, std::uint32_t group, const std::string& reason) const {
    fail(ErrorCode::kDamaged, fmt::format("{}: byte {}", path_, find(kind, group).offset),
         "section {} of group {} is damaged: {}; bake the cache again", name(kind), group, reason);
  }

 private:
  static std::string name(layout::Kind kind) {
    std::string text;
    for (const char c : kind) text += c >= ' ' && c <= '~' ? c : '?';
    return text;
  }

  // The table is known to be in the one order that the format allows.
  const layout::SectionEntry& find(layout::Kind kind, std::uint32_t group) const {
    std::uint64_t i =
        kind == layout::kFingerprint || kind == layout::kInfo ? 0 : layout::section_count(group);
    while (table_[i].kind != kind) ++i;
    return table_[i];
  }

  void check_header() {
    const std::uint64_t size = file_->size();
    if (size < layout::kMagic.size() ||
        std::memcmp(file_->data(), layout::kMagic.data(), layout::kMagic.size()) != 0)
      fail(ErrorCode::kNotACache, path_, "is not a nacre cache; make one with `nacre bake SCENE -o {}`",
           path_);
    if (size < sizeof(layout::Header)) truncated(sizeof(layout::Header));
    std::memcpy(&header_, file_->data(), sizeof header_);
    // Size, checksum and version keep their places in every version, so that damage is never taken for a
    // newer format.
    if (header_.header_checksum != XXH3_64bits(file_->data(), offsetof(layout::Header, header_checksum)))
      fail(ErrorCode::kDamaged, path_ + ": byte 0", "the header is damaged; bake the cache again");
    if (header_.version > kCacheVersion)
      fail(ErrorCode::kNewerVersion, path_,
           "has format version {}, newer than {}, the newest this nacre reads; update nacre", header_.version,
           kCacheVersion);
    if (header_.endian_mark != layout::kEndianMark || header_.version != kCacheVersion)
      fail(ErrorCode::kDamaged, path_ + ": byte 8", "unknown version or byte order; bake the cache again");
    if (size < header_.file_size) truncated(header_.file_size);
    if (size > header_.file_size)
      fail(ErrorCode::kDamaged, fmt::format("{}: byte {}", path_, header_.file_size),
           "{} bytes follow the end of the cache; bake the cache again", size - header_.file_size);
  }

  void check_table() {
    const std::uint64_t count = layout::section_count(header_.group_count);
    const std::uint64_t bytes = count * sizeof(layout::SectionEntry);
    if (header_.section_count != count)
      fail(ErrorCode::kDamaged, path_ + ": byte 24",
           "{} sections for {} groups instead of {}; bake the cache again", header_.section_count,
           header_.group_count, count);
    if (sizeof(layout::Header) + bytes > file_->size())
      fail(ErrorCode::kDamaged, path_ + ": byte 24", "the section table does not fit; bake the cache again");
    const unsigned char* begin = file_->data() + sizeof(layout::Header);
    if (header_.table_checksum != XXH3_64bits(begin, bytes))
      fail(ErrorCode::kDamaged, path_ + ": byte 64", "the section table is damaged; bake the cache again");
    table_.resize(count);
    std::memcpy(table_.data(), begin, bytes);
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto [kind, group] = layout::section_at(i);
      if (table_[i].kind != kind || table_[i].group != group)
        fail(ErrorCode::kDamaged,
             fmt::format("{}: byte {}", path_, sizeof(layout::Header) + i * sizeof table_[i]),
             "the table has section {} of group {} where {} of group {} belongs; bake the cache again",
             name(table_[i].kind), table_[i].group, name(kind), group);
    }
    std::uint64_t expected = layout::align(sizeof(layout::Header) + bytes);
    for (const auto& entry : table_) {
      if (expected > file_->size() || entry.offset != expected || entry.size > file_->size() - entry.offset)
        damaged(entry.kind, entry.group, "it is not where the format puts it");
      if (XXH3_64bits(file_->data() + entry.offset, entry.size) != entry.checksum)
        damaged(entry.kind, entry.group, "its checksum does not match");
      expected = layout::align(entry.offset + entry.size);
    }
    if (expected != file_->size())
      fail(ErrorCode::kDamaged, path_ + ": byte 16",
           "the file does not end with its last section; bake the cache again");
  }

  [[noreturn]] void truncated(std::uint64_t wanted) const {
    fail(ErrorCode::kTruncated, fmt::format("{}: byte {}", path_, file_->size()),
         "the cache ends here but should have {} bytes; copy it again or bake it again", wanted);
  }

  std::string path_;
  std::shared_ptr<MappedFile> file_;
  layout::Header header_{};
  std::vector<layout::SectionEntry> table_;
};

KeyValues read_key_values(const Reader& reader, layout::Kind kind, std::uint32_t group) {
  const auto bytes = reader.section(kind, group);
  std::size_t at = 0;
  const auto read_u32 = [&]() -> std::uint32_t {
    if (bytes.size() - at < 4) reader.damaged(kind, group, "a length is cut off");
    std::uint32_t value;
    std::memcpy(&value, bytes.data() + at, 4);
    at += 4;
    return value;
  };
  const auto read_text = [&] {
    const std::uint32_t length = read_u32();
    if (bytes.size() - at < length) reader.damaged(kind, group, "a text is cut off");
    std::string text(reinterpret_cast<const char*>(bytes.data() + at), length);
    at += length;
    return text;
  };
  KeyValues entries;
  for (std::uint32_t n = read_u32(); n > 0; --n) {
    std::string key = read_text();
    entries.emplace_back(std::move(key), read_text());
  }
  if (at != bytes.size()) reader.damaged(kind, group, "bytes are left over");
  return entries;
}

// Whether all of `values` satisfy a condition, on all cores.
template <class T, class Condition>
bool all(std::span<const T> values, const Condition& condition) {
  std::atomic<bool> good{true};
  parallel_for(values.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    bool range_good = true;
    for (std::size_t i = begin; i < end; ++i) range_good &= condition(values[i]);
    if (!range_good) good = false;
  });
  return good;
}

void check_planes(const Reader& reader, const CacheGroup& group, std::uint32_t index) {
  for (std::size_t k = 0; k < kPlaneCount; ++k) {
    const auto kind = layout::kPlanes[k];
    if (group.planes[k].size() != group.size()) reader.damaged(kind, index, "planes differ in length");
    const bool signed_plane = k < static_cast<std::size_t>(Plane::kArea);
    if (!all(group.planes[k], [&](float v) { return std::isfinite(v) && (signed_plane || v >= 0); }))
      reader.damaged(kind, index,
                     signed_plane ? "a value is not finite" : "a value is negative or not finite");
  }
  // Infinite power times a vanished profile would not be a number.
  const auto areas = group.plane(Plane::kArea);
  for (const Plane p : {Plane::kIrradianceR, Plane::kIrradianceG, Plane::kIrradianceB})
    if (!all(group.plane(p), [&](const float& e) {
          return std::isfinite(e * areas[static_cast<std::size_t>(&e - group.plane(p).data())]);
        }))
      reader.damaged(layout::kPlanes[static_cast<std::size_t>(p)], index,
                     "irradiance times area is not finite");
}

// The breadth-first order makes each node's place in the tree known from the nodes before it, so one pass
// proves that the links form a tree over exactly the group's samples.
void check_nodes(const Reader& reader, const CacheGroup& group, std::uint32_t index) {
  const auto bad = [&](const char* reason) { reader.damaged(layout::kNodes, index, reason); };
  const auto nodes = group.nodes;
  if (group.size() > kMaxSamplesPerGroup) bad("too many samples");
  if (nodes.empty() != (group.size() == 0)) bad("nodes and samples do not match");
  if (nodes.empty()) return;
  if (nodes[0].first_sample != 0 || nodes[0].sample_count() != group.size())
    bad("the root does not hold every sample");
  std::uint64_t next_child = 1, level_end = 1;
  int depth = 0;
  for (std::uint64_t n = 0; n < nodes.size(); ++n) {
    if (n == level_end) {
      level_end = next_child;
      if (++depth > kMaxOctreeDepth) bad("the tree is too deep");
    }
    const OctreeNode& node = nodes[n];
    const std::uint32_t children = node.child_count();
    if (children == 0) {
      if (node.first_child != 0) bad("a leaf has a child link");
      continue;
    }
    if (children > 8 || node.first_child != next_child || next_child + children > nodes.size())
      bad("a child link is wrong");
    std::uint64_t sample = node.first_sample;
    for (std::uint64_t c = next_child; c < next_child + children; ++c) {
      if (nodes[c].first_sample != sample || nodes[c].sample_count() == 0)
        bad("children do not divide their parent's samples");
      sample += nodes[c].sample_count();
    }
    if (sample != std::uint64_t{node.first_sample} + node.sample_count())
      bad("children do not divide their parent's samples");
    next_child += children;
  }
  if (next_child != nodes.size()) bad("nodes are left over");
  const auto finite = [](const OctreeNode& node) {
    bool good = std::isfinite(node.radius) && node.radius >= 0;
    for (int k = 0; k < 3; ++k) {
      good &= std::isfinite(node.centre[k]);
      for (const float v : {node.power[k], node.second_moment[k], node.first_moment[k]})
        good &= std::isfinite(v) && v >= 0;
    }
    return good;
  };
  if (!all(nodes, finite)) bad("a value is negative or not finite");
}

CacheGroup read_group(const Reader& reader, std::uint32_t index) {
  CacheGroup group;
  KeyValues entries = read_key_values(reader, layout::kGroup, index);
  if (entries.size() != 2 || entries[0].first != "name" || entries[1].first != "area")
    reader.damaged(layout::kGroup, index, "it does not hold a name and an area");
  group.name = std::move(entries[0].second);
  const std::string& area = entries[1].second;
  const char* end = area.data() + area.size();
  const auto parsed = std::from_chars(area.data(), end, group.surface_area);
  if (parsed.ec != std::errc() || parsed.ptr != end || !std::isfinite(group.surface_area) ||
      group.surface_area < 0)
    reader.damaged(layout::kGroup, index, "the surface area is not a number of 0 or more");
  for (std::size_t k = 0; k < kPlaneCount; ++k)
    group.planes[k] = reader.array<float>(layout::kPlanes[k], index);
  group.nodes = reader.array<OctreeNode>(layout::kNodes, index);
  check_planes(reader, group, index);
  check_nodes(reader, group, index);
  return group;
}

}  // namespace

Cache load_cache(const std::string& path) {
  const Reader reader(path);
  Cache cache;
  cache.fingerprint = read_key_values(reader, layout::kFingerprint, 0);
  cache.info = read_key_values(reader, layout::kInfo, 0);
  for (std::uint32_t g = 0; g < reader.group_count(); ++g) cache.groups.push_back(read_group(reader, g));
  cache.storage = reader.storage();
  return cache;
}

bool is_cache_file(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return false;
  std::array<unsigned char, 8> magic{};
  const bool read = ::read(descriptor, magic.data(), magic.size()) == static_cast<ssize_t>(magic.size());
  ::close(descriptor);
  return read && magic == layout::kMagic;
}

}  // namespace nacre
