// Frames, their numbers and their cameras.
#include "film.h"

#include <filesystem>

namespace nacre::tools {
namespace {

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
  for (std::int64_t frame = first; frame <= last; frame += step) frames.push_back(static_cast<int>(frame));
  return frames;
}

}  // namespace

FilmPlan plan_film(const FilmOptions& options) {
  const std::string ending = std::filesystem::path(options.contact_sheet).extension().string();
  if (!options.contact_sheet.empty() && ending != ".png" && ending != ".PNG")
    throw UsageError("--contact-sheet " + options.contact_sheet + ": it is a PNG; name it .png");
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
    if (name.find('%') != std::string::npos)
      throw UsageError("-o " + output + ": write the number of a frame as #### or %04d");
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
