// A cache from a point cloud.
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <functional>
#include <optional>

#include "cache/cloud_columns.h"
#include "geometry/ply_header.h"
#include "nacre/base/file.h"
#include "nacre/base/parallel.h"
#include "nacre/cache/octree.h"
#include "nacre/cache/point_cloud.h"

namespace nacre {
namespace {

constexpr std::size_t kMostBytes = std::size_t{1} << 36;
constexpr double kMostValue = 1e15;      // of any number; squares of distances stay floats
constexpr double kMostAreaRatio = 2;     // between the areas of samples and the surface
constexpr double kMostRepeated = 0.1;    // share of points at the place of another
constexpr float kShortestNormal = 0.5f;  // no bake makes any but unit ones

std::string unescape(std::string_view line) {
  std::string text;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] != '\\' || i + 1 == line.size()) {
      text += line[i];
      continue;
    }
    const char c = line[++i];
    text += c == 'n' ? '\n' : c == 'r' ? '\r' : c == 't' ? '\t' : c;
  }
  return text;
}

// What the comments say: a cache without samples. Empty if there are none of nacre's.
Cache parse_comments(const std::vector<std::string>& comments, const std::string& path) {
  Cache cache;
  for (const std::string& comment : comments) {
    std::string_view rest = comment;
    if (rest.ends_with('\r')) rest.remove_suffix(1);
    const std::string mark = std::string(" ") + kCloudMark + " ";
    if (!rest.starts_with(mark)) continue;
    rest.remove_prefix(mark.size());
    const std::size_t first = rest.find('\t'), second = rest.find('\t', first + 1);
    if (first == std::string_view::npos || second == std::string_view::npos)
      fail(ErrorCode::kSyntax, path, "the comment {} was changed; export the cache again, or give --like",
           quote_word(comment));
    const std::string_view what = rest.substr(0, first);
    const std::string key = unescape(rest.substr(first + 1, second - first - 1)),
                      value = unescape(rest.substr(second + 1));
    if (what == kCloudFingerprint) cache.fingerprint.emplace_back(key, value);
    if (what == kCloudInfo) cache.info.emplace_back(key, value);
    if (what != kCloudGroup) continue;
    CacheGroup& group = cache.groups.emplace_back();
    group.name = key;
    // The area and, of caches that know it, the index of refraction that the irradiance is for.
    const std::size_t space = std::min(value.find(' '), value.size());
    const auto read = [&](std::size_t begin, std::size_t finish, double& number) {
      const auto [end, error] = std::from_chars(value.data() + begin, value.data() + finish, number);
      return error == std::errc() && end == value.data() + finish && number >= 0 && std::isfinite(number);
    };
    if (!read(0, space, group.surface_area) ||
        (space < value.size() && !read(space + 1, value.size(), group.eta)))
      fail(ErrorCode::kSyntax, path, "the area of the group {} is {}, no number of 0 or more",
           quote_word(key), quote_word(value));
  }
  return cache;
}

// The values of one vertex after the other, whatever their types.
class VertexReader {
 public:
  VertexReader(const std::string& path, const PlyHeader& header, const PlyElement& vertex,
               const std::string& content, std::size_t body, LineReader& lines)
      : path_(path), header_(header), vertex_(vertex), content_(content), at_(body), lines_(lines) {}

  void read(std::vector<double>& values) {
    values.clear();
    if (!header_.binary) {
      lines_.require_next("a vertex");
      std::string_view line = lines_.line();
      for (std::size_t p = 0; p < vertex_.properties.size(); ++p)
        values.push_back(lines_.take_number(line, "a vertex"));
      if (line.find_first_not_of(kBlanks) != std::string_view::npos)
        lines_.fail_here(ErrorCode::kSyntax, "a vertex has more numbers than the {} that the header lists",
                         vertex_.properties.size());
      return;
    }
    for (const PlyProperty& property : vertex_.properties) values.push_back(take(property.type));
  }

  /// Fails if something follows the last vertex that the header does not speak of.
  void expect_end() {
    for (std::size_t e = 1; e < header_.elements.size(); ++e)
      if (header_.elements[e].count > 0) return;
    const std::string_view rest =
        std::string_view(content_).substr(header_.binary ? at_ : lines_.next_begin());
    if (header_.binary ? !rest.empty() : rest.find_first_not_of(kBlanks) != std::string_view::npos)
      fail(ErrorCode::kValue, path_,
           "{} bytes follow the last of the {} points of the header; export it again", rest.size(),
           vertex_.count);
  }

 private:
  static constexpr const char* kBlanks = " \t\r\n\v\f";

  double take(const PlyType& type) {
    std::array<char, 8> bytes{};
    std::memcpy(bytes.data(), content_.data() + at_, type.bytes);  // the header's promise was checked
    at_ += type.bytes;
    if (header_.big_endian) std::reverse(bytes.begin(), bytes.begin() + static_cast<long>(type.bytes));
    std::uint64_t bits = 0;
    std::memcpy(&bits, bytes.data(), sizeof bits);
    if (!type.is_float) {
      const int unused = 64 - 8 * static_cast<int>(type.bytes);  // shifted out, the sign in
      return type.is_signed ? static_cast<double>(static_cast<std::int64_t>(bits << unused) >> unused)
                            : static_cast<double>(bits);
    }
    return type.bytes == 4 ? double{std::bit_cast<float>(static_cast<std::uint32_t>(bits))}
                           : std::bit_cast<double>(bits);
  }

  const std::string& path_;
  const PlyHeader& header_;
  const PlyElement& vertex_;
  const std::string& content_;
  std::size_t at_;
  LineReader& lines_;
};

// Where each column is among the properties; the last is the group's, if there is one.
std::array<std::optional<std::size_t>, kPlaneCount + 1> find_columns(const PlyElement& vertex,
                                                                     const std::string& path) {
  std::array<std::optional<std::size_t>, kPlaneCount + 1> columns;
  for (std::size_t p = 0; p < vertex.properties.size(); ++p) {
    if (vertex.properties[p].list)
      fail(ErrorCode::kUnsupported, path, "cannot read the list {} of the vertices; save the file without it",
           quote_word(vertex.properties[p].name));
    for (std::size_t c = 0; c <= kPlaneCount; ++c)
      if (vertex.properties[p].name == (c < kPlaneCount ? kCloudColumns[c] : kGroupColumn)) columns[c] = p;
  }
  for (std::size_t c = 0; c < kPlaneCount; ++c)
    if (!columns[c])
      fail(ErrorCode::kUnsupported, path,
           "the vertices have no property {}; it takes x y z nx ny nz area er eg eb", kCloudColumns[c]);
  return columns;
}

void check_value(double value, Plane plane, std::uint64_t index, const std::string& path) {
  const char* const name = kCloudColumns[static_cast<std::size_t>(plane)];
  if (!std::isfinite(value))
    fail(ErrorCode::kValue, path, "{} of point {} is not a finite number", name, index);
  if (std::abs(value) > kMostValue)
    fail(ErrorCode::kValue, path, "{} of point {} is {:g}, more than {:g}", name, index, value, kMostValue);
  if (plane >= Plane::kArea && value < 0)
    fail(ErrorCode::kValue, path, "{} of point {} is {:g}; it has to be 0 or more", name, index, value);
}

// Fails if the samples of a group cannot be those of its surface.
void check_group(const SurfaceSamples& samples, const CacheGroup& group, const std::string& path) {
  double area = 0;
  for (const float a : samples.areas) area += double{a};
  if (area > kMostAreaRatio * group.surface_area || kMostAreaRatio * area < group.surface_area)
    fail(ErrorCode::kValue, path,
         "the areas of group {} add up to {:g}, and its surface has {:g}; scale them by the same factor as "
         "the "
         "points, squared, or leave both as they were",
         quote_word(group.name), area, group.surface_area);
  std::vector<std::array<float, 3>> positions;
  for (const Vec3& p : samples.positions) positions.push_back({p.x, p.y, p.z});
  parallel_sort(positions.begin(), positions.end(), std::less<>());
  std::size_t repeated = 0;
  for (std::size_t i = 1; i < positions.size(); ++i) repeated += positions[i] == positions[i - 1];
  if (static_cast<double>(repeated) > kMostRepeated * static_cast<double>(positions.size()))
    fail(ErrorCode::kValue, path, "{} of the {} points of group {} lie where others are; remove duplicates",
         repeated, positions.size(), quote_word(group.name));
}

}  // namespace

Cache import_cloud(const std::string& path, const Cache* like) {
  std::string content = read_text_file(path, kMostBytes);
  LineReader lines(content, path);
  const PlyHeader header = parse_ply_header(lines);
  const std::size_t body = lines.next_begin();
  if (header.elements.empty() || header.elements[0].name != "vertex")
    fail(ErrorCode::kUnsupported, path, "the file does not begin with an element vertex; save it as points");
  const PlyElement& vertex = header.elements[0];
  const auto columns = find_columns(vertex, path);
  if (vertex.count == 0) fail(ErrorCode::kValue, path, "it holds no points; export the cache again");
  const std::uint64_t bytes = smallest_size(vertex, header.binary) * vertex.count;
  if (bytes > content.size() - body + 1 - header.binary)
    fail(ErrorCode::kTruncated, path, "the header promises {} points, at least {} bytes, but {} follow",
         vertex.count, bytes, content.size() - body);

  Cache cache = parse_comments(header.comments, path);
  if (like) {
    cache = {like->fingerprint, like->info, {}, nullptr};
    for (const CacheGroup& group : like->groups) {
      CacheGroup& own = cache.groups.emplace_back();
      own.name = group.name;
      own.surface_area = group.surface_area;
      own.eta = group.eta;
    }
  } else if (cache.fingerprint.empty() || cache.groups.empty()) {
    fail(ErrorCode::kUnsupported, path,
         "it does not say what it was baked from, as some programs drop the comments that do: name the cache "
         "that it was exported from with --like");
  }
  std::vector<SurfaceSamples> samples(cache.groups.size());
  VertexReader reader(path, header, vertex, content, body, lines);
  std::vector<double> values;
  for (std::uint64_t i = 0; i < vertex.count; ++i) {
    reader.read(values);
    std::array<float, kPlaneCount> v;
    for (std::size_t c = 0; c < kPlaneCount; ++c) {
      check_value(values[*columns[c]], static_cast<Plane>(c), i, path);
      v[c] = static_cast<float>(values[*columns[c]]);
    }
    for (std::size_t e = 7; e < kPlaneCount; ++e)
      if (!std::isfinite(v[e] * v[6]))
        fail(ErrorCode::kValue, path, "{} times the area of point {} is not finite", kCloudColumns[e], i);
    if (!(Vec3(v[3], v[4], v[5]).length() >= kShortestNormal))
      fail(ErrorCode::kValue, path, "the normal of point {} is {:g} {:g} {:g}, which is no unit vector", i,
           v[3], v[4], v[5]);
    const double group = columns[kPlaneCount] ? values[*columns[kPlaneCount]] : 0;
    if (!(group >= 0 && group < static_cast<double>(samples.size()) && group == std::floor(group)))
      fail(ErrorCode::kValue, path, "point {} is of group {:g}; there are {}", i, group, samples.size());
    SurfaceSamples& into = samples[static_cast<std::size_t>(group)];
    into.positions.emplace_back(v[0], v[1], v[2]);
    into.normals.emplace_back(v[3], v[4], v[5]);
    into.areas.push_back(v[6]);
    into.irradiance.emplace_back(v[7], v[8], v[9]);
  }
  reader.expect_end();
  for (std::size_t g = 0; g < samples.size(); ++g) check_group(samples[g], cache.groups[g], path);
  std::vector<std::shared_ptr<const void>> storage;
  for (std::size_t g = 0; g < samples.size(); ++g) {
    const double eta = cache.groups[g].eta;
    cache.groups[g] = build_group(cache.groups[g].name, cache.groups[g].surface_area, samples[g], storage);
    cache.groups[g].eta = eta;
  }
  cache.storage = std::make_shared<const std::vector<std::shared_ptr<const void>>>(std::move(storage));
  return cache;
}

}  // namespace nacre
