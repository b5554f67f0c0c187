// Tables of several kernels, interleaved; expansions of several sums.
#include "cache/kernel_set.h"

#include <algorithm>

namespace nacre {
namespace {

struct Table {
  const float* rows;
  DistanceBins bins;
};

// `fields` Float4 a row, of tables that begin and end elsewhere: beyond its ends a table is as it is there.
std::vector<float> interleave(std::span<const Table> tables, std::size_t fields, std::size_t padded,
                              DistanceBins& bins) {
  bins = tables[0].bins;
  for (const Table& table : tables) {
    bins.first = std::min(bins.first, table.bins.first);
    bins.last = std::max(bins.last, table.bins.last);
  }
  const auto count = static_cast<std::size_t>(bins.last - bins.first) + 1;
  std::vector<float> result(count * fields * 3 * padded);
  for (std::size_t m = 0; m < tables.size(); ++m) {
    const Table& table = tables[m];
    float* to = result.data() + m;
    for (std::int32_t bin = bins.first; bin <= bins.last; ++bin) {
      const auto row =
          static_cast<std::size_t>(std::clamp(bin, table.bins.first, table.bins.last) - table.bins.first);
      for (std::size_t f = 0; f < fields; ++f)
        for (std::size_t k = 0; k < 3; ++k, to += padded) *to = table.rows[(row * fields + f) * 4 + k];
    }
  }
  return result;
}

}  // namespace

KernelSet::KernelSet(std::span<const Kernel> kernels)
    : padded_((kernels.size() + kLanes - 1) / kLanes * kLanes),
      interpolated_(kernels[0].tables().interpolated) {
  std::vector<Table> cells, jets;
  for (const Kernel& kernel : kernels) {
    const KernelTables tables = kernel.tables();
    cells.push_back({tables.cells, tables.cell_bins});
    jets.push_back({tables.jets, tables.jet_bins});
  }
  const std::size_t parts = interpolated_ ? 2 : 1;
  cells_ = interleave(cells, parts, padded_, cell_bins_);
  jets_ = interleave(jets, 2 * parts, padded_, jet_bins_);
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
