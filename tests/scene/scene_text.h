// Scenes from text, for tests: each in a folder of its own that goes away with it.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "nacre/scene/scene_file.h"

namespace nacre {

class SceneFolder {
 public:
  SceneFolder() {
    std::string name = testing::TempDir() + "/nacre_scene_XXXXXX";
    path_ = mkdtemp(name.data());
  }
  ~SceneFolder() { std::filesystem::remove_all(path_); }
  SceneFolder(const SceneFolder&) = delete;
  SceneFolder& operator=(const SceneFolder&) = delete;

  /// Writes a file and returns its path.
  std::string write(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = path_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << text;
    return file.string();
  }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

/// The scene of a file that has `body` inside its <scene>, from line 2 on.
inline Scene scene_of(const std::string& body, const Defines& defines = {}) {
  const SceneFolder folder;
  return load_scene(folder.write("scene.xml", "<scene version=\"0.6.0\">\n" + body + "\n</scene>\n"),
                    defines);
}

/// The one medium of a rectangle with these parameters.
inline Medium medium_of(const std::string& parameters) {
  return scene_of("<shape type=\"rectangle\"><subsurface type=\"dipole\">" + parameters +
                  "</subsurface></shape>")
      .media.at(0);
}

/// How many of the warnings contain `text`.
inline int count_warnings(const Scene& scene, const std::string& text) {
  int count = 0;
  for (const std::string& warning : scene.warnings) count += warning.find(text) != std::string::npos;
  return count;
}

}  // namespace nacre
