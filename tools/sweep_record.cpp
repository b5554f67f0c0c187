// A small file beside each picture of a sweep, written after it.
#include "sweep_record.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
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

// A file says whose the folder is; a lock on it, that somebody still writes there. Where files cannot be
// locked, everybody is let in.
FolderClaim::FolderClaim(const std::string& folder, const std::string& sweep) {
  const std::string path = folder + "/points/sweep";
  descriptor_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  const auto fail_io = [&] { fail(ErrorCode::kIo, path, "cannot write: {}", std::strerror(errno)); };
  if (descriptor_ < 0) fail_io();
  if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0) {
    if (::ftruncate(descriptor_, 0) != 0 ||
        ::pwrite(descriptor_, sweep.data(), sweep.size(), 0) != static_cast<ssize_t>(sweep.size())) {
      ::close(descriptor_);
      fail_io();
    }
  } else if (errno != EWOULDBLOCK) {
    return;
  }
  ::flock(descriptor_, LOCK_SH);
  std::string owner(sweep.size() + 1, '\0');
  const ssize_t got = ::pread(descriptor_, owner.data(), owner.size(), 0);
  if (got == static_cast<ssize_t>(sweep.size()) && owner.starts_with(sweep)) return;
  ::close(descriptor_);
  fail(ErrorCode::kMismatch, folder,
       "another sweep is being written there; wait until it has ended, or name another folder for -o");
}

FolderClaim::~FolderClaim() { ::close(descriptor_); }

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
