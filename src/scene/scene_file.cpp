// Builds a scene from the elements of its file: order, ids and references, and what is worth a warning.
#include "nacre/scene/scene_file.h"

#include <algorithm>
#include <optional>

#include "nacre/geometry/topology.h"
#include "scene/elements.h"
#include "scene/framing.h"
#include "scene/parameters.h"
#include "scene/triangle_budget.h"

namespace nacre {
namespace {

constexpr float kDefaultFov = 35;

bool is_group(const XmlElement& element) {
  return element.tag == "shape" && plugin_type(element) == "shapegroup";
}

bool is_instance(const XmlElement& element) {
  return element.tag == "shape" && plugin_type(element) == "instance";
}

class Builder {
 public:
  Builder(Scene& scene, const XmlElement& root) : scene_(scene), root_(root) { collect_ids(root); }
  void build();

 private:
  struct Group {
    std::vector<Shape> shapes;  // in the group's own space; read with the first instance
    std::size_t instances = 0, placed = 0;
  };

  void collect_ids(const XmlElement& element);
  void add_element(const XmlElement& element);
  void add_light(Light light);
  void add_sensor(const XmlElement& element);
  void add_shape(const XmlElement& element);
  void add_instance(const XmlElement& element);
  std::optional<Light> read_light_of(const XmlElement& shape, std::uint32_t index);
  Shape read_shape(const XmlElement& element, std::size_t number, bool emits);
  std::vector<Shape> read_group(const XmlElement& group);
  const XmlElement& group_of(const XmlElement& instance) const;
  void check_unused_group(const XmlElement& group);
  void add_default_camera();
  int surface_index(const XmlElement& element);
  int medium_index(const XmlElement& element);
  int texture_index(const XmlElement& element);
  Surface read_surface_of(const XmlElement& element);
  MediumElement read_medium_of(const XmlElement& element);
  int add_default_surface(const std::string& place, bool emits);
  const XmlElement& resolve(const XmlElement& ref) const;
  void warn_about_shape(const Shape& shape);
  void warn_about_textures(const Shape& shape);
  void warn(const std::string& place, const std::string& text) {
    scene_.warnings.push_back(place + ": " + text);
  }

  Scene& scene_;
  const XmlElement& root_;
  std::map<std::string, const XmlElement*> ids_;
  std::map<const XmlElement*, int> surfaces_, media_, textures_;  // those that are in the scene already
  std::map<const XmlElement*, Group> groups_;                     // those that have an instance
  TriangleBudget budget_;
  bool has_integrator_ = false, has_sample_count_ = false;
};

void Builder::collect_ids(const XmlElement& element) {
  if (element.tag != "ref" && element.has("id")) {
    const auto [first, is_new] = ids_.emplace(element.get("id"), &element);
    if (!is_new)
      fail(ErrorCode::kValue, element.place(), "the id '{}' is taken already by the <{}> at {}",
           element.get("id"), first->second->tag, first->second->place());
  }
  for (const XmlElement& child : element.children) collect_ids(child);
}

const XmlElement& Builder::resolve(const XmlElement& ref) const {
  const auto found = ids_.find(ref.get("id"));
  if (found == ids_.end()) fail(ErrorCode::kValue, ref.place(), "no element has the id '{}'", ref.get("id"));
  return *found->second;
}

void Builder::build() {
  for (const XmlElement& element : root_.children)
    if (is_instance(element)) ++groups_[&group_of(element)].instances;
  for (const XmlElement& element : root_.children) add_element(element);
  Parameters(root_, scene_.warnings)
      .finish({"integrator", "sensor", "emitter", "shape", "bsdf", "subsurface", "texture"});

  for (const XmlElement& element : root_.children)
    if (is_group(element) && !groups_.contains(&element)) check_unused_group(element);
  if (scene_.shapes.empty()) fail(ErrorCode::kValue, scene_.path, "the scene has no <shape> to be seen");
  // Surfaces and media enter the scene with the first shape that uses them; the others are only checked.
  for (const XmlElement& element : root_.children) {
    if (element.tag == "texture") texture_index(element);
    if (element.tag == "bsdf" && !surfaces_.contains(&element)) read_surface_of(element);
    if (element.tag == "subsurface" && !media_.contains(&element)) {
      read_medium_of(element);
      warn(element.place(), fmt::format("no shape uses the subsurface '{}'", element.get("id")));
    }
  }
  if (scene_.lights.empty()) warn(scene_.path, "the scene has no <emitter>: pictures will be black");
  if (scene_.cameras.empty()) add_default_camera();
}

void Builder::add_element(const XmlElement& element) {
  if (element.tag == "shape") {
    if (is_instance(element)) add_instance(element);
    if (!is_instance(element) && !is_group(element)) add_shape(element);
  } else if (element.tag == "emitter") {
    add_light(read_light(element, scene_.warnings));
  } else if (element.tag == "sensor") {
    add_sensor(element);
  } else if (element.tag == "integrator") {
    if (has_integrator_) fail(ErrorCode::kSyntax, element.place(), "a second <integrator>");
    has_integrator_ = true;
    scene_.integrator = read_integrator(element, scene_.warnings);
  }
}

void Builder::add_light(Light light) {
  if (is_environment(light)) {
    const auto first = std::ranges::find_if(scene_.lights, is_environment);
    if (first != scene_.lights.end())
      fail(ErrorCode::kValue, light.place, "a second light all around; the first is at {}", first->place);
  }
  scene_.lights.push_back(std::move(light));
}

void Builder::add_sensor(const XmlElement& element) {
  SensorElement sensor = read_sensor(element, scene_.warnings);
  if (sensor.camera.id.empty()) sensor.camera.id = fmt::format("camera {}", scene_.cameras.size() + 1);
  const int count = sensor.samples_per_pixel;
  if (count > 0 && has_sample_count_ && count != scene_.samples_per_pixel)
    warn(element.place(), fmt::format("sampleCount {} is ignored, the first sensor's {} is used for all",
                                      count, scene_.samples_per_pixel));
  if (count > 0 && !has_sample_count_) {
    scene_.samples_per_pixel = count;
    has_sample_count_ = true;
  }
  scene_.cameras.push_back(std::move(sensor.camera));
  scene_.films.push_back(sensor.film);
}

int Builder::surface_index(const XmlElement& element) {
  const auto [found, is_new] = surfaces_.emplace(&element, static_cast<int>(scene_.surfaces.size()));
  if (is_new) scene_.surfaces.push_back(read_surface_of(element));
  return found->second;
}

Surface Builder::read_surface_of(const XmlElement& element) {
  return read_surface(
      element, [this](const XmlElement& ref) -> const XmlElement& { return resolve(ref); },
      [this](const XmlElement& texture) { return texture_index(texture); }, scene_.warnings);
}

MediumElement Builder::read_medium_of(const XmlElement& element) {
  return read_medium(
      element, [this](const XmlElement& texture) { return texture_index(texture); }, scene_.warnings);
}

int Builder::texture_index(const XmlElement& element) {
  const XmlElement& texture = element.tag == "ref" ? resolve(element) : element;
  if (texture.tag != "texture")
    fail(ErrorCode::kUnsupported, element.place(), "'{}' is a <{}>; {} has to be a colour or a <texture>",
         element.get("id"), texture.tag, element.get("name"));
  const auto [found, is_new] = textures_.emplace(&texture, static_cast<int>(scene_.textures.size()));
  if (is_new) scene_.textures.push_back(read_texture(texture, scene_.warnings));
  return found->second;
}

int Builder::medium_index(const XmlElement& element) {
  const auto [found, is_new] = media_.emplace(&element, static_cast<int>(scene_.media.size()));
  if (is_new) {
    MediumElement read = read_medium_of(element);
    scene_.media.push_back(std::move(read.medium));
    scene_.subsurface.push_back(read.settings);
  }
  return found->second;
}

// As in Mitsuba: what emits and has no bsdf reflects nothing, everything else is half grey.
int Builder::add_default_surface(const std::string& place, bool emits) {
  scene_.surfaces.push_back({"", place, DiffuseSurface{Rgb(emits ? 0.0f : 0.5f)}});
  return static_cast<int>(scene_.surfaces.size()) - 1;
}

void Builder::add_shape(const XmlElement& element) {
  const std::size_t index = scene_.shapes.size();
  std::optional<Light> light = read_light_of(element, static_cast<std::uint32_t>(index));
  Shape shape = read_shape(element, index + 1, light.has_value());
  if (light) {
    shape.light = static_cast<int>(scene_.lights.size());
    scene_.lights.push_back(std::move(*light));
  }
  budget_.charge(shape.mesh.triangles.size(), 1, element.place());
  scene_.shapes.push_back(std::move(shape));
}

std::optional<Light> Builder::read_light_of(const XmlElement& shape, std::uint32_t index) {
  std::optional<Light> light;
  for (const XmlElement& child : shape.children) {
    if (child.tag != "emitter") continue;
    if (light) fail(ErrorCode::kSyntax, child.place(), "a second <emitter> in one shape");
    light = read_area_light(child, index, scene_.warnings);
    if (light->id.empty()) light->id = shape.get("id");
  }
  return light;
}

// Without its light. `number` gives a name to one that has no id.
Shape Builder::read_shape(const XmlElement& element, std::size_t number, bool emits) {
  Shape shape;
  shape.id = element.has("id") ? element.get("id") : fmt::format("shape {}", number);
  shape.type = plugin_type(element);
  shape.place = element.place();
  for (const XmlElement& child : element.children) {
    const XmlElement& target = child.tag == "ref" ? resolve(child) : child;
    const auto set_once = [&](bool is_set) {
      if (is_set) fail(ErrorCode::kSyntax, child.place(), "a second <{}> in one shape", target.tag);
    };
    if (target.tag == "bsdf") {
      set_once(shape.surface != kNone);
      shape.surface = surface_index(target);
    } else if (target.tag == "subsurface") {
      set_once(shape.medium != kNone);
      shape.medium = medium_index(target);
    } else if (child.tag == "ref") {
      fail(ErrorCode::kUnsupported, child.place(),
           "'{}' is {} <{}>; a shape can refer to a <bsdf> or a <subsurface>", child.get("id"),
           target.tag.starts_with('e') || target.tag.starts_with('i') ? "an" : "a", target.tag);
    }
  }
  shape.mesh =
      read_mesh(element, scene_.warnings, [&](std::size_t made, std::size_t read, const std::string& place) {
        budget_.charge_subdivision(made, read, place);
      });
  if (!is_mesh_file(shape.type)) budget_.charge_built_in(shape.mesh.triangles.size(), shape.place);
  if (shape.surface == kNone && shape.medium == kNone)
    shape.surface = add_default_surface(shape.place, emits);
  warn_about_textures(shape);
  if (shape.medium != kNone) warn_about_shape(shape);
  return shape;
}

// The shapes of a shapegroup in its own space.
std::vector<Shape> Builder::read_group(const XmlElement& group) {
  std::vector<Shape> shapes;
  for (const XmlElement& element : group.children) {
    if (element.tag != "shape") continue;
    if (is_group(element) || is_instance(element))
      fail(ErrorCode::kUnsupported, element.place(), "a shape '{}' inside a shapegroup is not supported",
           element.get("type"));
    for (const XmlElement& child : element.children)
      if (child.tag == "emitter")
        fail(ErrorCode::kUnsupported, child.place(),
             "instancing of emitters is not supported: move the emitting shape out of the shapegroup");
    shapes.push_back(read_shape(element, shapes.size() + 1, false));
    budget_.charge(shapes.back().mesh.triangles.size(), 1, element.place());
  }
  Parameters(group, scene_.warnings).finish({"shape"});
  if (shapes.empty()) fail(ErrorCode::kSyntax, group.place(), "a shapegroup needs a <shape> inside");
  return shapes;
}

const XmlElement& Builder::group_of(const XmlElement& instance) const {
  const XmlElement* group = nullptr;
  for (const XmlElement& child : instance.children) {
    if (child.tag != "ref") continue;
    if (group) fail(ErrorCode::kSyntax, child.place(), "a second <ref> in one instance");
    group = &resolve(child);
    if (!is_group(*group))
      fail(ErrorCode::kUnsupported, child.place(),
           "'{}' is no shapegroup, which is what an instance refers to", child.get("id"));
  }
  if (!group) fail(ErrorCode::kSyntax, instance.place(), "an instance needs a <ref> to a shapegroup");
  return *group;
}

void Builder::add_instance(const XmlElement& element) {
  const XmlElement& group_element = group_of(element);
  Group& group = groups_.at(&group_element);
  if (group.placed++ == 0) {
    const std::size_t made = budget_.made(), built_in = budget_.built_in();
    group.shapes = read_group(group_element);
    budget_.charge_copies(group.instances, budget_.made() - made, element.place());
    // All instances at once, before any is there.
    std::size_t triangles = 0;
    for (const Shape& shape : group.shapes) triangles += shape.mesh.triangles.size();
    budget_.charge(group.instances * triangles, group.instances * group.shapes.size(), element.place());
    budget_.charge_built_in((group.instances - 1) * (budget_.built_in() - built_in), element.place());
  }
  Parameters parameters(element, scene_.warnings);
  const Matrix4 to_world = parameters.transform("toWorld");
  parameters.finish({"ref"});
  for (const Shape& original : group.shapes) {
    Shape shape = original;
    shape.id = fmt::format("{}/{}#{}", group_element.get("id"), original.id, group.placed);
    shape.place = element.place();
    place_mesh(shape.mesh, to_world, parameters.place("toWorld"), element.place());
    scene_.shapes.push_back(std::move(shape));
  }
}

// Nothing of a group that is nowhere in the scene enters it; what is wrong with it is said all the same.
void Builder::check_unused_group(const XmlElement& group) {
  Scene scratch;
  scratch.path = scene_.path;
  Builder(scratch, root_).read_group(group);
  std::ranges::move(scratch.warnings, std::back_inserter(scene_.warnings));
  warn(group.place(), fmt::format("no instance uses the shapegroup '{}'", group.get("id")));
}

void Builder::warn_about_shape(const Shape& shape) {
  const TopologyReport report = analyse_topology(shape.mesh);
  const std::string problems = describe_problems(report);
  if (!problems.empty())
    warn(shape.place,
         fmt::format("{} is translucent, but {}{}", shape.id, problems, advise_on_borders(report)));
  if (shape.surface == kNone) return;
  const auto& model = scene_.surfaces[static_cast<std::size_t>(shape.surface)].model;
  if (std::holds_alternative<ConductorSurface>(model))
    fail(ErrorCode::kValue, shape.place, "{}: no light passes a conductor into a medium; remove one of them",
         shape.id);
  const float eta = scene_.media[static_cast<std::size_t>(shape.medium)].eta();
  const auto check_index = [&](const char* type, float int_ior, float ext_ior) {
    if (std::abs(int_ior / ext_ior - eta) > 1e-3f)
      warn(shape.place, fmt::format("{}: the boundary has the relative index {:.4g} of the subsurface, the "
                                    "{:.4g} of the {} is ignored",
                                    shape.id, eta, int_ior / ext_ior, type));
  };
  if (const auto* glass = std::get_if<DielectricSurface>(&model))
    check_index("dielectric", glass->int_ior, glass->ext_ior);
  if (const auto* plastic = std::get_if<PlasticSurface>(&model))
    check_index("plastic", plastic->int_ior, plastic->ext_ior);
}

void Builder::warn_about_textures(const Shape& shape) {
  SurfaceTextures used;
  if (shape.surface != kNone) used = scene_.surfaces[static_cast<std::size_t>(shape.surface)].textures;
  const int albedo = shape.medium == kNone
                         ? kNone
                         : scene_.subsurface[static_cast<std::size_t>(shape.medium)].albedo_texture;
  const int any = std::max({used.diffuse, used.specular_reflectance, used.specular_transmittance, albedo});
  if (any != kNone && shape.mesh.uvs.empty())
    warn(shape.place,
         fmt::format("{} has a texture and no texture coordinates: every triangle shows the corner "
                     "of it below the diagonal",
                     shape.id));
}

// In front of the translucent shapes, else of those that do not emit.
void Builder::add_default_camera() {
  Box3 translucent, opaque, all;
  for (const Shape& shape : scene_.shapes) {
    const Box3 box = bounds(shape.mesh);
    all.extendBy(box);
    if (shape.medium != kNone) translucent.extendBy(box);
    if (shape.light == kNone) opaque.extendBy(box);
  }
  const Box3& box = !translucent.isEmpty() ? translucent : !opaque.isEmpty() ? opaque : all;
  const Film film;
  Camera camera = make_framing_camera(box, {-0.3, -0.25, -1}, kDefaultFov, film);
  camera.id = "camera 1";
  camera.place = scene_.path;
  scene_.cameras.push_back(std::move(camera));
  scene_.films.push_back(film);
  warn(scene_.path, "the scene has no <sensor>: a camera is placed in front of it");
}

}  // namespace

Scene load_scene(const std::string& path, const Defines& defines, SceneFiles files) {
  Scene scene;
  scene.path = path;
  SceneXml xml = load_scene_xml(path, defines, scene.warnings, files);
  Builder(scene, xml.scene).build();
  scene.sources = std::move(xml.sources);
  scene.files = std::move(xml.files);
  return scene;
}

}  // namespace nacre
