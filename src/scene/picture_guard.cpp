// Follows lengths without making pixels. Formats: ISO/IEC 15948 (PNG); ITU-T T.81
// (JPEG); Ward 1991, "Real Pixels", and
// Radiance's filefmts.pdf (HDR).
#include "scene/picture_guard.h"

#include <algorithm>
#include <string_view>

#include "nacre/base/error.h"

namespace nacre {
namespace {

// Markers of JPEG: those that stand alone, Huffman tables.
constexpr int kRestart = 0xd0, kEndOfImage = 0xd9, kTemporary = 0x01, kHuffman = 0xc4;
constexpr int kMostCodes = 256, kLengths = 16;

// Widths of which scanlines may have runs.
constexpr int kLeastRunWidth = 8, kMostRunWidth = 32767;

class Bytes {
 public:
  Bytes(const std::string& bytes, std::size_t at, const std::string& path)
      : bytes_(bytes), at_(at), path_(path) {}
  int next() {
    skip(1);
    return static_cast<unsigned char>(bytes_[at_ - 1]);
  }
  int peek(std::size_t ahead) const {
    return at_ + ahead < bytes_.size() ? static_cast<unsigned char>(bytes_[at_ + ahead]) : -1;
  }
  void skip(std::size_t count) {
    if (count > bytes_.size() - at_) fail(ErrorCode::kSyntax, path_, "truncated: pixels are missing");
    at_ += count;
  }
  [[noreturn]] void damaged() const {
    fail(ErrorCode::kSyntax, path_, "damaged: the runs before byte {} do not fill a line of pixels", at_);
  }

 private:
  const std::string& bytes_;
  std::size_t at_;
  const std::string& path_;
};

void follow_runs(Bytes& bytes, int width) {
  for (int channel = 0; channel < 4; ++channel)
    for (int left = width; left > 0;) {
      const int count = bytes.next();
      const int length = count > 128 ? count - 128 : count;
      if (length == 0 || length > left) bytes.damaged();
      bytes.skip(count > 128 ? 1 : static_cast<std::size_t>(length));
      left -= length;
    }
}

}  // namespace

void check_png_chunks(const std::string& bytes, const std::string& path) {
  constexpr std::size_t kSignature = 8,
                        kAround = 12;  // length and type before a chunk's data, checksum behind
  for (std::size_t at = kSignature;;) {
    if (bytes.size() < at + kAround) fail(ErrorCode::kSyntax, path, "truncated: its last part is missing");
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8 | static_cast<unsigned char>(bytes[at + i]);
    if (length > bytes.size() - at - kAround)
      fail(ErrorCode::kSyntax, path, "truncated or damaged: the part at byte {} says that it has {} bytes",
           at, length);
    if (std::string_view(bytes).substr(at + 4, 4) == "IEND") return;
    at += kAround + length;
  }
}

void check_jpeg_tables(const std::string& bytes, const std::string& path) {
  const auto byte = [&](std::size_t i) {
    return i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0;
  };
  const auto check_segment = [&](std::size_t at, std::size_t end) {
    while (at < end) {  // as stb reads them, over the end if need be
      int codes = 0;
      for (std::size_t i = 1; i <= kLengths; ++i) codes += byte(at + i);
      if (codes > kMostCodes)
        fail(ErrorCode::kSyntax, path, "damaged: the Huffman table at byte {} has {} codes", at, codes);
      at += 1 + kLengths + static_cast<std::size_t>(codes);
    }
  };
  // What is no marker is passed over: pixels, in which 0xff is followed by 0, and whatever stands between
  // parts.
  for (std::size_t at = 0; at + 1 < bytes.size(); ++at) {
    const int marker = byte(at + 1);
    if (byte(at) != 0xff || marker == 0 || marker == 0xff || marker == kTemporary ||
        (marker >= kRestart && marker <= kEndOfImage))
      continue;
    const std::size_t length = static_cast<std::size_t>(byte(at + 2) << 8 | byte(at + 3));
    if (marker == kHuffman) check_segment(at + 4, at + 2 + length);
    at += 1 + std::max<std::size_t>(length, 2);  // to its last byte
  }
}

void check_hdr_pixels(const std::string& bytes, int width, int height, const std::string& path) {
  // After the first empty line and the line with the size.
  const std::size_t header_end = bytes.find("\n\n");
  const std::size_t begin = header_end == std::string::npos ? header_end : bytes.find('\n', header_end + 2);
  if (begin == std::string::npos) fail(ErrorCode::kSyntax, path, "truncated: pixels are missing");
  Bytes rest(bytes, begin + 1, path);
  const auto has_runs = [&] {
    return width >= kLeastRunWidth && width <= kMostRunWidth && rest.peek(0) == 2 && rest.peek(1) == 2 &&
           (rest.peek(2) & 0x80) == 0;
  };
  if (!has_runs()) {
    if (rest.peek(0) == 1 && rest.peek(1) == 1 && rest.peek(2) == 1)
      fail(ErrorCode::kUnsupported, path,
           "has run lengths of the old kind; save it again with a newer program");
    for (int y = 0; y < height; ++y) rest.skip(4 * static_cast<std::size_t>(width));
    return;
  }
  for (int y = 0; y < height; ++y) {
    if (!has_runs()) rest.damaged();
    rest.skip(2);
    const int high = rest.next();
    if ((high << 8 | rest.next()) != width) rest.damaged();
    follow_runs(rest, width);
  }
}

}  // namespace nacre
