// Files of checked sections: what caches and files of exitance have in common; see FORMAT.md.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "nacre/base/error.h"
#include "nacre/cache/cache.h"

namespace nacre::layout {

inline constexpr std::uint32_t kEndianMark = 0x0a0b0c0d;
inline constexpr std::uint64_t kAlignment = 64;

struct Header {
  std::array<unsigned char, 8> magic;
  std::uint32_t version;
  std::uint32_t endian_mark;
  std::uint64_t file_size;
  std::uint32_t section_count;
  std::uint32_t group_count;
  std::uint64_t table_checksum;
  std::uint64_t reserved[2];
  std::uint64_t header_checksum;  // of the 56 bytes before it
};
static_assert(sizeof(Header) == 64);

struct SectionEntry {
  std::array<char, 4> kind;
  std::uint32_t group;  // 0 for sections of the whole file
  std::uint64_t offset, size, checksum;
};
static_assert(sizeof(SectionEntry) == 32);

using Kind = std::array<char, 4>;

/// One of the family: its mark, and which sections it has in which order.
struct FileKind {
  std::array<unsigned char, 8> magic;
  std::uint32_t version;
  std::span<const Kind> of_file, per_group;
  const char* name;    // "cache"
  const char* origin;  // how one is made, "{}" for its path
  const char* remedy;  // what to do about damage
  std::uint64_t section_count(std::uint64_t groups) const {
    return of_file.size() + per_group.size() * groups;
  }
};

constexpr std::uint64_t align(std::uint64_t offset) {
  return (offset + kAlignment - 1) / kAlignment * kAlignment;
}

/// A mapped file whose header, table and checksums are right. Throws Error with `path` or "path: byte N" as
/// the place: kNotFound, kIo, kNotACache, kNewerVersion, kTruncated, kDamaged (naming the section).
class SectionReader {
 public:
  /// `versions` of one file, the newest last.
  SectionReader(std::string path, std::span<const FileKind> versions);

  std::uint32_t version() const { return header_.version; }
  std::uint32_t group_count() const { return header_.group_count; }
  /// Keeps the mapping alive.
  std::shared_ptr<const void> storage() const { return storage_; }
  std::span<const unsigned char> section(Kind kind, std::uint32_t group) const;
  template <class T>
  std::span<const T> array(Kind kind, std::uint32_t group) const {
    const auto bytes = section(kind, group);
    if (bytes.size() % sizeof(T) != 0) damaged(kind, group, "its size is no multiple of its element's");
    return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
  }
  KeyValues texts(Kind kind, std::uint32_t group) const;
  [[noreturn]] void damaged(Kind kind, std::uint32_t group, const std::string& reason) const;

 private:
  const SectionEntry& find(Kind kind, std::uint32_t group) const;
  void check_header();
  void check_table();
  [[noreturn]] void truncated(std::uint64_t wanted) const;

  std::string path_;
  std::span<const FileKind> versions_;
  const FileKind* file_kind_;  // the newest, until the file says which
  std::shared_ptr<const void> storage_;
  std::span<const unsigned char> file_;
  Header header_{};
  std::vector<SectionEntry> table_;
};

/// What a section holds; the order is that of the file.
struct Section {
  Kind kind;
  std::uint32_t group;
  const void* data;
  std::uint64_t size;
};
/// Writes a file; it appears under its name only when complete. Throws Error(kIo, path).
void write_sections(const std::string& path, const FileKind& file_kind, std::span<const Section> sections,
                    std::uint32_t group_count);
std::string encode_texts(const KeyValues& entries);
/// Whether a file begins like one of that kind. False for what cannot be read.
bool has_magic(const std::string& path, const std::array<unsigned char, 8>& magic);

}  // namespace nacre::layout
