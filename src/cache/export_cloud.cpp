// A cache as a point cloud.
#include <algorithm>
#include <cctype>
#include <string_view>

#include "cache/cloud_columns.h"
#include "nacre/base/file.h"
#include "nacre/cache/point_cloud.h"

namespace nacre {
namespace {

// Bytes that are written at once.
constexpr std::size_t kPiece = std::size_t{1} << 20;

// One line of a PLY header, whatever is in it.
std::string escape(const std::string& text) {
  std::string line;
  for (const char c : text)
    if (c == '\\')
      line += "\\\\";
    else if (c == '\n')
      line += "\\n";
    else if (c == '\r')
      line += "\\r";
    else if (c == '\t')
      line += "\\t";
    else
      line += c;
  return line;
}

std::string make_header(const Cache& cache) {
  std::string text = "ply\nformat binary_little_endian 1.0\n";
  const auto comment = [&](const char* what, const std::string& key, const std::string& value) {
    text += fmt::format("comment {} {}\t{}\t{}\n", kCloudMark, what, escape(key), escape(value));
  };
  for (const auto& [key, value] : cache.fingerprint) comment(kCloudFingerprint, key, value);
  for (const auto& [key, value] : cache.info) comment(kCloudInfo, key, value);
  for (const CacheGroup& group : cache.groups)
    comment(kCloudGroup, group.name,
            group.eta > 0 ? fmt::format("{} {}", group.surface_area, group.eta)
                          : fmt::format("{}", group.surface_area));
  text += fmt::format("element vertex {}\n", cache.sample_count());
  for (const char* column : kCloudColumns) text += fmt::format("property float {}\n", column);
  return text + fmt::format("property int {}\nend_header\n", kGroupColumn);
}

template <class Append>
void write_samples(const Cache& cache, AtomicFile& file, std::string text, const Append& append) {
  for (std::size_t g = 0; g < cache.groups.size(); ++g)
    for (std::size_t i = 0; i < cache.groups[g].size(); ++i) {
      append(text, cache.groups[g], i, static_cast<std::int32_t>(g));
      if (text.size() < kPiece) continue;
      file.write(text.data(), text.size());
      text.clear();
    }
  file.write(text.data(), text.size());
  file.commit();
}

void append_bytes(std::string& text, const CacheGroup& group, std::size_t i, std::int32_t index) {
  for (const auto& plane : group.planes) text.append(reinterpret_cast<const char*>(&plane[i]), sizeof(float));
  text.append(reinterpret_cast<const char*>(&index), sizeof index);
}

void append_line(std::string& text, const CacheGroup& group, std::size_t i, std::int32_t index) {
  for (const auto& plane : group.planes) fmt::format_to(std::back_inserter(text), "{},", plane[i]);
  fmt::format_to(std::back_inserter(text), "{}\n", index);
}

}  // namespace

void export_cloud(const Cache& cache, const std::string& path) {
  const auto ends_with = [&](std::string_view ending) {
    return path.size() >= ending.size() &&
           std::ranges::equal(ending, path.substr(path.size() - ending.size()), {}, {},
                              [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  };
  const bool ply = ends_with(".ply");
  if (!ply && !ends_with(".csv"))
    fail(ErrorCode::kUnsupported, path, "point clouds are written as .ply or .csv; end its name so");
  AtomicFile file(path);
  if (ply) return write_samples(cache, file, make_header(cache), append_bytes);
  std::string header;
  for (const char* column : kCloudColumns) header += std::string(column) + ",";
  write_samples(cache, file, header + kGroupColumn + "\n", append_line);
}

}  // namespace nacre
