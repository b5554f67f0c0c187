// Decodes OpenEXR files from memory, read with distrust.
#include "scene/bitmap_exr.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>

#include <array>
#include <cstring>

#include "base/exr_header.h"

namespace nacre {
namespace {

// Lines that one call of OpenEXR decodes: whole chunks of the common compressions.
constexpr int kLines = 32;

class MemoryStream final : public Imf::IStream {
 public:
  MemoryStream(const std::string& bytes, const std::string& path)
      : Imf::IStream(path.c_str()), bytes_(bytes) {}
  bool read(char to[], int count) override {
    if (count < 0 || static_cast<std::uint64_t>(count) > bytes_.size() - at_)
      throw std::runtime_error("it ends too early");
    std::memcpy(to, bytes_.data() + at_, static_cast<std::size_t>(count));
    at_ += static_cast<std::size_t>(count);
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t position) override {
    if (position > bytes_.size()) throw std::runtime_error("it points behind its end");
    at_ = static_cast<std::size_t>(position);
  }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

// The names of the three channels.
std::array<const char*, 3> find_channels(const Imf::Header& header, const std::string& path) {
  const auto usable = [&](const char* name) {
    const Imf::Channel* channel = header.channels().findChannel(name);
    return channel && channel->xSampling == 1 && channel->ySampling == 1;
  };
  if (usable("R") && usable("G") && usable("B")) return {"R", "G", "B"};
  const bool coloured = header.channels().findChannel("RY") || header.channels().findChannel("BY");
  if (usable("Y") && !coloured) return {"Y", "Y", "Y"};
  fail(ErrorCode::kUnsupported, path, "an OpenEXR picture needs the channels R, G, B, or Y alone");
}

// The texels grow with the lines that are decoded, so that a header which promises more than the file holds
// costs no memory.
Bitmap read_texels(Imf::InputFile& file, const std::string& path) {
  const Imath::Box2i window = file.header().dataWindow();
  const std::array<const char*, 3> names = find_channels(file.header(), path);
  Bitmap bitmap;
  bitmap.width = window.max.x - window.min.x + 1;
  bitmap.height = window.max.y - window.min.y + 1;
  if (std::int64_t{bitmap.width} * bitmap.height > kMaxBitmapPixels)
    fail(ErrorCode::kLimit, path, "{} x {} pixels are more than the {} that nacre reads", bitmap.width,
         bitmap.height, kMaxBitmapPixels);
  const auto width = static_cast<std::size_t>(bitmap.width);
  const bool grey = names[0] == names[1];
  for (int begin = 0; begin < bitmap.height; begin += kLines) {
    const int end = std::min(begin + kLines, bitmap.height);
    const Imath::Box2i block({window.min.x, window.min.y + begin}, {window.max.x, window.min.y + end - 1});
    bitmap.texels.resize(width * static_cast<std::size_t>(end));
    Rgb* const first = bitmap.texels.data() + width * static_cast<std::size_t>(begin);
    Imf::FrameBuffer buffer;
    for (int k = 0; k < (grey ? 1 : 3); ++k)
      buffer.insert(names[static_cast<std::size_t>(k)],
                    Imf::Slice::Make(Imf::FLOAT, &first->x + k, block, sizeof(Rgb), sizeof(Rgb) * width));
    file.setFrameBuffer(buffer);
    file.readPixels(block.min.y, block.max.y);
  }
  if (grey)
    for (Rgb& texel : bitmap.texels) texel = Rgb(texel.x);
  return bitmap;
}

}  // namespace

Bitmap decode_exr(const std::string& bytes, const std::string& path) {
  check_exr_header(std::string_view(bytes).substr(0, kMaxExrHeader), bytes.size(), path);
  try {
    MemoryStream stream(bytes, path);
    Imf::InputFile file(stream, 0);
    return read_texels(file, path);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    fail(ErrorCode::kLimit, path, "the picture does not fit into memory");
  } catch (const std::exception& error) {
    fail_damaged_exr(path, error);
  }
}

}  // namespace nacre
