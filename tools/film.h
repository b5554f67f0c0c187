// Films: which frames, where the camera is in each, what their files are called.
#pragma once

#include <string>
#include <vector>

#include "nacre/scene/camera_motion.h"
#include "picture.h"

namespace nacre::tools {

struct FilmOptions {
  int turntable = 0;
  std::string camera_path, frames, contact_sheet;
  bool any() const { return turntable > 0 || !camera_path.empty(); }
};
void add_film_options(CLI::App& command, FilmOptions& options);

/// Frames `first` to `last`, and those of them that a command renders, in order.
struct FilmPlan {
  int first = 1, last = 1;
  std::vector<int> chosen;
  std::vector<CameraKey> keys;  // of --camera-path
};
/// Throws UsageError for frames that the film does not have and options that do not go together; what
/// load_camera_path throws.
FilmPlan plan_film(const FilmOptions& options);
/// A list of key frames: [{"frame": 1, "origin": [x, y, z], "target": [x, y, z], "up": [0, 1, 0], "fov": 30},
/// ...], up and fov where wanted. Throws Error with `path` and the line or the key.
std::vector<CameraKey> load_camera_path(const std::string& path);
/// The scene's camera at every frame. Throws Error(kValue) for one at which it looks nowhere.
std::vector<Camera> make_film_cameras(const FilmOptions& options, const FilmPlan& film, const Scene& scene,
                                      std::size_t camera);
/// Says all of a camera that a picture depends on.
std::string describe_camera(const Camera& camera);

/// The file of a frame: its number instead of the #s in the name, or of a "%04d", with zeros in front; after
/// a dot before the ending, with four digits, where the name says nothing. Throws UsageError for a name with
/// two places.
std::string frame_path(const std::string& output, int frame);

/// Writes previews of the chosen frames, if `png`, and a contact sheet of them, if wanted, at `exposure`.
/// Without one, of all `frames` of the film at the lowest that suits one of them, once all are complete.
void show_film(const FilmOptions& options, const FilmPlan& film, const std::vector<Picture>& frames, bool png,
               std::optional<double> exposure, Session& session);

}  // namespace nacre::tools
