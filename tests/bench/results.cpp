// Tables.
#include "bench/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "nacre/base/parallel.h"
#include "nacre/base/simd.h"
#include "nacre/base/version.h"

namespace nacre::bench {
namespace {

std::string cpu_model() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);)
    if (line.starts_with("model name"))
      if (const auto colon = line.find(": "); colon != std::string::npos) return line.substr(colon + 2);
  return "unknown";
}

std::string optional_text(const std::optional<double>& value, double times, int digits) {
  return value ? fmt::format("{:.{}f}", *value * times, digits) : "";
}

std::string bare_table(const std::vector<BareRow>& rows) {
  std::string text =
      "## Primary rays\n\nSeconds of a plain loop of rtcIntersect1 and of the same rays as nacre reports "
      "them.\n\n"
      "| scene | view | bare s | primary_rays s | factor | rays that differ |\n|---|---|--:|--:|--:|--:|\n";
  for (const BareRow& row : rows)
    text += fmt::format("| {} | {} | {:.4f} | {:.4f} | {:.2f} | {:.4f} % |\n", row.scene, row.view,
                        row.bare_seconds, row.primary_seconds, row.primary_seconds / row.bare_seconds,
                        100 * row.differing);
  return text + "\n";
}

std::string case_table(const std::vector<CaseRow>& rows) {
  std::string text = fmt::format(
      "## Frames\n\nSeconds of diffusion (tables, nodes and fills included) over seconds of primary rays of "
      "the same frame. RMSE and largest error are relative to the sum over every sample. Faster: than {:g} "
      "times the primary rays.\n\n"
      "| scene | view | samples | case | size | spp | diffusion s | primary s | ratio | target | faster | "
      "RMSE % | largest % | met |\n|---|---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|---|\n",
      kReferenceRatio);
  for (const CaseRow& row : rows) {
    const auto rmse = row.errors ? std::optional(row.errors->relative_rmse) : std::nullopt;
    const auto largest = row.errors ? std::optional(row.errors->largest) : std::nullopt;
    text += fmt::format(
        "| {} | {} | {} ({}) | {}: {} | {}x{} | {} | {:.4f} | {:.4f} | {:.3f} | {} | {} | {} | {} | {} |\n",
        row.scene, row.view, row.samples, row.density, row.name, row.what, row.width, row.height,
        row.samples_per_pixel, row.diffusion_seconds, row.primary_seconds, row.ratio(),
        optional_text(row.ratio_target, 1, 2), fmt::format("{:.1f}x", row.speed_up()),
        optional_text(rmse, 100, 3), optional_text(largest, 100, 2), row.met());
  }
  return text + "\n";
}

// Factors are from one row to the next.
std::string growth_table(const std::string& title, const std::vector<GrowthRow>& rows,
                         double GrowthRow::*variable) {
  std::string text = fmt::format(
      "## {}\n\n"
      "| samples | Mpixel | factor | reading s | diffusion s | factor | kernel evaluations | factor "
      "| peak of bake, MB | peak of render, MB |\n|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n",
      title);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const GrowthRow& row = rows[i];
    const auto factor = [&](const auto& value) {
      return i == 0 ? std::string()
                    : fmt::format("{:.2f}",
                                  static_cast<double>(value(row)) / static_cast<double>(value(rows[i - 1])));
    };
    text +=
        fmt::format("| {:.0f} | {:.2f} | {} | {} | {:.4f} | {} | {} | {} | {} | {:.0f} |\n", row.samples,
                    row.megapixels, factor([&](const GrowthRow& r) { return r.*variable; }),
                    row.read_seconds > 0 ? fmt::format("{:.4f}", row.read_seconds) : "",
                    row.diffusion_seconds, factor([](const GrowthRow& r) { return r.diffusion_seconds; }),
                    row.kernel_evaluations, factor([](const GrowthRow& r) { return r.kernel_evaluations; }),
                    row.bake_peak_bytes > 0 ? fmt::format("{:.0f}", row.bake_peak_bytes / 1e6) : "",
                    row.render_peak_bytes / 1e6);
  }
  return text + "\n";
}

std::string bake_table(const std::vector<BakeRow>& rows) {
  std::string text =
      "## Growth of the bake\n\nSeconds. Bare: as many shadow rays in a plain loop of rtcOccluded1.\n\n"
      "| samples | placement and shares | irradiance | octree | writing | total | us per sample | bytes per "
      "sample at the peak | shadow rays | bare | total / bare |\n"
      "|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n";
  for (const BakeRow& row : rows)
    text += fmt::format(
        "| {:.0f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.2f} | {:.0f} | {:.3g} | {:.3f} | {:.2f} "
        "|\n",
        row.samples, row.placement_seconds, row.irradiance_seconds, row.octree_seconds, row.write_seconds,
        row.total_seconds, 1e6 * row.total_seconds / row.samples, row.peak_bytes / row.samples,
        row.shadow_rays, row.bare_seconds, row.total_seconds / row.bare_seconds);
  return text + "\n";
}

nlohmann::ordered_json bake_json(const std::vector<BakeRow>& rows) {
  auto json = nlohmann::ordered_json::array();
  for (const BakeRow& row : rows)
    json.push_back({{"samples", row.samples},
                    {"placement_seconds", row.placement_seconds},
                    {"irradiance_seconds", row.irradiance_seconds},
                    {"octree_seconds", row.octree_seconds},
                    {"write_seconds", row.write_seconds},
                    {"total_seconds", row.total_seconds},
                    {"peak_bytes", row.peak_bytes},
                    {"shadow_rays", row.shadow_rays},
                    {"bare_seconds", row.bare_seconds}});
  return json;
}

nlohmann::ordered_json case_json(const CaseRow& row) {
  nlohmann::ordered_json json{{"scene", row.scene},
                              {"view", row.view},
                              {"density", row.density},
                              {"samples", row.samples},
                              {"case", row.name},
                              {"what", row.what},
                              {"width", row.width},
                              {"height", row.height},
                              {"samples_per_pixel", row.samples_per_pixel},
                              {"runs", row.runs},
                              {"diffusion_seconds", row.diffusion_seconds},
                              {"primary_seconds", row.primary_seconds},
                              {"ratio", row.ratio()},
                              {"speed_up", row.speed_up()},
                              {"kernel_evaluations", row.kernel_evaluations}};
  if (row.ratio_target) json["ratio_target"] = *row.ratio_target;
  if (row.errors) {
    json["relative_rmse"] = row.errors->relative_rmse;
    json["largest_error"] = row.errors->largest;
  }
  if (row.error_targets) {
    json["relative_rmse_target"] = row.error_targets->relative_rmse;
    json["largest_error_target"] = row.error_targets->largest;
  }
  if (const std::string met = row.met(); !met.empty()) json["met"] = met;
  return json;
}

nlohmann::ordered_json growth_json(const std::vector<GrowthRow>& rows) {
  auto json = nlohmann::ordered_json::array();
  for (const GrowthRow& row : rows) {
    json.push_back({{"samples", row.samples},
                    {"megapixels", row.megapixels},
                    {"diffusion_seconds", row.diffusion_seconds},
                    {"kernel_evaluations", row.kernel_evaluations},
                    {"render_peak_bytes", row.render_peak_bytes}});
    if (row.read_seconds > 0) json.back()["read_seconds"] = row.read_seconds;
    if (row.bake_peak_bytes > 0) json.back()["bake_peak_bytes"] = row.bake_peak_bytes;
  }
  return json;
}

}  // namespace

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double CaseRow::speed_up() const { return kReferenceRatio / ratio(); }

std::string CaseRow::met() const {
  if (!ratio_target && !error_targets) return "";
  std::string missed;
  const auto check = [&](bool good, const char* measure) {
    if (!good) missed += (missed.empty() ? "no: " : ", ") + std::string(measure);
  };
  if (ratio_target) check(ratio() <= *ratio_target, "ratio");
  if (errors && error_targets) {
    check(errors->relative_rmse <= error_targets->relative_rmse, "RMSE");
    check(errors->largest <= error_targets->largest, "largest");
  }
  return missed.empty() ? "yes" : missed;
}

std::string format_markdown(const Results& results) {
  std::string text =
      fmt::format("# nacre {}: {}, {} threads, {}\n\n", kVersion, cpu_model(), thread_count(), simd_target());
  if (!results.bare.empty()) text += bare_table(results.bare);
  if (!results.cases.empty()) text += case_table(results.cases);
  if (!results.by_samples.empty())
    text += growth_table("Growth with the cache", results.by_samples, &GrowthRow::samples);
  if (!results.by_pixels.empty())
    text += growth_table("Growth with the picture", results.by_pixels, &GrowthRow::megapixels);
  if (!results.bakes.empty()) text += bake_table(results.bakes);
  return text;
}

std::string format_json(const Results& results) {
  nlohmann::ordered_json json;
  json["nacre"] = kVersion;
  json["cpu"] = cpu_model();
  json["threads"] = thread_count();
  json["simd"] = simd_target();
  json["reference_ratio"] = kReferenceRatio;
  json["bare"] = nlohmann::ordered_json::array();
  for (const BareRow& row : results.bare)
    json["bare"].push_back({{"scene", row.scene},
                            {"view", row.view},
                            {"bare_seconds", row.bare_seconds},
                            {"primary_seconds", row.primary_seconds},
                            {"differing_share", row.differing}});
  json["cases"] = nlohmann::ordered_json::array();
  for (const CaseRow& row : results.cases) json["cases"].push_back(case_json(row));
  json["growth"]["samples"] = growth_json(results.by_samples);
  json["growth"]["pixels"] = growth_json(results.by_pixels);
  json["growth"]["bakes"] = bake_json(results.bakes);
  return json.dump(2) + "\n";
}

}  // namespace nacre::bench
