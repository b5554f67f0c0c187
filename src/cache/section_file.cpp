// Reading and writing files of checked sections: any byte may be hostile, so every count, offset and size is
// checked before use.
#include "cache/section_file.h"

#include <fcntl.h>
#include <unistd.h>
#include <xxhash.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>

#include "nacre/base/file.h"

namespace nacre::layout {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little-endian and used in place");

std::string text_of(Kind kind) {
  std::string text;
  for (const char c : kind) text += c >= ' ' && c <= '~' ? c : '?';
  return text;
}

void append_u32(std::string& out, std::size_t value) {
  const auto v = static_cast<std::uint32_t>(value);
  char bytes[4];
  std::memcpy(bytes, &v, 4);
  out.append(bytes, 4);
}

}  // namespace

SectionReader::SectionReader(std::string path, std::span<const FileKind> versions)
    : path_(std::move(path)), versions_(versions), file_kind_(&versions.back()) {
  const auto file = std::make_shared<MappedFile>(path_, file_kind_->name);
  storage_ = file;
  file_ = file->bytes();
  check_header();
  check_table();
}

std::span<const unsigned char> SectionReader::section(Kind kind, std::uint32_t group) const {
  const SectionEntry& entry = find(kind, group);
  return file_.subspan(entry.offset, entry.size);
}

void SectionReader::damaged(Kind kind, std::uint32_t group, const std::string& reason) const {
  fail(ErrorCode::kDamaged, fmt::format("{}: byte {}", path_, find(kind, group).offset),
       "section {} of group {} is damaged: {}; {}", text_of(kind), group, reason, file_kind_->remedy);
}

// The table is known to be in the one order that the format allows.
const SectionEntry& SectionReader::find(Kind kind, std::uint32_t group) const {
  for (std::size_t i = 0; i < file_kind_->of_file.size(); ++i)
    if (file_kind_->of_file[i] == kind) return table_[i];
  std::uint64_t i = file_kind_->section_count(group);
  while (table_[i].kind != kind) ++i;
  return table_[i];
}

void SectionReader::check_header() {
  const FileKind& k = *file_kind_;
  if (file_.size() < k.magic.size() || std::memcmp(file_.data(), k.magic.data(), k.magic.size()) != 0)
    fail(ErrorCode::kNotACache, path_, "is not a nacre {}; {}", k.name,
         fmt::format(fmt::runtime(k.origin), path_));
  if (file_.size() < sizeof(Header)) truncated(sizeof(Header));
  std::memcpy(&header_, file_.data(), sizeof header_);
  // Size, checksum and version keep their places in every version, so that damage is never taken for a
  // newer format.
  if (header_.header_checksum != XXH3_64bits(file_.data(), offsetof(Header, header_checksum)))
    fail(ErrorCode::kDamaged, path_ + ": byte 0", "the header is damaged; {}", k.remedy);
  if (header_.version > k.version)
    fail(ErrorCode::kNewerVersion, path_,
         "has format version {}, newer than {}, the newest this nacre reads; update nacre", header_.version,
         k.version);
  const auto own = std::ranges::find(versions_, header_.version, &FileKind::version);
  if (header_.endian_mark != kEndianMark || own == versions_.end())
    fail(ErrorCode::kDamaged, path_ + ": byte 8", "unknown version or byte order; {}", k.remedy);
  file_kind_ = &*own;
  if (file_.size() < header_.file_size) truncated(header_.file_size);
  if (file_.size() > header_.file_size)
    fail(ErrorCode::kDamaged, fmt::format("{}: byte {}", path_, header_.file_size),
         "{} bytes follow the end of the {}; {}", file_.size() - header_.file_size, k.name, k.remedy);
}

void SectionReader::check_table() {
  const FileKind& k = *file_kind_;
  const std::uint64_t count = k.section_count(header_.group_count);
  const std::uint64_t bytes = count * sizeof(SectionEntry);
  if (header_.section_count != count)
    fail(ErrorCode::kDamaged, path_ + ": byte 24", "{} sections for {} groups instead of {}; {}",
         header_.section_count, header_.group_count, count, k.remedy);
  if (sizeof(Header) + bytes > file_.size())
    fail(ErrorCode::kDamaged, path_ + ": byte 24", "the section table does not fit; {}", k.remedy);
  const unsigned char* begin = file_.data() + sizeof(Header);
  if (header_.table_checksum != XXH3_64bits(begin, bytes))
    fail(ErrorCode::kDamaged, path_ + ": byte 64", "the section table is damaged; {}", k.remedy);
  table_.resize(count);
  std::memcpy(table_.data(), begin, bytes);
  for (std::uint64_t i = 0; i < count; ++i) {
    const bool of_file = i < k.of_file.size();
    const std::uint64_t within = of_file ? i : (i - k.of_file.size()) % k.per_group.size();
    const Kind kind = of_file ? k.of_file[within] : k.per_group[within];
    const auto group = static_cast<std::uint32_t>(of_file ? 0 : (i - k.of_file.size()) / k.per_group.size());
    if (table_[i].kind != kind || table_[i].group != group)
      fail(ErrorCode::kDamaged, fmt::format("{}: byte {}", path_, sizeof(Header) + i * sizeof table_[i]),
           "the table has section {} of group {} where {} of group {} belongs; {}", text_of(table_[i].kind),
           table_[i].group, text_of(kind), group, k.remedy);
  }
  std::uint64_t expected = align(sizeof(Header) + bytes);
  for (const SectionEntry& entry : table_) {
    if (expected > file_.size() || entry.offset != expected || entry.size > file_.size() - entry.offset)
      damaged(entry.kind, entry.group, "it is not where the format puts it");
    if (XXH3_64bits(file_.data() + entry.offset, entry.size) != entry.checksum)
      damaged(entry.kind, entry.group, "its checksum does not match");
    expected = align(entry.offset + entry.size);
  }
  if (expected != file_.size())
    fail(ErrorCode::kDamaged, path_ + ": byte 16", "the file does not end with its last section; {}",
         k.remedy);
}

void SectionReader::truncated(std::uint64_t wanted) const {
  fail(ErrorCode::kTruncated, fmt::format("{}: byte {}", path_, file_.size()),
       "the {} ends here but should have {} bytes; copy it again or {}", file_kind_->name, wanted,
       file_kind_->remedy);
}

KeyValues SectionReader::texts(Kind kind, std::uint32_t group) const {
  const auto bytes = section(kind, group);
  std::size_t at = 0;
  const auto read_u32 = [&]() -> std::uint32_t {
    if (bytes.size() - at < 4) damaged(kind, group, "a length is cut off");
    std::uint32_t value;
    std::memcpy(&value, bytes.data() + at, 4);
    at += 4;
    return value;
  };
  const auto read_text = [&] {
    const std::uint32_t length = read_u32();
    if (bytes.size() - at < length) damaged(kind, group, "a text is cut off");
    std::string text(reinterpret_cast<const char*>(bytes.data() + at), length);
    at += length;
    return text;
  };
  KeyValues entries;
  for (std::uint32_t n = read_u32(); n > 0; --n) {
    std::string key = read_text();
    entries.emplace_back(std::move(key), read_text());
  }
  if (at != bytes.size()) damaged(kind, group, "bytes are left over");
  return entries;
}

std::string encode_texts(const KeyValues& entries) {
  std::string out;
  append_u32(out, entries.size());
  for (const auto& [key, value] : entries) {
    append_u32(out, key.size());
    out += key;
    append_u32(out, value.size());
    out += value;
  }
  return out;
}

void write_sections(const std::string& path, const FileKind& file_kind, std::span<const Section> sections,
                    std::uint32_t group_count) {
  std::vector<SectionEntry> table;
  std::uint64_t offset = align(sizeof(Header) + sections.size() * sizeof(SectionEntry));
  for (const Section& section : sections) {
    table.push_back(
        {section.kind, section.group, offset, section.size, XXH3_64bits(section.data, section.size)});
    offset = align(offset + section.size);
  }
  Header header{};
  header.magic = file_kind.magic;
  header.version = file_kind.version;
  header.endian_mark = kEndianMark;
  header.file_size = offset;
  header.section_count = static_cast<std::uint32_t>(sections.size());
  header.group_count = group_count;
  header.table_checksum = XXH3_64bits(table.data(), table.size() * sizeof(SectionEntry));
  header.header_checksum = XXH3_64bits(&header, offsetof(Header, header_checksum));

  AtomicFile file(path);
  std::uint64_t at = 0;
  const std::array<char, kAlignment> zeros{};
  const auto write = [&](const void* data, std::uint64_t size) {
    if (size) file.write(data, size);
    at += size;
    if (at % kAlignment) {
      const std::uint64_t padding = kAlignment - at % kAlignment;
      file.write(zeros.data(), padding);
      at += padding;
    }
  };
  write(&header, sizeof header);
  write(table.data(), table.size() * sizeof(SectionEntry));
  for (const Section& section : sections) write(section.data, section.size);
  file.commit();
}

bool has_magic(const std::string& path, const std::array<unsigned char, 8>& magic) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return false;
  std::array<unsigned char, 8> begin{};
  const bool read = ::read(descriptor, begin.data(), begin.size()) == static_cast<ssize_t>(begin.size());
  ::close(descriptor);
  return read && begin == magic;
}

}  // namespace nacre::layout
