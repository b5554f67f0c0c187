// Frames, their numbers and their cameras.
#include "film.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "nacre/base/file.h"

namespace nacre::tools {
namespace {

constexpr int kMostFrames = 100'000, kLastFrame = 9'999'999;
constexpr std::size_t kMostBytes = std::size_t{16} << 20, kMostKeys = 10'000;
constexpr double kLargest = 1e12;  // of a coordinate

// "A", "A:B" or "A:B:STEP"
std::vector<int> parse_frames(const std::string& text, const FilmPlan& film) {
  int first = 0, last = 0, step = 1;
  char rest = 0;
  const auto reads = [&](const char* format, int count) {
    return std::sscanf(text.c_str(), format, &first, &last, &step, &rest) == count;
  };
  if (reads("%d%c", 1))
    last = first;
  else if (!reads("%d:%d%c", 2) && !reads("%d:%d:%d%c", 3))
    first = 1, last = 0;
  if (first > last || step < 1)
    throw UsageError("--frames " + text + ": write it as FIRST:LAST, FIRST:LAST:STEP or one number");
  if (first < film.first || last > film.last)
    throw UsageError(fmt::format("--frames {}: the film has frames {} to {}", text, film.first, film.last));
  std::vector<int> frames;
  for (int frame = first; frame <= last; frame += step) frames.push_back(frame);
  return frames;
}

Vec3d read_triple(const nlohmann::json& value, const std::string& name, const std::string& place) {
  Vec3d triple;
  bool sound = value.is_array() && value.size() == 3;
  for (std::size_t k = 0; sound && k < 3; ++k) {
    sound = value[k].is_number();
    if (sound) triple[static_cast<int>(k)] = value[k].get<double>();
    sound = sound && std::abs(triple[static_cast<int>(k)]) <= kLargest;
  }
  if (!sound)
    fail(ErrorCode::kValue, place, "{} is {}; write three numbers in brackets: [0, 20, 100]", name,
         value.dump());
  return triple;
}

CameraKey read_key(const nlohmann::json& entry, const std::string& place) {
  if (!entry.is_object())
    fail(ErrorCode::kSyntax, place,
         "is no key frame: {{\"frame\": 1, \"origin\": [0, 20, 100], \"target\": [0, 20, 0]}}");
  for (const char* const name : {"frame", "origin", "target"})
    if (!entry.contains(name)) fail(ErrorCode::kSyntax, place, "has no {}", name);
  CameraKey key{};
  for (const auto& [name, value] : entry.items()) {
    if (name == "frame") {
      if (!value.is_number_integer() || value < 0 || value > kLastFrame)
        fail(ErrorCode::kValue, place, "frame {} is not a whole number from 0 to {}", value.dump(),
             kLastFrame);
      key.frame = value.get<int>();
    } else if (name == "origin") {
      key.origin = read_triple(value, name, place);
    } else if (name == "target") {
      key.target = read_triple(value, name, place);
    } else if (name == "up") {
      key.up = read_triple(value, name, place);
    } else if (name == "fov") {
      if (!value.is_number() || !(value > 0) || !(value < 180))
        fail(ErrorCode::kValue, place, "fov {} is not a number of degrees between 0 and 180", value.dump());
      key.fov = value.get<double>();
    } else {
      fail(ErrorCode::kSyntax, place, "'{}' is none of frame, origin, target, up, fov", name);
    }
  }
  if (!is_view(key))
    fail(ErrorCode::kValue, place,
         "origin and target have to differ, and up must not point along the line between them");
  return key;
}

}  // namespace

std::vector<CameraKey> load_camera_path(const std::string& path) {
  const std::string text = read_text_file(path, kMostBytes);
  nlohmann::json json;
  try {
    json = nlohmann::json::parse(text);
  } catch (const nlohmann::json::parse_error& error) {
    const auto line =
        1 + std::count(text.begin(),
                       text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size())), '\n');
    fail(ErrorCode::kSyntax, fmt::format("{}:{}", path, line), "is not JSON from here on");
  }
  if (!json.is_array() || json.empty())
    fail(ErrorCode::kSyntax, path, "is no list of key frames: [{{\"frame\": 1, \"origin\": ...}}, ...]");
  if (json.size() > kMostKeys)
    fail(ErrorCode::kLimit, path, "has {} key frames; at most {} will do", json.size(), kMostKeys);
  std::vector<CameraKey> keys;
  for (const nlohmann::json& entry : json) {
    const std::string place = fmt::format("{}: key frame {}", path, keys.size() + 1);
    keys.push_back(read_key(entry, place));
    if (keys.size() > 1 && keys.back().frame <= keys[keys.size() - 2].frame)
      fail(ErrorCode::kValue, place, "frame {} does not come after frame {}", keys.back().frame,
           keys[keys.size() - 2].frame);
  }
  if (keys.back().frame - keys.front().frame >= kMostFrames)
    fail(ErrorCode::kLimit, path, "goes from frame {} to {}; a film has at most {} frames",
         keys.front().frame, keys.back().frame, kMostFrames);
  return keys;
}

FilmPlan plan_film(const FilmOptions& options) {
  if (options.turntable > 0 && !options.camera_path.empty())
    throw UsageError("give either --turntable or --camera-path");
  FilmPlan film;
  if (options.turntable > 0) {
    film.last = options.turntable;
  } else {
    film.keys = load_camera_path(options.camera_path);
    film.first = film.keys.front().frame;
    film.last = film.keys.back().frame;
  }
  film.chosen = parse_frames(
      options.frames.empty() ? fmt::format("{}:{}", film.first, film.last) : options.frames, film);
  return film;
}

std::vector<Camera> make_film_cameras(const FilmOptions& options, const FilmPlan& film, const Scene& scene,
                                      std::size_t camera) {
  const Camera& own = scene.cameras[camera];
  std::vector<Camera> cameras;
  const TurnAxis axis = find_turn_axis(scene, own);
  for (int frame = film.first; frame <= film.last; ++frame)
    cameras.push_back(
        film.keys.empty()
            ? turn_camera(own, axis, static_cast<double>(frame - film.first) / options.turntable)
            : move_camera(own, film.keys, frame, options.camera_path));
  return cameras;
}

std::string describe_camera(const Camera& camera) {
  std::string text = fmt::format("{} {} {} {} {} {} {}", static_cast<int>(camera.kind), camera.fov,
                                 static_cast<int>(camera.fov_axis), camera.near_clip, camera.far_clip,
                                 camera.aperture_radius, camera.focus_distance);
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) text += fmt::format(" {}", camera.to_world[row][column]);
  return text;
}

std::string frame_path(const std::string& output, int frame) {
  const std::filesystem::path path(output);
  std::string name = path.filename().string();
  std::size_t at = name.find('#'), length = 0, digits = 4;
  if (const std::size_t percent = name.find('%'); at == std::string::npos && percent != std::string::npos) {
    int width = 0, read = 0;
    if (std::sscanf(name.c_str() + percent, "%%0%1dd%n", &width, &read) == 1 && read > 0) {
      at = percent;
      length = static_cast<std::size_t>(read);
      digits = static_cast<std::size_t>(width);
    }
  } else if (at != std::string::npos) {
    length = digits = std::min(name.find_first_not_of('#', at), name.size()) - at;
  }
  if (at == std::string::npos) {
    at = path.stem().string().size();
    name.insert(at++, ".");
  }
  name.replace(at, length, fmt::format("{:0{}}", frame, digits));
  if (name.find('#') != std::string::npos)
    throw UsageError("-o " + output + ": the number of a frame goes into one place, and there are several");
  return std::filesystem::path(path).replace_filename(name).string();
}

void add_film_options(CLI::App& command, FilmOptions& options) {
  command
      .add_option("--turntable", options.turntable,
                  "A film of this many frames: the camera goes once round the middle of the translucent "
                  "objects, about the axis that is nearest to its up; lights stay. Frame 1 is the camera")
      ->check(CLI::Range(1, kMostFrames));
  command
      .add_option("--camera-path", options.camera_path,
                  "A film along the key frames in this JSON file: [{\"frame\": 1, \"origin\": [x, y, z], "
                  "\"target\": [x, y, z], \"up\": [0, 1, 0], \"fov\": 30}, ...]; up and fov may be left out")
      ->check(not_empty());
  command
      .add_option("--frames", options.frames,
                  "FIRST:LAST[:STEP] or one number: the frames of the film to render (default: all)")
      ->check(not_empty());
  command
      .add_option("--contact-sheet", options.contact_sheet,
                  "A PNG of thumbnails of these frames; with --exposure auto of all, at one exposure, "
                  "once they are there")
      ->check(not_empty());
}

}  // namespace nacre::tools
