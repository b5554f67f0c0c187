// A small cache with known content, and its file as bytes that can be broken on purpose.
#pragma once

#include <xxhash.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "cache/cache_layout.h"
#include "cache/sample_sets.h"
#include "nacre/cache/cache_file.h"

namespace nacre::testing_support {

using Bytes = std::vector<unsigned char>;

inline Bytes read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}
inline void write_bytes(const std::string& path, const Bytes& bytes) {
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

/// The cache of tests/golden/cache/good-v1.nacre: a root with two leaves of samples, one lone sample, no
/// sample.
inline Cache make_golden_cache() {
  Cache cache;
  SurfaceSamples wax;
  for (int i = 0; i < 12; ++i) {
    const auto x = static_cast<float>(i);
    wax.positions.push_back({x, 0.5f, i < 6 ? 0.0f : 0.25f});
    wax.normals.push_back({0, 0, 1});
    wax.areas.push_back(0.125f);
    wax.irradiance.push_back({1, 0.5f * x, 0});
  }
  SurfaceSamples milk;
  milk.positions = {{-1, -2, -3}};
  milk.normals = {{0, -1, 0}};
  milk.areas = {2};
  milk.irradiance = {{0.5f, 0.25f, 4}};
  std::vector<std::shared_ptr<const void>> storage;
  cache.groups = {build_group("wax", 1.5, wax, storage), build_group("milk", 2, milk, storage),
                  build_group("medium 3", 0, {}, storage)};
  cache.fingerprint = {{"shadows", "yes"}, {"medium wax/eta", "1.5"}, {"light key/position", "0 1 2.5"}};
  cache.info = {{"nacre", "0.1.0"}, {"seed", "7"}, {"group wax/material", ""}};
  cache.storage = std::make_shared<const std::vector<std::shared_ptr<const void>>>(std::move(storage));
  return cache;
}

/// The cache of tests/golden/cache/good-v2.nacre: the same with two lights, their errors, and ratios that are
/// their own places.
inline Cache make_golden_cache_2() {
  SurfaceSamples wax;
  for (int i = 0; i < 2; ++i) {
    SampleLight& light = wax.lights.emplace_back();
    light.name = i == 0 ? "key" : "rim";
    for (int s = 0; s < 3; ++s) {
      const auto x = static_cast<float>(s);
      light.irradiance.push_back({x, 1, static_cast<float>(i)});
      light.errors.push_back(0.25f * x);
      EtaRatios& ratios = light.ratios.emplace_back();
      for (std::size_t j = 0; j < ratios.size(); ++j)
        ratios[j] = static_cast<std::uint16_t>(100 * i + 1000 * s + static_cast<int>(j));
    }
  }
  for (int s = 0; s < 3; ++s) {
    wax.positions.push_back({static_cast<float>(s), 0, 0});
    wax.normals.push_back({0, 0, 1});
    wax.areas.push_back(0.5f);
    wax.irradiance.push_back(wax.lights[0].irradiance[static_cast<std::size_t>(s)] +
                             wax.lights[1].irradiance[static_cast<std::size_t>(s)]);
  }
  SurfaceSamples milk;
  milk.positions = {{-1, -2, -3}};
  milk.normals = {{0, -1, 0}};
  milk.areas = {2};
  milk.irradiance = {{0.5f, 0.25f, 4}};
  milk.lights.emplace_back();
  Cache cache;
  std::vector<std::shared_ptr<const void>> storage;
  cache.groups = {build_group("wax", 1.5, wax, storage), build_group("milk", 2, milk, storage)};
  cache.groups[0].eta = 1.5;
  cache.groups[1].eta = 1.25;
  cache.fingerprint = {{"shadows", "no"}};
  cache.storage = std::make_shared<const std::vector<std::shared_ptr<const void>>>(std::move(storage));
  return cache;
}

inline layout::SectionEntry entry_at(const Bytes& bytes, std::size_t i) {
  layout::SectionEntry entry;
  std::memcpy(&entry, bytes.data() + sizeof(layout::Header) + i * sizeof entry, sizeof entry);
  return entry;
}
inline std::size_t count_sections(const Bytes& bytes) {
  layout::Header header;
  std::memcpy(&header, bytes.data(), sizeof header);
  return header.section_count;
}
inline std::size_t find_section(const Bytes& bytes, const char* kind, std::uint32_t group) {
  for (std::size_t i = 0; i < count_sections(bytes); ++i) {
    const auto entry = entry_at(bytes, i);
    if (std::memcmp(entry.kind.data(), kind, 4) == 0 && entry.group == group) return i;
  }
  throw std::out_of_range(kind);
}

template <class T>
void put(Bytes& bytes, std::size_t at, const T& value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
}

/// Makes every checksum right again, whatever was changed.
inline void seal(Bytes& bytes) {
  const std::size_t table = sizeof(layout::Header);
  const std::size_t count = count_sections(bytes);
  if (table + count * sizeof(layout::SectionEntry) <= bytes.size()) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto entry = entry_at(bytes, i);
      if (entry.offset <= bytes.size() && entry.size <= bytes.size() - entry.offset)
        put(bytes, table + i * sizeof entry + offsetof(layout::SectionEntry, checksum),
            XXH3_64bits(bytes.data() + entry.offset, entry.size));
    }
    put(bytes, offsetof(layout::Header, table_checksum),
        XXH3_64bits(bytes.data() + table, count * sizeof(layout::SectionEntry)));
  }
  put(bytes, offsetof(layout::Header, header_checksum),
      XXH3_64bits(bytes.data(), offsetof(layout::Header, header_checksum)));
}

}  // namespace nacre::testing_support
