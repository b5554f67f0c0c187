// OpenEXR files: written whole or not at all, read with distrust.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>
#include <ImfThreading.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <exception>
#include <fstream>

#include "base/exr_header.h"
#include "nacre/base/file.h"
#include "nacre/base/parallel.h"
#include "nacre/render/image_file.h"
#include "render/image_check.h"
#include "render/image_digest.h"

namespace nacre {
namespace {

// Of a frame of 1024 x 1024 x 24 floats, level 9 takes twice as long to save 1 % of the bytes.
constexpr int kZipLevel = 1;
// Values that one call of OpenEXR decodes.
constexpr std::int64_t kBlockValues = std::int64_t{1} << 22;

// OpenEXR's own threads follow the limit of nacre's; 0 means the calling thread alone, which has to do where
// there is no memory for others.
int match_threads() {
  const int threads = thread_count() > 1 ? thread_count() : 0;
  try {
    if (Imf::globalThreadCount() != threads) Imf::setGlobalThreadCount(threads);
    return threads;
  } catch (const std::exception&) {
    return 0;
  }
}

// OpenEXR's view of an AtomicFile. It keeps the first error, because OpenEXR's destructors swallow theirs.
class OutputStream final : public Imf::OStream {
 public:
  OutputStream(AtomicFile& file, const std::string& path) : Imf::OStream(path.c_str()), file_(file) {}

  void write(const char data[], int bytes) override {
    guard([&] { file_.write(data, static_cast<std::size_t>(bytes)); });
    position_ += static_cast<std::uint64_t>(bytes);
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override {
    guard([&] { file_.seek(position); });
    position_ = position;
  }
  void rethrow_error() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  template <class Action>
  void guard(const Action& action) {
    try {
      action();
    } catch (...) {
      if (!error_) error_ = std::current_exception();
      throw;
    }
  }

  AtomicFile& file_;
  std::uint64_t position_ = 0;
  std::exception_ptr error_;
};

Imf::Header make_header(const Image& image, const std::string& path) {
  const Imath::Box2i display({0, 0}, {image.full_width - 1, image.full_height - 1});
  const Imath::Box2i data({image.x, image.y}, {image.x + image.width - 1, image.y + image.height - 1});
  Imf::Header header(display, data);
  header.compression() = Imf::ZIP_COMPRESSION;
  header.zipCompressionLevel() = kZipLevel;
  for (const Channel& channel : image.channels)
    header.channels().insert(channel.name, Imf::Channel(Imf::FLOAT));
  for (const auto& [name, value] : image.metadata) {
    const bool reserved =
        header.find(name) != header.end() || name == "type" || name == "tiles" || name == "chunkCount";
    if (name.empty() || name.size() > 255 || name.find('\0') != std::string::npos || reserved)
      fail(ErrorCode::kValue, path, "not written: '{}' cannot be the name of metadata in OpenEXR", name);
    header.insert(name, Imf::StringAttribute(value));
  }
  return header;
}

Image make_image(const Imf::Header& header) {
  const Imath::Box2i& display = header.displayWindow();
  const Imath::Box2i& data = header.dataWindow();
  Image image;
  image.full_width = display.max.x - display.min.x + 1;
  image.full_height = display.max.y - display.min.y + 1;
  image.x = data.min.x - display.min.x;
  image.y = data.min.y - display.min.y;
  image.width = data.max.x - data.min.x + 1;
  image.height = data.max.y - data.min.y + 1;
  for (auto at = header.channels().begin(); at != header.channels().end(); ++at)
    if (at.channel().xSampling == 1 && at.channel().ySampling == 1) image.channels.push_back({at.name(), {}});
  for (auto at = header.begin(); at != header.end(); ++at)
    if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&at.attribute());
        text && std::strcmp(at.name(), "type") != 0)
      image.metadata[at.name()] = text->value();
  return image;
}

// The planes grow with the lines that are decoded, so that a header which promises more pixels than the file
// holds costs no memory.
void read_pixels(Imf::InputFile& file, Image& image) {
  if (image.channels.empty()) return;
  const Imath::Box2i data = file.header().dataWindow();
  const auto width = static_cast<std::size_t>(image.width);
  const std::int64_t fitting =
      kBlockValues / (std::int64_t{image.width} * static_cast<std::int64_t>(image.channels.size()));
  // Whole chunks where possible: the longest common ones have 32 lines.
  const auto rows = static_cast<int>(
      std::clamp<std::int64_t>(fitting >= 32 ? fitting / 32 * 32 : fitting, 1, image.height));
  for (Channel& channel : image.channels)
    channel.values.reserve(width * static_cast<std::size_t>(image.height));
  for (int begin = 0; begin < image.height; begin += rows) {
    const int end = std::min(begin + rows, image.height);
    const Imath::Box2i block({data.min.x, data.min.y + begin}, {data.max.x, data.min.y + end - 1});
    Imf::FrameBuffer buffer;
    for (Channel& channel : image.channels) {
      channel.values.resize(width * static_cast<std::size_t>(end));
      buffer.insert(channel.name,
                    Imf::Slice::Make(Imf::FLOAT,
                                     channel.values.data() + width * static_cast<std::size_t>(begin), block));
    }
    file.setFrameBuffer(buffer);
    file.readPixels(block.min.y, block.max.y);
  }
}

void check_file(std::ifstream& stream, const std::string& path) {
  struct stat status;
  if (!stream || ::stat(path.c_str(), &status) != 0) {
    const int error = errno;
    fail(error == ENOENT || error == ENOTDIR ? ErrorCode::kNotFound : ErrorCode::kIo, path, "cannot read: {}",
         std::strerror(error));
  }
  if (!S_ISREG(status.st_mode)) fail(ErrorCode::kIo, path, "cannot read: not a file");
  const auto bytes = static_cast<std::uint64_t>(status.st_size);
  std::string head(std::min<std::uint64_t>(bytes, kMaxExrHeader), '\0');
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  if (!stream) fail(ErrorCode::kIo, path, "cannot read: {}", std::strerror(errno));
  check_exr_header(head, bytes, path);
  stream.seekg(0);
}

}  // namespace

const Channel* find_channel(const Image& image, const std::string& name) {
  const auto found = std::ranges::find(image.channels, name, &Channel::name);
  return found == image.channels.end() ? nullptr : &*found;
}

void save_exr(const Image& image, const std::string& path) {
  check_image(image, path);
  Imf::Header header = make_header(image, path);
  header.insert(kDigestKey, Imf::StringAttribute(image_digest(image)));
  Imf::FrameBuffer buffer;
  for (const Channel& channel : image.channels)
    buffer.insert(channel.name, Imf::Slice::Make(Imf::FLOAT, channel.values.data(), header.dataWindow()));
  AtomicFile file(path);
  OutputStream stream(file, path);
  try {
    Imf::OutputFile output(stream, header, match_threads());
    output.setFrameBuffer(buffer);
    output.writePixels(image.height);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    stream.rethrow_error();
    fail(ErrorCode::kIo, path, "cannot write: {}", error.what());
  }
  stream.rethrow_error();
  file.commit();
}

Image load_exr(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  check_file(stream, path);
  try {
    Imf::StdIFStream input(stream, path.c_str());
    Imf::InputFile file(input, match_threads());
    Image image = make_image(file.header());
    read_pixels(file, image);
    return image;
  } catch (const std::bad_alloc&) {
    fail(ErrorCode::kLimit, path, "the image does not fit into memory");
  } catch (const std::exception& error) {
    fail_damaged_exr(path, error);
  }
}

}  // namespace nacre
