// What shows the pictures of a sweep together.
#include "sweep_assembly.h"

#include <charconv>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "contact_sheet.h"
#include "nacre/base/file.h"
#include "nacre/base/parallel.h"
#include "nacre/base/simd.h"
#include "nacre/base/version.h"

namespace nacre::tools {
namespace {

constexpr int kThumbnailEdge = 256;

// A float as it is read, without the digits that a double adds.
double shortest(float value) {
  double result = 0;
  const std::string text = fmt::format("{}", value);
  std::from_chars(text.data(), text.data() + text.size(), result);
  return result;
}

}  // namespace

void assemble_sweep(const SweepOptions& options, const SweepPlan& plan, const std::vector<SweepPoint>& points,
                    const std::vector<SweepRecord>& records, std::optional<double> exposure,
                    Session& session) {
  const StageTimer timer(session.report(), "write_image");
  const auto file_of = [&](const SweepPoint& point, const char* ending) {
    return picture_name(point.index) + ending;
  };
  if (!exposure) {
    exposure = 1e3;
    for (const SweepPoint& point : points)
      exposure = std::min(*exposure, auto_exposure(load_exr(options.output + "/" + file_of(point, ".exr"))));
  }
  std::vector<SheetPicture> pictures(points.size());
  parallel_for(points.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Image image = load_exr(options.output + "/" + file_of(points[i], ".exr"));
      save_png(image, options.output + "/" + file_of(points[i], ".png"), *exposure);
      pictures[i] = {file_of(points[i], ".png"), *points[i].settings,
                     make_preview(shrink(image, kThumbnailEdge), options.output, *exposure)};
    }
  });
  nlohmann::ordered_json manifest;
  manifest["nacre"] = kVersion;
  manifest["scene"] = options.scene.path;
  manifest["cache"] = options.cache;
  manifest["exposure"] = *exposure;
  manifest["simd"] = simd_target();
  manifest["options"] = options.words;
  for (const SweepAxis& axis : plan.axes) {
    nlohmann::ordered_json values;
    for (const Setting& value : axis.values) values.push_back(value.value);
    manifest["axes"].push_back({{"name", axis.name}, {"values", values}});
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const SweepPoint& point = points[i];
    nlohmann::ordered_json entry;
    for (const Setting& setting : *point.settings)
      entry["settings"][setting.key + (setting.relative ? "*" : "")] = setting.value;
    const auto triple = [](const Rgb& v) {
      return nlohmann::ordered_json{shortest(v.x), shortest(v.y), shortest(v.z)};
    };
    entry["coefficients"] = {{"sigma_s_prime", triple(reduce(point.material).sigma_s_prime)},
                             {"sigma_a", triple(point.material.sigma_a)},
                             {"g", triple(point.material.g)},
                             {"eta", shortest(point.material.eta())},
                             {"scale", shortest(point.material.scale)}};
    entry["exr"] = file_of(point, ".exr");
    entry["png"] = file_of(point, ".png");
    entry["xxh3"] = records[i].digest;
    entry["key"] = records[i].key;
    entry["seconds"] = records[i].seconds;
    manifest["pictures"].push_back(entry);
  }
  const auto write = [&](const std::string& name, const auto& bytes) {
    AtomicFile file(options.output + "/" + name);
    file.write(bytes.data(), bytes.size());
    file.commit();
  };
  write("contact_sheet.png", encode_png(make_contact_sheet(plan, pictures), options.output));
  write("index.html", make_sweep_page(plan, pictures, options.scene.path));
  write("manifest.json", manifest.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  session.progress().say(options.output + "/manifest.json, contact_sheet.png and index.html");
  std::size_t end = points.size();
  while (std::filesystem::exists(options.output + "/" + picture_name(end) + ".exr")) ++end;
  if (end > points.size())
    session.warn(
        {fmt::format("{}: pictures from {} to {} are of an earlier sweep, the manifest does not name them",
                     options.output, picture_name(points.size()), picture_name(end - 1))});
}

}  // namespace nacre::tools
