// A small file beside each picture of a sweep, written after it.
#include "sweep_record.h"

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "contact_sheet.h"
#include "nacre/base/error.h"
#include "nacre/base/file.h"
#include "nacre/cache/fingerprint.h"

namespace nacre::tools {

std::string picture_name(std::size_t index) { return fmt::format("{:04}", index + 1); }

std::string record_path(const std::string& folder, std::size_t index) {
  return fmt::format("{}/points/{}.json", folder, picture_name(index));
}

void save_record(const std::string& folder, std::size_t index, const std::vector<Setting>& settings,
                 const SweepRecord& record) {
  nlohmann::ordered_json json;
  for (const Setting& setting : settings)
    json["settings"][setting.key + (setting.relative ? "*" : "")] = setting.value;
  json["key"] = record.key;
  json["xxh3"] = record.digest;
  json["seconds"] = record.seconds;
  const std::string text = json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  AtomicFile file(record_path(folder, index));
  file.write(text.data(), text.size());
  file.commit();
}

std::optional<SweepRecord> find_complete(const std::string& folder, std::size_t index,
                                         const std::string& key) {
  const std::string path = record_path(folder, index);
  const std::string picture = folder + "/" + picture_name(index) + ".exr";
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error) || !std::filesystem::is_regular_file(picture, error))
    return std::nullopt;
  constexpr std::size_t kMostRecord = std::size_t{1} << 20, kMostPicture = std::size_t{1} << 40;
  const auto json = nlohmann::json::parse(read_text_file(path, kMostRecord), nullptr, false);
  if (!json.is_object()) return std::nullopt;
  const auto text = [&](const char* name) {
    const auto found = json.find(name);
    return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  SweepRecord record{text("key"), text("xxh3"), 0};
  if (record.key != key || record.digest != bytes_digest(read_text_file(picture, kMostPicture)))
    return std::nullopt;
  if (const auto found = json.find("seconds"); found != json.end() && found->is_number())
    record.seconds = found->get<double>();
  return record;
}

}  // namespace nacre::tools
