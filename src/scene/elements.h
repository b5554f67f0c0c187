// Readers of the elements of a scene, one kind of plugin each.
#pragma once

#include <functional>
#include <string>

#include "nacre/scene/scene.h"
#include "scene/parameters.h"
#include "scene/scene_xml.h"

namespace nacre {

/// Limit of world space, in scene units: squares of distances stay finite in single precision.
inline constexpr double kMaxCoordinate = 1e15;
inline constexpr double kMaxVertex = 1e9;  // squares of areas still fit a float

struct MediumElement {
  Medium medium;
  SubsurfaceSettings settings;
};

struct SensorElement {
  Camera camera;
  Film film;
  int samples_per_pixel = 0;  // 0: the sensor does not say
};

/// Finds the element that a <ref> names.
using Resolve = std::function<const XmlElement&(const XmlElement& ref)>;

/// <bsdf>
Surface read_surface(const XmlElement& element, const Resolve& resolve, const TextureIndex& textures,
                     Warnings& warnings);
/// <texture>, and the picture it shows
Texture read_texture(const XmlElement& element, Warnings& warnings);
/// <subsurface>
MediumElement read_medium(const XmlElement& element, const TextureIndex& textures, Warnings& warnings);
/// <emitter> directly inside <scene>: every type but area.
Light read_light(const XmlElement& element, Warnings& warnings);
/// <emitter> inside shape `shape`, of type area.
Light read_area_light(const XmlElement& element, std::uint32_t shape, Warnings& warnings);
/// <sensor> with its film and sampler
SensorElement read_sensor(const XmlElement& element, Warnings& warnings);
/// <integrator>
Integrator read_integrator(const XmlElement& element, Warnings& warnings);
/// Whether shapes of that type are read from files.
bool is_mesh_file(std::string_view type);
/// The mesh of a <shape> in world space: type, file and transforms, not what stands inside it.
/// Is told how many triangles a subdivision will make, of how many that a file holds, and where it is asked
/// for.
using SubdivisionCharge = std::function<void(std::size_t made, std::size_t read, const std::string& place)>;
Mesh read_mesh(const XmlElement& element, Warnings& warnings, const SubdivisionCharge& charge);
/// Moves a mesh to where it belongs, as far as world space reaches. `transform_place` is that of the
/// transform.
void place_mesh(Mesh& mesh, const Matrix4& to_world, const std::string& transform_place,
                const std::string& place);

}  // namespace nacre
