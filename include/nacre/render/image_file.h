// Images in memory, OpenEXR files, and PNG previews. The only files that see OpenEXR and stb.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "nacre/base/error.h"
#include "nacre/base/math.h"

namespace nacre {

/// One channel plane: width * height floats, rows from the top.
struct Channel {
  std::string name;  // "R", "diffusion.G", "depth.Z"
  std::vector<float> values;
};

/// A rectangle of pixels cut out of a full frame, as EXR's data and display windows have it.
struct Image {
  int full_width = 0, full_height = 0;      // display window, from (0, 0)
  int x = 0, y = 0, width = 0, height = 0;  // data window
  std::vector<Channel> channels;
  std::map<std::string, std::string> metadata;  // string attributes of the header, "nacre:seed" and the like
};

/// The channel of that name, or nullptr.
const Channel* find_channel(const Image& image, const std::string& name);

/// The values of a channel of an image that are NaN or infinite: how many, and the pixel of the first.
struct BadValues {
  std::size_t count = 0;
  int x = 0, y = 0;
};
BadValues find_bad_values(const Image& image, const Channel& channel);

/// Metadata that save_exr adds: a hash of the size, the channels and all other metadata.
inline constexpr const char* kDigestKey = "nacre:digest";
/// How an image compares to its kDigestKey: damage that leaves a file readable, and other programs, change
/// it.
enum class Seal { kAbsent, kSound, kBroken };
Seal check_seal(const Image& image);

/// Writes 32-bit float scanline OpenEXR, ZIP compressed. The file appears under its name only when complete:
/// written under a temporary name in the same folder, synced, renamed; on failure the temporary is removed.
/// Throws Error(kIo, path) when it cannot; Error(kValue, path) that counts them and names channel and pixel
/// of the first if any value is NaN or infinite: such an image is never written.
void save_exr(const Image& image, const std::string& path);

/// Reads all channels of a scanline or tiled single-part OpenEXR as floats, subsampled channels excepted,
/// with its string attributes. Throws Error: kNotFound, kIo, kSyntax (not an OpenEXR file, or damaged),
/// kUnsupported (deep or multi-part), kLimit (a window of more than 2^28 pixels).
Image load_exr(const std::string& path);

/// 8-bit sRGB, rows from the top.
struct Preview {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};
/// R, G, B times 2^exposure, clipped, the alpha channel ignored (pictures have black behind them). Throws
/// Error with `path`: kValue for an exposure out of range or a channel that is missing, or a NaN.
Preview make_preview(const Image& image, const std::string& path, double exposure);
/// A PNG file's bytes. Throws Error(kLimit, path) for what no PNG holds.
std::vector<std::uint8_t> encode_png(const Preview& preview, const std::string& path);
/// Both, written like save_exr.
void save_png(const Image& image, const std::string& path, double exposure);
/// The exposure (EV) that puts the 99th percentile of the brightest channel of the covered pixels (alpha
/// above 0; all if there is no alpha) at 0.8 of full scale; 0 for a black picture.
double auto_exposure(const Image& image);

/// Difference of one layer. "R G B" is the beauty layer "", "diffusion.R ..." the layer "diffusion".
struct ImageDifference {
  double relative_rmse = 0;  // sqrt(sum (a-b)^2 / sum b^2) per channel over the pixels; the worst channel
  double largest_relative =
      0;  // over pixels whose |b| is above 1e-4 of the channel's largest |b| in the frame
  int largest_x = 0, largest_y = 0;  // where that is, in full-frame pixels
  std::string largest_channel;
  double psnr = 0;         // dB against the channel's largest |b|, the worst channel; infinite when identical
  bool identical = false;  // bit for bit
};
/// Compares a with the reference b over the channels of `layer`. Throws Error(kMismatch) when windows differ
/// or a channel is missing in one of them, naming both.
ImageDifference compare_images(const Image& a, const Image& b, const std::string& layer);
/// Names of the layers of an image: "" first if it has R, G, B or any other channel without a dot.
std::vector<std::string> layer_names(const Image& image);

}  // namespace nacre
