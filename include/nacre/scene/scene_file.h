// Scene files: a documented subset of Mitsuba 0.6 scene XML (scenes/README.md).
#pragma once

#include <map>
#include <string>

#include "nacre/scene/scene.h"

namespace nacre {

/// Values of $name, as -D name=value gives them; they win over <default> elements of the file.
using Defines = std::map<std::string, std::string>;

/// Which files a scene may name: any, or those of its own folder and below, for scenes from strangers.
enum class SceneFiles { kAnywhere, kOwnFolder };

/// Reads a scene file and everything it refers to (includes, meshes). Throws Error with "file:line" as the
/// place for what would change the picture: a missing file, an unknown element or plugin type, a value of the
/// wrong type or outside its range, an undefined $name or id, a file that `files` does not allow. Other
/// unknown parameters become warnings.
Scene load_scene(const std::string& path, const Defines& defines = {},
                 SceneFiles files = SceneFiles::kAnywhere);

/// A scene around one mesh file: the mesh made `height_mm` tall (y up), standing on a diffuse floor, of the
/// given medium, lit by area lights and framed by one camera. Scene units are mm. Throws Error for the mesh
/// (load_mesh), for a height that is not positive, and kValue for a mesh without extent.
Scene make_showcase_scene(const std::string& mesh_path, const Medium& medium, double height_mm);

}  // namespace nacre
