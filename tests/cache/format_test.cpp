// label: golden
// A second reader, written from src/cache/FORMAT.md alone: it knows none of nacre's headers.
#include <gtest/gtest.h>
#include <xxhash.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace {

using Texts = std::vector<std::pair<std::string, std::string>>;

struct Node {
  float centre[3], radius, power[3], second_moment[3], first_moment[3];
  std::uint32_t first_child, first_sample, counts;
};

struct Group {
  std::string name;
  double area = 0;
  std::vector<float> planes[10];
  std::vector<Node> nodes;
  // Since version 2.
  double eta = 0;
  std::vector<std::string> lights;
  std::vector<float> light_irradiance, errors;
  std::vector<std::uint32_t> ratios;
};

struct File {
  Texts fingerprint, info;
  std::vector<Group> groups;
};

// Bytes are put together one by one, as on a machine of the other byte order.
std::uint64_t read_integer(const std::vector<unsigned char>& bytes, std::uint64_t at, int size) {
  std::uint64_t value = 0;
  for (int i = size; i-- > 0;) value = value << 8 | bytes.at(at + static_cast<std::uint64_t>(i));
  return value;
}
std::uint32_t read_u32(const std::vector<unsigned char>& bytes, std::uint64_t at) {
  return static_cast<std::uint32_t>(read_integer(bytes, at, 4));
}
float read_f32(const std::vector<unsigned char>& bytes, std::uint64_t at) {
  const std::uint32_t bits = read_u32(bytes, at);
  float value;
  std::memcpy(&value, &bits, 4);
  return value;
}

struct Section {
  std::string kind;
  std::uint64_t group, offset, size;
};

Texts read_texts(const std::vector<unsigned char>& bytes, const Section& section) {
  Texts texts;
  std::uint64_t at = section.offset;
  const auto read_text = [&] {
    const std::uint32_t length = read_u32(bytes, at);
    const std::string text(reinterpret_cast<const char*>(&bytes.at(at + 4)), length);
    at += 4 + length;
    return text;
  };
  const std::uint32_t count = read_u32(bytes, at);
  at += 4;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::string key = read_text();
    texts.emplace_back(key, read_text());
  }
  EXPECT_EQ(at, section.offset + section.size);
  return texts;
}

Node read_node(const std::vector<unsigned char>& bytes, std::uint64_t at) {
  Node node;
  for (int k = 0; k < 3; ++k) {
    const auto step = 4 * static_cast<std::uint64_t>(k);
    node.centre[k] = read_f32(bytes, at + step);
    node.power[k] = read_f32(bytes, at + 16 + step);
    node.second_moment[k] = read_f32(bytes, at + 28 + step);
    node.first_moment[k] = read_f32(bytes, at + 40 + step);
  }
  node.radius = read_f32(bytes, at + 12);
  node.first_child = read_u32(bytes, at + 52);
  node.first_sample = read_u32(bytes, at + 56);
  node.counts = read_u32(bytes, at + 60);
  return node;
}

std::uint64_t align(std::uint64_t n) { return (n + 63) / 64 * 64; }

void read_file(const std::string& path, File& result) {
  std::FILE* stream = std::fopen(path.c_str(), "rb");
  ASSERT_NE(stream, nullptr) << path;
  std::vector<unsigned char> bytes(1 << 20);
  bytes.resize(std::fread(bytes.data(), 1, bytes.size(), stream));
  std::fclose(stream);

  ASSERT_GE(bytes.size(), 64u);
  const unsigned char magic[8] = {0x89, 0x4e, 0x41, 0x43, 0x52, 0x45, 0x0d, 0x0a};
  ASSERT_EQ(std::memcmp(bytes.data(), magic, 8), 0);
  ASSERT_EQ(read_integer(bytes, 56, 8), XXH3_64bits(bytes.data(), 56));
  const std::uint32_t version = read_u32(bytes, 8);
  ASSERT_TRUE(version == 1 || version == 2);
  const std::uint32_t per_group = version == 1 ? 12 : 15;
  ASSERT_EQ(read_u32(bytes, 12), 0x0a0b0c0du);
  ASSERT_EQ(read_integer(bytes, 16, 8), bytes.size());
  const std::uint32_t section_count = read_u32(bytes, 24), group_count = read_u32(bytes, 28);
  ASSERT_EQ(section_count, 2 + per_group * group_count);
  ASSERT_EQ(read_integer(bytes, 32, 8), XXH3_64bits(bytes.data() + 64, 32 * section_count));

  const char* planes[] = {"POSX", "POSY", "POSZ", "NRMX", "NRMY", "NRMZ", "AREA", "IRRR", "IRRG", "IRRB"};
  std::vector<std::pair<std::string, std::uint64_t>> order{{"FING", 0}, {"INFO", 0}};
  for (std::uint64_t g = 0; g < group_count; ++g) {
    order.emplace_back("GRUP", g);
    for (const char* plane : planes) order.emplace_back(plane, g);
    order.emplace_back("NODE", g);
    if (version == 1) continue;
    for (const char* kind : {"LITE", "IRRE", "ETAR"}) order.emplace_back(kind, g);
  }
  std::vector<Section> sections;
  std::uint64_t end = 64 + 32 * section_count;
  for (std::uint64_t i = 0; i < section_count; ++i) {
    const std::uint64_t at = 64 + 32 * i;
    const Section section{std::string(reinterpret_cast<const char*>(&bytes[at]), 4), read_u32(bytes, at + 4),
                          read_integer(bytes, at + 8, 8), read_integer(bytes, at + 16, 8)};
    ASSERT_EQ(section.kind, order[i].first);
    ASSERT_EQ(section.group, order[i].second);
    ASSERT_EQ(section.offset, align(end));
    end = section.offset + section.size;
    ASSERT_LE(end, bytes.size());
    ASSERT_EQ(read_integer(bytes, at + 24, 8), XXH3_64bits(bytes.data() + section.offset, section.size));
    sections.push_back(section);
  }
  ASSERT_EQ(align(end), bytes.size());

  result.fingerprint = read_texts(bytes, sections[0]);
  result.info = read_texts(bytes, sections[1]);
  for (std::size_t g = 0; g < group_count; ++g) {
    const Section* of_group = &sections[2 + per_group * g];
    Group group;
    const Texts texts = read_texts(bytes, of_group[0]);
    if (version == 1) {
      ASSERT_EQ(texts.size(), 2u);
    } else {
      ASSERT_GE(texts.size(), 3u);
      ASSERT_EQ(texts[2].first, "eta");
      group.eta = std::stod(texts[2].second);
      for (std::size_t i = 3; i < texts.size(); ++i) {
        ASSERT_EQ(texts[i].first, "light");
        group.lights.push_back(texts[i].second);
      }
      for (std::uint64_t at = 0; at < of_group[12].size; at += 4)
        group.light_irradiance.push_back(read_f32(bytes, of_group[12].offset + at));
      for (std::uint64_t at = 0; at < of_group[13].size; at += 4)
        group.errors.push_back(read_f32(bytes, of_group[13].offset + at));
      for (std::uint64_t at = 0; at < of_group[14].size; at += 2)
        group.ratios.push_back(static_cast<std::uint32_t>(read_integer(bytes, of_group[14].offset + at, 2)));
    }
    ASSERT_EQ(texts[0].first, "name");
    ASSERT_EQ(texts[1].first, "area");
    group.name = texts[0].second;
    group.area = std::stod(texts[1].second);
    for (std::size_t k = 0; k < 10; ++k)
      for (std::uint64_t at = 0; at < of_group[1 + k].size; at += 4)
        group.planes[k].push_back(read_f32(bytes, of_group[1 + k].offset + at));
    for (std::uint64_t at = 0; at < of_group[11].size; at += 64)
      group.nodes.push_back(read_node(bytes, of_group[11].offset + at));
    result.groups.push_back(group);
  }
}

TEST(Format, IsCompleteEnoughForASecondReader) {
  File file;
  read_file(NACRE_SOURCE_DIR "/tests/golden/cache/good-v1.nacre", file);
  if (HasFatalFailure()) return;
  EXPECT_EQ(file.fingerprint,
            (Texts{{"shadows", "yes"}, {"medium wax/eta", "1.5"}, {"light key/position", "0 1 2.5"}}));
  EXPECT_EQ(file.info, (Texts{{"nacre", "0.1.0"}, {"seed", "7"}, {"group wax/material", ""}}));
  ASSERT_EQ(file.groups.size(), 3u);
  EXPECT_EQ(file.groups[0].name, "wax");
  EXPECT_EQ(file.groups[0].area, 1.5);
  for (const auto& plane : file.groups[0].planes) ASSERT_EQ(plane.size(), 12u);
  for (std::size_t i = 0; i < 12; ++i) {
    const auto x = static_cast<float>(i);
    const float expected[10] = {x, 0.5f, i < 6 ? 0.0f : 0.25f, 0, 0, 1, 0.125f, 1, 0.5f * x, 0};
    for (std::size_t k = 0; k < 10; ++k) EXPECT_EQ(file.groups[0].planes[k][i], expected[k]) << i << " " << k;
  }
  EXPECT_EQ(file.groups[1].name, "milk");
  EXPECT_EQ(file.groups[1].planes[9], std::vector<float>{4});
  EXPECT_EQ(file.groups[2].name, "medium 3");
  EXPECT_TRUE(file.groups[2].planes[0].empty());
  EXPECT_TRUE(file.groups[2].nodes.empty());
}

TEST(Format, KeepsLightsApart) {
  File file;
  read_file(NACRE_SOURCE_DIR "/tests/golden/cache/good-v2.nacre", file);
  if (HasFatalFailure()) return;
  ASSERT_EQ(file.groups.size(), 2u);
  const Group& wax = file.groups[0];
  EXPECT_EQ(wax.eta, 1.5);
  EXPECT_EQ(wax.lights, (std::vector<std::string>{"key", "rim"}));
  ASSERT_EQ(wax.light_irradiance.size(), 2u * 3 * 3);
  ASSERT_EQ(wax.errors.size(), 2u * 3);
  ASSERT_EQ(wax.ratios.size(), 2u * 3 * 15);
  for (std::size_t light = 0; light < 2; ++light)
    for (std::size_t sample = 0; sample < 3; ++sample) {
      const auto x = static_cast<float>(sample);
      const float expected[3] = {x, 1, static_cast<float>(light)};
      for (std::size_t k = 0; k < 3; ++k)
        EXPECT_EQ(wax.light_irradiance[(3 * light + k) * 3 + sample], expected[k]);
      EXPECT_EQ(wax.errors[3 * light + sample], 0.25f * x);
      for (std::size_t j = 0; j < 15; ++j)
        EXPECT_EQ(wax.ratios[(3 * light + sample) * 15 + j], 100 * light + 1000 * sample + j);
    }
  // One light needs no irradiance of its own, and of this one nothing else is known.
  EXPECT_EQ(file.groups[1].lights, std::vector<std::string>{""});
  EXPECT_TRUE(file.groups[1].light_irradiance.empty());
  EXPECT_TRUE(file.groups[1].errors.empty());
  EXPECT_TRUE(file.groups[1].ratios.empty());
}

// The octree as the page describes it, recomputed from the samples.
TEST(Format, NodesMeanWhatTheDocumentSays) {
  File file;
  read_file(NACRE_SOURCE_DIR "/tests/golden/cache/good-v1.nacre", file);
  if (HasFatalFailure()) return;
  ASSERT_EQ(file.groups[0].nodes.size(), 3u);
  for (const Group& group : file.groups) {
    std::uint32_t next = 1;
    for (const Node& node : group.nodes) {
      const std::uint32_t samples = node.counts & 0x0fffffff, children = node.counts >> 28;
      EXPECT_EQ(node.first_child, children ? next : 0);
      next += children;
      const auto at = [&](std::size_t plane, std::uint32_t i) {
        return static_cast<double>(group.planes[plane].at(node.first_sample + i));
      };
      double centre[3]{}, weight = 0;
      for (std::uint32_t i = 0; i < samples; ++i) {
        const double w = at(6, i) * (at(7, i) + at(8, i) + at(9, i));
        for (std::size_t k = 0; k < 3; ++k) centre[k] += w * at(k, i);
        weight += w;
      }
      double radius = 0, power[3]{}, second[3]{}, first[3][3]{};
      for (std::uint32_t i = 0; i < samples; ++i) {
        double d2 = 0;
        for (std::size_t k = 0; k < 3; ++k) d2 += std::pow(at(k, i) - static_cast<double>(node.centre[k]), 2);
        radius = std::max(radius, std::sqrt(d2));
        for (std::size_t c = 0; c < 3; ++c) {
          const double w = at(6, i) * at(7 + c, i);
          power[c] += w;
          second[c] += w * d2;
          for (std::size_t k = 0; k < 3; ++k)
            first[c][k] += w * (at(k, i) - static_cast<double>(node.centre[k]));
        }
      }
      EXPECT_NEAR(static_cast<double>(node.radius), radius, 1e-5);
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(static_cast<double>(node.centre[k]), centre[k] / weight, 1e-5);
        EXPECT_NEAR(static_cast<double>(node.power[k]), power[k], 1e-5);
        EXPECT_NEAR(static_cast<double>(node.second_moment[k]), second[k], 1e-4);
        EXPECT_NEAR(static_cast<double>(node.first_moment[k]),
                    std::hypot(first[k][0], first[k][1], first[k][2]), 1e-4);
      }
    }
    if (!group.nodes.empty()) {
      EXPECT_EQ(next, group.nodes.size());
    }
  }
}

}  // namespace
