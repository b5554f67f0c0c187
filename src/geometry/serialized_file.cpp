// Reader of .serialized files: dictionary of offsets, then one zlib stream for each mesh.
#include "nacre/geometry/serialized_file.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "geometry/raw_mesh.h"

namespace nacre {
namespace {

static_assert(std::endian::native == std::endian::little, "the files are little-endian and read as they are");

constexpr std::uint16_t kMagic = 0x041C;
constexpr std::uint64_t kHeaderBytes = 4;  // magic and version, before each stream
constexpr std::uint64_t kMaxBytes = std::uint64_t{1} << 33;
constexpr std::uint64_t kMaxExpansion = 1032;  // of deflate: 258 bytes for two bits
constexpr std::size_t kMaxNameBytes = 1 << 16;
constexpr std::size_t kPieceElements = 1 << 16;  // what memory may grow by before the data is there

enum Flag : std::uint32_t {
  kHasNormals = 0x0001,
  kHasTexcoords = 0x0002,
  kHasColors = 0x0008,
  kFaceNormals = 0x0010,
  kDoublePrecision = 0x2000,
};

// Bytes at any place of a file.
class FileBytes {
 public:
  explicit FileBytes(const std::string& path) : path_(path) {
    std::error_code error;
    const std::filesystem::file_status status = std::filesystem::status(path, error);
    if (status.type() == std::filesystem::file_type::not_found)
      fail(ErrorCode::kNotFound, path, "cannot read: {}", std::strerror(ENOENT));
    if (!error && status.type() != std::filesystem::file_type::regular)
      fail(ErrorCode::kIo, path, "cannot read: not a file");
    if (!error) size_ = std::filesystem::file_size(path, error);
    stream_.open(path, std::ios::binary);
    if (error || !stream_)
      fail(ErrorCode::kIo, path, "cannot read: {}", error ? error.message() : std::strerror(errno));
  }
  const std::string& path() const { return path_; }
  std::uint64_t size() const { return size_; }

  void read(std::uint64_t offset, void* data, std::size_t bytes) {
    stream_.clear();
    stream_.seekg(static_cast<std::streamoff>(offset));
    stream_.read(static_cast<char*>(data), static_cast<std::streamsize>(bytes));
    if (!stream_) fail(ErrorCode::kIo, path_, "cannot read at byte {}", offset);
  }
  template <class T>
  T read(std::uint64_t offset) {
    T value;
    read(offset, &value, sizeof value);
    return value;
  }

 private:
  std::string path_;
  std::ifstream stream_;
  std::uint64_t size_ = 0;
};

// The bytes that a stretch of a file expands to.
class Inflater {
 public:
  Inflater(FileBytes& file, std::uint64_t begin, std::uint64_t end)
      : file_(file), at_(begin), end_(end), input_(std::size_t{1} << 16) {
    if (inflateInit(&stream_) != Z_OK) fail(ErrorCode::kLimit, file.path(), "zlib found no memory");
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  void read(void* data, std::size_t bytes) {
    auto* target = static_cast<unsigned char*>(data);
    while (bytes > 0) {
      if (ended_) fail(ErrorCode::kSyntax, file_.path(), "a mesh is shorter than it says");
      const std::size_t piece = std::min<std::size_t>(bytes, 1 << 30);
      const std::size_t got = inflate_some(target, piece);
      target += got;
      bytes -= got;
    }
  }
  template <class T>
  T read() {
    T value;
    read(&value, sizeof value);
    return value;
  }

  // What follows the last number is the end and its checksum.
  void finish() {
    unsigned char rest;
    while (!ended_)
      if (inflate_some(&rest, 1) > 0) fail(ErrorCode::kSyntax, file_.path(), "a mesh is longer than it says");
  }

 private:
  std::size_t inflate_some(unsigned char* target, std::size_t bytes) {
    if (stream_.avail_in == 0) {
      const std::size_t piece = std::min<std::uint64_t>(input_.size(), end_ - at_);
      if (piece == 0) fail(ErrorCode::kSyntax, file_.path(), "ends in the middle of a mesh: truncated");
      file_.read(at_, input_.data(), piece);
      at_ += piece;
      stream_.next_in = input_.data();
      stream_.avail_in = static_cast<uInt>(piece);
    }
    stream_.next_out = target;
    stream_.avail_out = static_cast<uInt>(bytes);
    const int result = inflate(&stream_, Z_NO_FLUSH);
    if (result == Z_MEM_ERROR) fail(ErrorCode::kLimit, file_.path(), "zlib found no memory");
    if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR)
      fail(ErrorCode::kSyntax, file_.path(), "the compressed data of a mesh are damaged");
    ended_ = result == Z_STREAM_END;
    return bytes - stream_.avail_out;
  }

  FileBytes& file_;
  std::uint64_t at_, end_;
  std::vector<unsigned char> input_;
  z_stream stream_{};
  bool ended_ = false;
};

std::uint16_t read_version(FileBytes& file, std::uint64_t offset) {
  if (file.read<std::uint16_t>(offset) != kMagic)
    fail(ErrorCode::kSyntax, file.path(), "byte {}: no mesh of Mitsuba begins there", offset);
  const auto version = file.read<std::uint16_t>(offset + 2);
  if (version != 3 && version != 4)
    fail(ErrorCode::kUnsupported, file.path(), "has version {}; 3 and 4 are read", version);
  return version;
}

struct Stretch {
  std::uint64_t begin, end;
};

// Where a mesh is, header included, by the dictionary at the end of the file. It ends there at the latest.
Stretch find_mesh(FileBytes& file, std::uint32_t index) {
  if (file.size() < 2 * kHeaderBytes) fail(ErrorCode::kSyntax, file.path(), "is too short: truncated");
  const std::uint64_t entry_bytes = read_version(file, 0) == 4 ? 8 : 4;
  const auto count = file.read<std::uint32_t>(file.size() - 4);
  const std::uint64_t dictionary_bytes = count * entry_bytes + 4;
  if (count == 0 || dictionary_bytes + kHeaderBytes > file.size())
    fail(ErrorCode::kSyntax, file.path(), "ends with a count of {} meshes, for which it is {}: truncated",
         count, count == 0 ? "too long" : "too short");
  if (index >= count)
    fail(ErrorCode::kValue, file.path(), "has no mesh of shapeIndex {}: there are {}, counted from 0", index,
         count);
  const std::uint64_t dictionary = file.size() - dictionary_bytes;
  const std::uint64_t entry = dictionary + index * entry_bytes;
  const std::uint64_t offset =
      entry_bytes == 8 ? file.read<std::uint64_t>(entry) : file.read<std::uint32_t>(entry);
  if (offset > dictionary - kHeaderBytes)
    fail(ErrorCode::kSyntax, file.path(), "says that mesh {} begins at byte {}, behind all meshes", index,
         offset);
  return {offset, dictionary};
}

// Numbers of the file's precision in single precision, N to an element.
template <class Element>
std::vector<Element> read_elements(Inflater& data, std::uint64_t count, bool doubles) {
  constexpr std::size_t kNumbers = sizeof(Element) / sizeof(float);
  std::vector<Element> elements;
  std::vector<double> wide;
  while (elements.size() < count) {
    const std::size_t first = elements.size();
    const std::size_t piece = std::min<std::uint64_t>(kPieceElements, count - first);
    elements.resize(first + piece);
    if (!doubles) {
      data.read(elements.data() + first, piece * sizeof(Element));
      continue;
    }
    wide.resize(piece * kNumbers);
    data.read(wide.data(), wide.size() * sizeof(double));
    for (std::size_t i = 0; i < wide.size(); ++i)
      elements[first + i / kNumbers][static_cast<int>(i % kNumbers)] = static_cast<float>(wide[i]);
  }
  return elements;
}

void read_triangles(Inflater& data, std::uint64_t count, RawMesh& raw) {
  for (std::uint64_t done = 0; done < count;) {
    const std::size_t piece = std::min<std::uint64_t>(kPieceElements, count - done);
    raw.corners.resize(raw.corners.size() + 3 * piece);
    data.read(raw.corners.data() + 3 * done, 3 * piece * sizeof(std::uint32_t));
    for (std::size_t i = 0; i < piece; ++i) raw.face_ends.push_back(3 * (done + i + 1));
    done += piece;
  }
}

void skip_name(Inflater& data, const std::string& path) {
  for (std::size_t i = 0; i < kMaxNameBytes; ++i)
    if (data.read<char>() == 0) return;
  fail(ErrorCode::kSyntax, path, "the name of a mesh has no end");
}

// Refuses what the compressed bytes cannot hold before any of it is read.
void check_counts(std::uint64_t vertices, std::uint64_t triangles, std::uint32_t flags,
                  std::uint64_t compressed_bytes, const std::string& path) {
  std::uint64_t numbers = 3;
  if (flags & kHasNormals) numbers += 3;
  if (flags & kHasTexcoords) numbers += 2;
  if (flags & kHasColors) numbers += 3;
  const std::uint64_t vertex_bytes = numbers * (flags & kDoublePrecision ? 8 : 4), triangle_bytes = 12;
  // Divided, as the products may overflow.
  const std::uint64_t possible =
      compressed_bytes > kMaxBytes ? ~std::uint64_t{0} : compressed_bytes * kMaxExpansion;
  for (const std::uint64_t limit : {possible, kMaxBytes}) {
    const bool fits =
        vertices <= limit / vertex_bytes && triangles <= (limit - vertices * vertex_bytes) / triangle_bytes;
    if (!fits)
      fail(limit == kMaxBytes ? ErrorCode::kLimit : ErrorCode::kSyntax, path,
           "a mesh claims {} vertices and {} triangles, {}", vertices, triangles,
           limit == kMaxBytes ? "more than 8 GB" : "more than the file can hold");
  }
}

}  // namespace

SerializedMesh load_serialized_mesh(const std::string& path, std::uint32_t index, Warnings& warnings) {
  FileBytes file(path);
  const Stretch stretch = find_mesh(file, index);
  const std::uint16_t version = read_version(file, stretch.begin);
  const std::uint64_t begin = stretch.begin + kHeaderBytes;
  Inflater data(file, begin, stretch.end);
  const auto flags = data.read<std::uint32_t>();
  if (version == 4) skip_name(data, path);
  const auto vertices = data.read<std::uint64_t>(), triangles = data.read<std::uint64_t>();
  check_counts(vertices, triangles, flags, stretch.end - begin, path);

  const bool doubles = flags & kDoublePrecision;
  RawMesh raw;
  raw.positions = read_elements<Vec3>(data, vertices, doubles);
  if (flags & kHasNormals) raw.normals = read_elements<Vec3>(data, vertices, doubles);
  if (flags & kHasTexcoords) raw.uvs = read_elements<Vec2>(data, vertices, doubles);
  if (flags & kHasColors) read_elements<Vec3>(data, vertices, doubles);
  read_triangles(data, triangles, raw);
  data.finish();
  const bool face_normals = flags & kFaceNormals;
  if (face_normals) raw.normals.clear();
  return {assemble_mesh(std::move(raw), 0, path, warnings), face_normals};
}

}  // namespace nacre
