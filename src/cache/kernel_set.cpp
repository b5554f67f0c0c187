// Tables of several kernels, interleaved; expansions of several sums.
#include "cache/kernel_set.h"

#include <algorithm>
#include <numeric>

#include "nacre/base/parallel.h"

namespace nacre {

struct KernelSet::Table {
  const float* rows;
  DistanceBins bins;
};

// `fields` Float4 a row, of tables that begin and end elsewhere: beyond its ends a table is as it is there.
AlignedFloats KernelSet::interleave(std::span<const Table> tables, std::size_t fields,
                                    DistanceBins& bins) const {
  bins = tables[0].bins;
  for (const Table& table : tables) {
    bins.first = std::min(bins.first, table.bins.first);
    bins.last = std::max(bins.last, table.bins.last);
  }
  const auto count = static_cast<std::size_t>(bins.last - bins.first) + 1;
  AlignedFloats result;
  result.resize(count * fields * width());
  constexpr std::size_t kRun = 512;
  parallel_for(count, kRun, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::int32_t bin = bins.first + static_cast<std::int32_t>(i);
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t lane = first(k); lane < first(k + 1); ++lane) {
          const Table& table = tables[lane - first(k)];
          const auto row =
              static_cast<std::size_t>(std::clamp(bin, table.bins.first, table.bins.last) - table.bins.first);
          for (std::size_t f = 0; f < fields; ++f)
            result.data()[(i * fields + f) * width() + lane] = table.rows[(row * fields + f) * 4 + k];
        }
    }
  });
  return result;
}

KernelSet::KernelSet(std::span<const Kernel> kernels, const std::array<std::size_t, 3>& counts, Tables which,
                     const KernelLights& lights)
    : first_{0, counts[0], counts[0] + counts[1], counts[0] + counts[1] + counts[2]},
      rows_(Rows::kPower),
      interpolated_(which == Tables::kExact || kernels[0].tables().interpolated) {
  const std::size_t width = (first_[3] + kStep - 1) / kStep * kStep;
  lights_.assign(width, 0);
  if (!lights.empty()) {
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t lane = first(k); lane < first(k + 1); ++lane)
        lights_[lane] = lights[lane - first(k)][k];
    const std::size_t floats = 4 * (std::size_t{std::ranges::max(lights_)} + 1);
    rows_ = floats <= kFewColumns ? Rows::kFewLights : Rows::kLanes;
  }
  columns_.assign(width, 3);  // where it is padded: dark
  for (std::uint32_t k = 0; k < 3; ++k)
    for (std::size_t lane = first(k); lane < first(k + 1); ++lane) columns_[lane] = 4 * lights_[lane] + k;
  if (rows_ == Rows::kLanes) std::iota(columns_.begin(), columns_.end(), 0u);
  std::vector<Table> cells, jets;
  for (const Kernel& kernel : kernels) {
    const KernelTables tables = which == Tables::kExact ? kernel.exact_tables() : kernel.tables();
    cells.push_back({tables.cells, tables.cell_bins});
    jets.push_back({tables.jets, tables.jet_bins});
  }
  const std::size_t parts = interpolated_ ? 2 : 1;
  cells_ = interleave(cells, parts, cell_bins_);
  jets_ = interleave(jets, 2 * parts, jet_bins_);
}

std::size_t KernelSet::row_width() const noexcept {
  switch (rows_) {
    case Rows::kFewLights:
      return kFewColumns;
    case Rows::kLanes:
      return width();
    case Rows::kPower:
      break;
  }
  return 4;
}

void SetExpansion::move_from(const SetExpansion& other, const Vec3& by) {
  coefficients_ = other.coefficients_;
  const std::size_t width = coefficients_.size() / kCoefficients;
  float* const to = coefficients_.data();
  const auto at = [&](Coefficient c) { return to + static_cast<std::size_t>(c) * width; };
  for (std::size_t i = 0; i < width; ++i) {
    const float x = at(kXX)[i] * by.x + at(kXY)[i] * by.y + at(kZX)[i] * by.z;
    const float y = at(kXY)[i] * by.x + at(kYY)[i] * by.y + at(kYZ)[i] * by.z;
    const float z = at(kZX)[i] * by.x + at(kYZ)[i] * by.y + at(kZZ)[i] * by.z;
    at(kValue)[i] +=
        (at(kX)[i] + 0.5f * x) * by.x + (at(kY)[i] + 0.5f * y) * by.y + (at(kZ)[i] + 0.5f * z) * by.z;
    at(kX)[i] += x;
    at(kY)[i] += y;
    at(kZ)[i] += z;
  }
}

void SetExpansion::eval(const Vec3& p, std::span<float> values) const {
  const std::size_t width = values.size();
  const float* const from = coefficients_.data();
  const auto at = [&](Coefficient c) { return from + static_cast<std::size_t>(c) * width; };
  for (std::size_t i = 0; i < width; ++i) {
    const float x = at(kX)[i] + 0.5f * at(kXX)[i] * p.x + at(kXY)[i] * p.y;
    const float y = at(kY)[i] + 0.5f * at(kYY)[i] * p.y + at(kYZ)[i] * p.z;
    const float z = at(kZ)[i] + 0.5f * at(kZZ)[i] * p.z + at(kZX)[i] * p.x;
    values[i] = at(kValue)[i] + x * p.x + y * p.y + z * p.z;
  }
}

}  // namespace nacre
