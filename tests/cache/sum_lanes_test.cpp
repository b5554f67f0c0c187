// label: unit
// Every set of vector instructions against plain loops in double precision, and against each other.
#include "cache/sum_lanes.h"

#include <gtest/gtest.h>

#include "cache/kernel_set.h"
#include "cache/sample_sets.h"
#include "nacre/base/simd.h"

namespace nacre {
namespace {

using namespace testing_support;

class EveryTarget : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override { ASSERT_TRUE(choose_simd_target(GetParam())); }
  void TearDown() override { choose_simd_target(simd_targets().front()); }
};
INSTANTIATE_TEST_SUITE_P(Targets, EveryTarget, testing::ValuesIn(simd_targets()),
                         [](const auto& target) { return target.param; });

TEST(Simd, ScalarIsAlwaysThereAndOthersAreRefused) {
  EXPECT_EQ(simd_targets().back(), "scalar");
  EXPECT_FALSE(choose_simd_target("mmx"));
  EXPECT_EQ(simd_target(), simd_targets().front());
  EXPECT_TRUE(choose_simd_target("scalar"));
  EXPECT_GT(simd_targets().size(), 0u);  // to ask what there is leaves the choice as it was
  EXPECT_EQ(simd_target(), "scalar");
  EXPECT_TRUE(choose_simd_target(simd_targets().front()));
}

std::vector<SumSource> make_sources(std::size_t count) {
  Rng rng(4);
  std::vector<SumSource> sources;
  for (std::size_t i = 0; i < count; ++i)
    sources.push_back({rng.next_float(), rng.next_float(), rng.next_float(), 1e-3f * rng.next_float(),
                       Float4{rng.next_float(), 2 * rng.next_float(), rng.next_float(), 0}});
  return sources;
}

// Lists of every length around whole vectors and runs, with the point right at a source, too.
TEST_P(EveryTarget, SumsAListAsAPlainLoopDoes) {
  for (const ProfileKind kind :
       {ProfileKind::kDipole, ProfileKind::kBetterDipole, ProfileKind::kNormalized}) {
    const Kernel kernel(resolved_profiles(make_material("Marble", kind, 3), 0.1));
    for (const std::size_t count :
         {1u, 3u, 4u, 7u, 8u, 15u, 16u, 17u, 63u, 64u, 65u, 1023u, 1024u, 1025u, 5000u}) {
      const std::vector<SumSource> sources = make_sources(count);
      SourceList list;
      for (const SumSource& source : sources) list.add(source);
      list.pad();
      for (const Vec3& x :
           {Vec3(0.5f, 0.4f, 0.3f), Vec3(9, 0, 0), Vec3(sources[0].x, sources[0].y, sources[0].z)}) {
        std::array<double, 3> sum{1, 2, 3}, expected = sum;
        lanes::add_sources(kernel.tables(), list, x, sum);
        for (const SumSource& s : sources) {
          const float r2 = (x - Vec3(s.x, s.y, s.z)).length2();
          const Float4 value = kernel.eval(r2);
          for (std::size_t k = 0; k < 3; ++k)
            expected[k] += double{value[static_cast<int>(k)]} * double{s.power[static_cast<int>(k)]};
        }
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(sum[k] / expected[k], 1, 1e-5) << count << " " << k;
      }
    }
  }
}

// The series of a few nodes, near its centre, is their sum.
TEST_P(EveryTarget, AddsSeriesAsTheyAre) {
  Kernel kernel(make_profiles(make_material("Skin1", ProfileKind::kDipole, 1)));
  const std::vector<SumSource> sources = make_sources(300);
  std::vector<std::uint32_t> all;
  for (std::uint32_t i = 0; i < sources.size(); ++i) all.push_back(i);
  const Vec3 centre(2.2f, 1.9f, -1.4f);
  LocalExpansion expected;
  for (const SumSource& s : sources) {
    const Vec3 offset = centre - Vec3(s.x, s.y, s.z);
    expected.add(s.power, kernel.eval_jet(offset.length2()), offset);
  }
  const auto compare = [&](double tolerance) {
    LocalExpansion expansion;
    lanes::add_series(kernel.tables(), sources.data(), all, centre, expansion);
    for (const Vec3& at : {Vec3(0, 0, 0), Vec3(0.2f, -0.1f, 0.1f), Vec3(-0.1f, 0.2f, 0.3f)})
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(expansion.eval(at)[k] / expected.eval(at)[k], 1, tolerance) << k;
  };
  compare(1e-5);
  kernel.make_middles();  // every term by 0.3 %, its derivatives by 3 % at most
  compare(3e-3);
}

// A node with its second moments is its samples, but for third moments: half as far from its centroid, an
// eighth of the error. As a point it would err by a quarter only.
TEST_P(EveryTarget, NodesCarryTheirSecondMoments) {
  const Kernel kernel(make_profiles(make_material("Skin1", ProfileKind::kDipole, 1)));
  std::vector<SumSource> sources = make_sources(50);
  const auto error_of = [&](float size) {
    Vec3d centre(0, 0, 0);
    double power = 0;
    for (const SumSource& s : sources) {
      centre += Vec3d(s.x, s.y, s.z) * double{s.power[1]};
      power += double{s.power[1]};
    }
    centre /= power;
    SumNode node{};
    node.power = Float4{0, static_cast<float>(power), 0, 0};
    double second[6]{};
    SourceList list;
    for (SumSource s : sources) {
      const Vec3d d = (Vec3d(s.x, s.y, s.z) - centre) * double{size};
      const double share = 0.5 * double{s.power[1]} / power;
      const double terms[] = {d.x * d.x, d.y * d.y, d.z * d.z, d.y * d.z, d.z * d.x, d.x * d.y};
      for (int i = 0; i < 6; ++i) second[i] += share * terms[i];
      s.x = static_cast<float>(d.x);
      s.y = static_cast<float>(d.y);
      s.z = static_cast<float>(d.z);
      list.add(s);
    }
    list.pad();
    node.xx = static_cast<float>(second[0]);
    node.yy = static_cast<float>(second[1]);
    node.zz = static_cast<float>(second[2]);
    node.yz = static_cast<float>(second[3]);
    node.zx = static_cast<float>(second[4]);
    node.xy = static_cast<float>(second[5]);
    const Vec3 at(1.2f, 0.9f, -1.4f);
    std::array<double, 3> exact{};
    lanes::add_sources(kernel.tables(), list, at, exact);
    LocalExpansion series;
    const std::vector<std::uint32_t> only{0};
    lanes::add_series(kernel.tables(), &node, only, at, series);
    return std::abs(double{series.value[1]} / exact[1] - 1);
  };
  const double coarse = error_of(1.0f), fine = error_of(0.5f);
  EXPECT_LT(coarse, 0.03);
  EXPECT_LT(fine, coarse / 6);
}

// Kernels side by side are what they are one by one: of every number around whole vectors, of fewer in one
// channel than in others, interpolated or not, under one light, a few, or one each.
TEST_P(EveryTarget, SumsSetsAsOneByOne) {
  const std::vector<SumSource> sources = make_sources(333);
  std::vector<SumNode> nodes(sources.size());
  std::vector<std::uint32_t> all;
  SourceList list, rows;
  for (std::uint32_t i = 0; i < sources.size(); ++i) {
    const SumSource& s = sources[i];
    nodes[i] = SumNode{};
    nodes[i].x = s.x, nodes[i].y = s.y, nodes[i].z = s.z;
    nodes[i].xx = 0.01f, nodes[i].yy = 0.02f, nodes[i].zz = 0.03f, nodes[i].xy = 0.005f;
    nodes[i].power = s.power;
    all.push_back(i);
    list.add(s);
    rows.add({s.x, s.y, s.z, 0, with_row(s.power, i)});
  }
  list.pad();
  rows.pad();
  const Vec3 centre(2.2f, 1.9f, -1.4f);
  for (const bool middles : {false, true})
    for (const std::size_t count : {1u, 2u, 5u, 6u, 11u, 14u}) {
      std::vector<Kernel> kernels;
      for (std::size_t i = 0; i < count; ++i) {
        const float scale = 0.5f + 0.25f * static_cast<float>(i);
        kernels.emplace_back(make_profiles(make_material("Skin1", ProfileKind::kDipole, scale)));
        if (middles) kernels.back().make_middles();
      }
      const std::array<std::size_t, 3> counts{count, count - count / 2, count};
      for (const std::uint32_t lights : {0u, 1u, 2u, 3u, 4u, 7u}) {
        // Light l is the first times 1 + l.
        KernelLights seen;
        for (std::uint32_t j = 0; j < count && lights > 0; ++j)
          seen.push_back({j % lights, (j + 1) % lights, (3 * j + 2) % lights});
        const KernelSet set(kernels, counts, KernelSet::Tables::kAny, seen);
        ASSERT_EQ(set.width() % KernelSet::kStep, 0u);
        ASSERT_EQ(set.first(3), counts[0] + counts[1] + counts[2]);
        std::vector<float> own(sources.size() * set.row_width());
        for (std::uint32_t l = 0; l < lights; ++l)
          set.for_each_column(l, [&](std::size_t column, std::size_t k) {
            for (std::size_t i = 0; i < sources.size(); ++i)
              own[i * set.row_width() + column] =
                  static_cast<float>(l + 1) * sources[i].power[static_cast<int>(k)];
          });
        const float* const powers = lights > 0 ? own.data() : nullptr;
        if (powers) rows.copy_rows(powers, set.row_width());
        std::vector<double> totals(set.width());
        lanes::add_sources(set, powers ? rows : list, centre, totals);
        SetExpansion of_nodes, of_sources;
        of_nodes.clear(set.width());
        of_sources.clear(set.width());
        lanes::add_series(set, nodes.data(), powers, all, centre, of_nodes);
        lanes::add_series(set, sources.data(), powers, all, centre, of_sources);
        const Vec3 at(0.1f, -0.2f, 0.15f);
        std::vector<float> node_values(set.width()), source_values(set.width());
        of_nodes.eval(at, node_values);
        of_sources.eval(at, source_values);
        for (std::size_t j = 0; j < count; ++j) {
          std::array<double, 3> total{};
          LocalExpansion single_nodes, single_sources;
          lanes::add_sources(kernels[j].tables(), list, centre, total);
          lanes::add_series(kernels[j].tables(), nodes.data(), all, centre, single_nodes);
          lanes::add_series(kernels[j].tables(), sources.data(), all, centre, single_sources);
          for (std::size_t k = 0; k < 3; ++k) {
            if (j >= counts[k]) continue;
            const std::size_t lane = set.first(k) + j;
            const double light = lights > 0 ? static_cast<double>(seen[j][k] + 1) : 1;
            const auto channel = static_cast<int>(k);
            EXPECT_NEAR(totals[lane] / (light * total[k]), 1, 1e-5) << count << " " << lane;
            EXPECT_NEAR(double{node_values[lane]} / (light * double{single_nodes.eval(at)[channel]}), 1, 1e-5)
                << count << " " << lane;
            EXPECT_NEAR(double{source_values[lane]} / (light * double{single_sources.eval(at)[channel]}), 1,
                        1e-5)
                << count << " " << lane;
          }
        }
        for (std::size_t lane = set.first(3); lane < set.width(); ++lane) EXPECT_EQ(totals[lane], 0);
      }
    }
}

// Whatever the instructions, a value depends on the same nodes; what is left is rounding.
TEST_P(EveryTarget, EvaluatesExitanceAlike) {
  for (const ProfileKind kind : {ProfileKind::kDipole, ProfileKind::kNormalized})
    for (const Promise promise : {Promise::kCalibrated, Promise::kCertified}) {
      const OwnedGroup owned = make_group(make_sphere(48, &coloured_light));
      const Exitance exitance(owned.group, make_material("Marble", kind, 8), 0.02, promise);
      std::vector<Vec3> points;
      Rng rng(8);
      for (int i = 0; i < 300; ++i)
        points.push_back(
            Vec3(rng.next_float() - 0.5f, rng.next_float() - 0.5f, rng.next_float() - 0.5f).normalized());
      std::vector<Rgb> values(points.size()), plain(points.size());
      std::uint64_t evaluations = 0;
      exitance.eval(points, values, evaluations);
      choose_simd_target("scalar");
      exitance.eval(points, plain, evaluations);
      choose_simd_target(GetParam());
      for (std::size_t i = 0; i < points.size(); ++i)
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(values[i][k] / plain[i][k], 1, 2e-5f) << i << " " << k;
    }
}

}  // namespace
}  // namespace nacre
