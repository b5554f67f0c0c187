// Walks the attributes of an OpenEXR header and checks sizes that decide what will be allocated.
#include "base/exr_header.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>

#include "nacre/base/error.h"

namespace nacre {
namespace {

constexpr std::int32_t kMagic = 20000630;
constexpr std::int32_t kTiledFlag = 0x200, kLongNamesFlag = 0x400, kDeepFlag = 0x800, kMultiPartFlag = 0x1000;
// Values in the chunks that OpenEXR decodes at once: a group of lines, or a row of tiles.
constexpr std::int64_t kMaxChunkValues = std::int64_t{1} << 26;
constexpr std::int64_t kMaxChannels = 1024;
constexpr std::int64_t kFarthest = 1 << 29;

// Reads the head from front to back; every size is checked against what is left.
class Cursor {
 public:
  Cursor(std::string_view head, std::uint64_t file_bytes, const std::string& path)
      : head_(head), file_bytes_(file_bytes), path_(path) {}
  /// The next `count` bytes as a cursor of their own, whose errors still name bytes of the file.
  Cursor inside(std::uint64_t count) {
    const std::size_t begin = at_;
    bytes(count);
    Cursor part(head_.substr(0, at_), at_, path_);
    part.at_ = begin;
    return part;
  }

  std::string_view bytes(std::uint64_t count) {
    if (count > head_.size() - at_) fail_short();
    const std::string_view result = head_.substr(at_, static_cast<std::size_t>(count));
    at_ += result.size();
    return result;
  }
  std::int32_t integer() {
    const std::string_view b = bytes(4);
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
      value |= static_cast<std::uint32_t>(static_cast<unsigned char>(b[i])) << (8 * i);
    return static_cast<std::int32_t>(value);
  }
  std::string_view text() {
    const std::size_t end = head_.find('\0', at_);
    if (end == std::string_view::npos) fail_short();
    const std::string_view result = bytes(end - at_);
    bytes(1);
    return result;
  }
  [[noreturn]] void fail_damaged(std::string_view what) const {
    fail(ErrorCode::kSyntax, fmt::format("{}: byte {}", path_, at_), "damaged OpenEXR header: {}", what);
  }

 private:
  [[noreturn]] void fail_short() const {
    if (head_.size() < file_bytes_)
      fail(ErrorCode::kLimit, path_, "the OpenEXR header is longer than {} bytes", head_.size());
    fail(ErrorCode::kSyntax, fmt::format("{}: byte {}", path_, at_),
         "the file ends inside its OpenEXR header; it is truncated or damaged");
  }

  std::string_view head_;
  std::uint64_t file_bytes_;
  const std::string& path_;
  std::size_t at_ = 0;
};

struct Window {
  std::int64_t width = 0, height = 0;
};

struct Layout {
  std::optional<Window> data, display;
  std::optional<std::int64_t> channels;
  std::optional<int> compression;
  std::optional<std::array<std::int64_t, 2>> tile;
};

Window read_window(Cursor& cursor, std::string_view name) {
  std::array<std::int64_t, 4> v;
  for (std::int64_t& x : v) x = cursor.integer();
  if (std::ranges::any_of(v, [](std::int64_t x) { return x < -kFarthest || x > kFarthest; }) || v[2] < v[0] ||
      v[3] < v[1])
    cursor.fail_damaged(
        fmt::format("{} is ({}, {}) to ({}, {}), no rectangle", name, v[0], v[1], v[2], v[3]));
  return {v[2] - v[0] + 1, v[3] - v[1] + 1};
}

std::int64_t count_channels(Cursor& entries, const std::string& path) {
  std::int64_t count = 0;
  while (!entries.text().empty()) {
    entries.bytes(16);  // pixel type, flags, sampling
    if (++count > kMaxChannels)
      fail(ErrorCode::kLimit, path, "more than {} channels in an OpenEXR file", kMaxChannels);
  }
  if (count == 0) entries.fail_damaged("it names no channels");
  return count;
}

Layout read_layout(Cursor& cursor, const std::string& path) {
  Layout layout;
  for (;;) {
    const std::string_view name = cursor.text();
    if (name.empty()) return layout;
    const std::string_view type = cursor.text();
    const std::int32_t size = cursor.integer();
    if (size < 0) cursor.fail_damaged(fmt::format("attribute '{}' has a negative size", name));
    Cursor value = cursor.inside(static_cast<std::uint64_t>(size));
    if (name == "dataWindow" && type == "box2i") layout.data = read_window(value, name);
    if (name == "displayWindow" && type == "box2i") layout.display = read_window(value, name);
    if (name == "channels" && type == "chlist") layout.channels = count_channels(value, path);
    if (name == "compression" && type == "compression")
      layout.compression = static_cast<unsigned char>(value.bytes(1)[0]);
    if (name == "tiles" && type == "tiledesc") {
      const std::int32_t width = value.integer();
      layout.tile = {width, value.integer()};
    }
    // Parts of other kinds can hide behind the plain version number.
    if (name == "type" && size > 0)
      if (const auto kind = value.bytes(static_cast<std::uint64_t>(size));
          kind != "scanlineimage" && kind != "tiledimage")
        fail(ErrorCode::kUnsupported, path, "an OpenEXR part of another kind than scan lines or tiles");
  }
}

// Scan lines per chunk, by the number of the compression: none, rle, zips, zip, piz, pxr24, b44, b44a, dwaa,
// dwab.
std::int64_t lines_per_chunk(int compression, Cursor& cursor) {
  constexpr std::array<int, 10> kLines{1, 1, 1, 16, 32, 16, 32, 32, 32, 256};
  if (compression < 0 || compression >= static_cast<int>(kLines.size()))
    cursor.fail_damaged(fmt::format("unknown compression {}", compression));
  return kLines[static_cast<std::size_t>(compression)];
}

// No compression makes more of a byte than this: runs of 127, deflate's 1032 to 1 (twice over where runs come
// first), blocks of 4 x 4 halves in 3 bytes.
std::uint64_t most_per_byte(int compression) {
  constexpr std::uint64_t kDeflate = 1032;
  constexpr std::array<std::uint64_t, 10> kMost{
      1, 128, kDeflate, kDeflate, 16 * kDeflate, 2 * kDeflate, 16, 16, 64 * kDeflate, 64 * kDeflate};
  return kMost[static_cast<std::size_t>(compression)];
}

std::int64_t divide_up(std::int64_t a, std::int64_t b) { return (a + b - 1) / b; }

}  // namespace

void check_exr_header(std::string_view head, std::uint64_t file_bytes, const std::string& path) {
  Cursor cursor(head, file_bytes, path);
  if (head.size() < 8 || cursor.integer() != kMagic) fail(ErrorCode::kSyntax, path, "not an OpenEXR file");
  const std::int32_t version = cursor.integer();
  if ((version & (kDeepFlag | kMultiPartFlag)) != 0)
    fail(ErrorCode::kUnsupported, path, "deep and multi-part OpenEXR files are not read");
  if ((version & ~(kTiledFlag | kLongNamesFlag)) != 2)
    fail(ErrorCode::kUnsupported, path, "OpenEXR version {:#x} is not known", version);

  const Layout layout = read_layout(cursor, path);
  if (!layout.data || !layout.display || !layout.channels || !layout.compression)
    cursor.fail_damaged("one of channels, compression, dataWindow, displayWindow is missing");
  const auto [width, height] = *layout.data;
  const bool tiled = (version & kTiledFlag) != 0;
  if (tiled && (!layout.tile || (*layout.tile)[0] <= 0 || (*layout.tile)[1] <= 0))
    cursor.fail_damaged("the file is tiled and its tiles have no size");
  const std::int64_t chunk_width = tiled ? (*layout.tile)[0] : width;
  const std::int64_t chunk_height = tiled ? (*layout.tile)[1] : lines_per_chunk(*layout.compression, cursor);
  if (width * height > kMaxImagePixels ||
      std::max(width, chunk_width) > kMaxChunkValues / *layout.channels / chunk_height)
    fail(ErrorCode::kLimit, path,
         "{} x {} pixels with {} channels in chunks of {} x {} are more than nacre reads", width, height,
         *layout.channels, chunk_width, chunk_height);
  // Two bytes a pixel at least.
  if (static_cast<std::uint64_t>(width * height) * 2 > file_bytes * most_per_byte(*layout.compression))
    fail(ErrorCode::kSyntax, path, "truncated or damaged: {} bytes cannot hold {} x {} pixels", file_bytes,
         width, height);
  const std::int64_t chunks = divide_up(width, chunk_width) * divide_up(height, chunk_height);
  // Every chunk has an entry of eight bytes in the table behind the header.
  if (static_cast<std::uint64_t>(chunks) > file_bytes / 8)
    fail(ErrorCode::kSyntax, path,
         "truncated or damaged: {} x {} pixels need {} chunks, {} bytes cannot hold them", width, height,
         chunks, file_bytes);
}

void fail_damaged_exr(const std::string& path, const std::exception& error) {
  // OpenEXR repeats the path, sometimes over two lines.
  std::string reason = error.what();
  std::ranges::replace(reason, '\n', ' ');
  fail(ErrorCode::kSyntax, path, "truncated or damaged OpenEXR file: {}", reason);
}

}  // namespace nacre
