#include "fuzz/targets.h"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <vector>

#include "cache/section_file.h"
#include "geometry/serialized_bytes.h"
#include "nacre/cache/cache_file.h"
#include "nacre/cache/exitance_file.h"
#include "nacre/cache/point_cloud.h"
#include "nacre/geometry/mesh_file.h"
#include "nacre/geometry/serialized_file.h"
#include "nacre/render/image_file.h"
#include "nacre/scene/bitmap.h"
#include "nacre/scene/scene_file.h"
#include "sweep_plan.h"

namespace nacre::testing_support {
namespace {

void read_mesh(const std::string& path) {
  Warnings warnings;
  load_mesh(path, warnings);
}

std::string read_bytes(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}
void write_bytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

// Gives a cache or a file of exitance the size and the checksums of what is in it, so that readers look at
// the rest as well.
void seal(const std::string& path) {
  std::string bytes = read_bytes(path);
  layout::Header header;
  if (bytes.size() < sizeof header + sizeof(layout::SectionEntry)) return;
  std::memcpy(&header, bytes.data(), sizeof header);
  std::vector<layout::SectionEntry> table(std::clamp<std::size_t>(
      header.section_count, 1, (bytes.size() - sizeof header) / sizeof(layout::SectionEntry)));
  const std::size_t table_bytes = table.size() * sizeof table[0];
  std::memcpy(table.data(), bytes.data() + sizeof header, table_bytes);
  for (layout::SectionEntry& entry : table)
    if (entry.offset <= bytes.size() && entry.size <= bytes.size() - entry.offset)
      entry.checksum = XXH3_64bits(bytes.data() + entry.offset, entry.size);
  header.file_size = bytes.size();
  header.table_checksum = XXH3_64bits(table.data(), table_bytes);
  header.header_checksum = XXH3_64bits(&header, offsetof(layout::Header, header_checksum));
  std::memcpy(bytes.data(), &header, sizeof header);
  std::memcpy(bytes.data() + sizeof header, table.data(), table_bytes);
  write_bytes(path, bytes);
}

// Takes what a file has for a mesh before it was compressed, since no chance would find bytes that inflate.
// Its first byte says which version.
void deflate(const std::string& path) {
  const std::string bytes = read_bytes(path);
  if (!bytes.empty())
    write_bytes(path, file_of_streams({deflate_bytes(bytes.substr(1))}, bytes[0] % 2 ? 3 : 4));
}

constexpr std::array kTargets{
    FuzzTarget{"scene", ".xml", [](const std::string& path) { load_scene(path); }},
    FuzzTarget{"obj", ".obj", read_mesh},
    FuzzTarget{"ply", ".ply", read_mesh},
    FuzzTarget{"stl", ".stl", read_mesh},
    FuzzTarget{"off", ".off", read_mesh},
    FuzzTarget{"serialized", ".serialized",
               [](const std::string& path) {
                 deflate(path);
                 Warnings warnings;
                 load_serialized_mesh(path, 0, warnings);
               }},
    FuzzTarget{"cache", ".nacre",
               [](const std::string& path) {
                 seal(path);
                 load_cache(path);
               }},
    FuzzTarget{"exitance", ".exitance",
               [](const std::string& path) {
                 seal(path);
                 load_exitance(path);
               }},
    FuzzTarget{"cloud", ".ply", [](const std::string& path) { import_cloud(path); }},
    FuzzTarget{"image", ".exr", [](const std::string& path) { load_exr(path); }},
    FuzzTarget{"bitmap", ".hdr", [](const std::string& path) { load_bitmap(path, path); }},
    FuzzTarget{"plan_csv", ".csv", [](const std::string& path) { tools::load_plan(path); }},
    FuzzTarget{"plan_json", ".json", [](const std::string& path) { tools::load_plan(path); }},
};

}  // namespace

std::span<const FuzzTarget> fuzz_targets() { return kTargets; }

}  // namespace nacre::testing_support
