// Making and comparing fingerprints.
#include "nacre/cache/fingerprint.h"

#include <fmt/format.h>
#include <xxhash.h>

#include <algorithm>
#include <charconv>
#include <memory>

namespace nacre {
namespace {

constexpr const char *kShadowsKey = "shadows", *kInterreflectionKey = "interreflection";

using HashState = std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)>;

HashState make_hash() {
  HashState state(XXH3_createState(), &XXH3_freeState);
  if (!state) throw std::bad_alloc();
  XXH3_128bits_reset(state.get());
  return state;
}

std::string digest(const HashState& state) {
  const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

std::string hash_geometry(const Mesh& mesh, bool with_normals, bool with_uvs) {
  const HashState state = make_hash();
  const std::uint64_t counts[2] = {mesh.positions.size(), mesh.triangles.size()};
  XXH3_128bits_update(state.get(), counts, sizeof counts);
  XXH3_128bits_update(state.get(), mesh.positions.data(), mesh.positions.size() * sizeof(Vec3));
  XXH3_128bits_update(state.get(), mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle));
  if (with_normals) XXH3_128bits_update(state.get(), mesh.normals.data(), mesh.normals.size() * sizeof(Vec3));
  if (with_uvs) XXH3_128bits_update(state.get(), mesh.uvs.data(), mesh.uvs.size() * sizeof(Vec2));
  return digest(state);
}

std::string hash_picture(const Bitmap& picture) {
  const HashState state = make_hash();
  const int size[2] = {picture.width, picture.height};
  XXH3_128bits_update(state.get(), size, sizeof size);
  XXH3_128bits_update(state.get(), picture.texels.data(), picture.texels.size() * sizeof(Rgb));
  return digest(state);
}

std::string text(const Vec3& v) { return fmt::format("{} {} {}", v.x, v.y, v.z); }

std::string text(const Rgb& color, const Roughness& roughness) {
  return fmt::format("{} {} {}", text(color), roughness.u, roughness.v);
}

std::string text(const CheckerboardTexture& texture) {
  return fmt::format("checkerboard {} {}", text(texture.color0), text(texture.color1));
}
std::string text(const BitmapTexture& texture) {
  const HashState state = make_hash();
  const std::vector<Rgb>& texels = texture.bitmap.texels;
  XXH3_128bits_update(state.get(), texels.data(), texels.size() * sizeof(Rgb));
  return fmt::format("bitmap {} {} {} {} {} {}", texture.bitmap.width, texture.bitmap.height, digest(state),
                     static_cast<int>(texture.wrap_u), static_cast<int>(texture.wrap_v), texture.nearest);
}
std::string text(const Texture& texture) {
  return fmt::format("{} {} {} {} {}",
                     std::visit([](const auto& model) { return text(model); }, texture.model),
                     texture.scale.x, texture.scale.y, texture.offset.x, texture.offset.y);
}

// A surface of the kinds and the plainness that the first caches knew keeps their words.
std::string text(const DiffuseSurface& surface) { return "diffuse " + text(surface.reflectance); }
std::string text(const DielectricSurface& surface) {
  return fmt::format("dielectric {} {} {} {}", text(surface.specular_reflectance, surface.roughness),
                     text(surface.specular_transmittance), surface.int_ior, surface.ext_ior);
}
std::string text(const PlasticSurface& surface) {
  std::string plastic = fmt::format("plastic {} {} {} {}", text(surface.diffuse_reflectance), surface.int_ior,
                                    surface.ext_ior, surface.nonlinear);
  if (surface.roughness.u == 0 && surface.roughness.v == 0) return plastic;
  return "rough" + plastic + " " + text(surface.specular_reflectance, surface.roughness);
}
std::string text(const ConductorSurface& surface) {
  return fmt::format("conductor {} {} {}", text(surface.eta), text(surface.k),
                     text(surface.specular_reflectance, surface.roughness));
}

class Fingerprinter {
 public:
  Fingerprinter(const Scene& scene, const BakeConditions& conditions)
      : scene_(scene), bounces_(conditions.bounces), conditions_(conditions) {}

  KeyValues make() {
    add(kShadowsKey, conditions_.shadows ? "yes" : "no");
    if (conditions_.interreflect) add(kInterreflectionKey, "yes");
    for (std::size_t m = 0; m < scene_.media.size(); ++m) {
      const std::string name = "medium " + medium_name(scene_, m);
      if (!conditions_.every_eta) add(name + "/eta", fmt::format("{}", scene_.media[m].eta()));
      add(name + "/bounces", fmt::format("{}", bounces_[m]));
      add_entry_albedo(name, m);
      if (conditions_.interreflect) add_coefficients(name, scene_.media[m]);
    }
    for (const Shape& shape : scene_.shapes) {
      if (casts_no_light(shape)) continue;
      const std::string name = "shape " + shape.id;
      // Samples lie on the faces and have their normals; light bounces off the smooth normals.
      const bool reflects = bounce_matters() && shape.medium == kNone;
      add(name + "/geometry", hash_geometry(shape.mesh, reflects, has_texture(shape, reflects)));
      add(name + "/medium",
          shape.medium == kNone ? "none" : medium_name(scene_, static_cast<std::size_t>(shape.medium)));
      if (reflects || (conditions_.shadows && lets_light_through(shape))) add_surface(name, shape);
    }
    // How lights are chosen for sampling decides about noise alone.
    for (std::size_t i = 0; i < scene_.lights.size(); ++i) {
      name_ = "light " + light_name(scene_, i);
      std::visit([&](const auto& light) { add_light(light); }, scene_.lights[i].model);
    }
    return std::move(result_);
  }

 private:
  void add(const std::string& key, std::string value) {
    // Shapes and lights may share an id with others; a repeated key still has to be told apart.
    std::string unique = key;
    for (int n = 2;
         std::any_of(result_.begin(), result_.end(), [&](const auto& e) { return e.first == unique; }); ++n)
      unique = fmt::format("{} ({})", key, n);
    result_.emplace_back(std::move(unique), std::move(value));
  }
  bool bounce_matters() const {
    return std::any_of(bounces_.begin(), bounces_.end(), [](int b) { return b > 0; });
  }
  // Without shadows and bounces an opaque shape that does not shine leaves no trace in the cache.
  bool casts_no_light(const Shape& shape) const {
    return shape.medium == kNone && shape.light == kNone && !conditions_.shadows && !bounce_matters();
  }
  // What light passes straight on its way to samples, and is attenuated by.
  bool lets_light_through(const Shape& shape) const {
    return shape.medium == kNone && shape.surface != kNone &&
           std::holds_alternative<DielectricSurface>(
               scene_.surfaces[static_cast<std::size_t>(shape.surface)].model);
  }
  void add_coefficients(const std::string& name, const Medium& medium) {
    add(name + "/coefficients",
        fmt::format("{} {} {} {} {} {}", text(medium.sigma_s), text(medium.sigma_a), text(medium.g),
                    medium.scale, static_cast<int>(medium.profile), static_cast<int>(medium.convention)));
  }
  void add_surface(const std::string& name, const Shape& shape) {
    if (shape.surface == kNone) return add(name + "/surface", "default");
    const Surface& surface = scene_.surfaces[static_cast<std::size_t>(shape.surface)];
    const std::string model = std::visit([](const auto& m) { return text(m); }, surface.model);
    add(name + "/surface", model + (surface.two_sided ? " twosided" : ""));
    const SurfaceTextures& t = surface.textures;
    add_texture(name + "/diffuse_texture", t.diffuse);
    add_texture(name + "/specular_reflectance_texture", t.specular_reflectance);
    add_texture(name + "/specular_transmittance_texture", t.specular_transmittance);
  }
  void add_texture(const std::string& key, int texture) {
    if (texture != kNone) add(key, text(scene_.textures[static_cast<std::size_t>(texture)]));
  }
  // What colours light on its way in; white surfaces have no entry.
  void add_entry_albedo(const std::string& name, std::size_t medium) {
    if (medium >= scene_.subsurface.size()) return;
    const SubsurfaceSettings& s = scene_.subsurface[medium];
    if (s.albedo_texture == kNone && s.surface_albedo == Rgb(1, 1, 1)) return;
    add(name + "/surface_albedo", fmt::format("{} {}", text(s.surface_albedo), s.albedo_at_entry));
    add_texture(name + "/albedo_texture", s.albedo_texture);
  }
  bool has_texture(const Shape& shape, bool reflects) const {
    const auto at = [](int index) { return static_cast<std::size_t>(index); };
    if (shape.medium != kNone)
      return at(shape.medium) < scene_.subsurface.size() &&
             scene_.subsurface[at(shape.medium)].albedo_texture != kNone;
    if (!reflects || shape.surface == kNone) return false;
    const SurfaceTextures& t = scene_.surfaces[at(shape.surface)].textures;
    return std::max({t.diffuse, t.specular_reflectance, t.specular_transmittance}) != kNone;
  }
  void add_light(const PointLight& light) {
    add(name_ + "/position", text(light.position));
    add(name_ + "/intensity", text(light.intensity));
  }
  void add_light(const DirectionalLight& light) {
    add(name_ + "/direction", text(light.direction));
    add(name_ + "/irradiance", text(light.irradiance));
  }
  void add_light(const SpotLight& light) {
    add(name_ + "/position", text(light.position));
    add(name_ + "/direction", text(light.direction));
    add(name_ + "/intensity", text(light.intensity));
    add(name_ + "/angles", fmt::format("{} {}", light.cutoff_angle, light.beam_width));
  }
  void add_light(const ConstantLight& light) { add(name_ + "/radiance", text(light.radiance)); }
  void add_light(const EnvironmentMap& light) {
    add(name_ + "/map", hash_picture(light.radiance));
    const Matrix4& m = light.to_world;
    add(name_ + "/rotation", fmt::format("{} {} {} {} {} {} {} {} {}", m[0][0], m[0][1], m[0][2], m[1][0],
                                         m[1][1], m[1][2], m[2][0], m[2][1], m[2][2]));
  }
  void add_light(const AreaLight& light) {
    add(name_ + "/shape", scene_.shapes[light.shape].id);
    add(name_ + "/radiance", text(light.radiance));
  }

  const Scene& scene_;
  std::span<const int> bounces_;
  const BakeConditions& conditions_;
  std::string name_;
  KeyValues result_;
};

const std::string* find_value(const KeyValues& entries, const std::string& key) {
  for (const auto& [k, v] : entries)
    if (k == key) return &v;
  return nullptr;
}

// Whether a key is of that kind: "medium wax/bounces", or "medium wax/bounces (2)" of another one of that
// name.
bool is_kind(const std::string& key, const std::string& kind) {
  return key.ends_with(kind) || key.find(kind + " (") != key.npos;
}

}  // namespace

KeyValues make_fingerprint(const Scene& scene, const BakeConditions& conditions) {
  return Fingerprinter(scene, conditions).make();
}

BakeConditions fingerprint_conditions(const KeyValues& fingerprint, std::size_t groups) {
  BakeConditions conditions;
  conditions.every_eta = true;
  for (const auto& [key, value] : fingerprint) {
    if (key == kShadowsKey) conditions.shadows = value == "yes";
    if (key == kInterreflectionKey) conditions.interreflect = true;
    if (key.starts_with("medium ") && is_kind(key, "/eta")) conditions.every_eta = false;
    if (is_kind(key, "/bounces")) {
      int count = 0;
      std::from_chars(value.data(), value.data() + value.size(), count);
      conditions.bounces.push_back(std::max(0, count));
    }
  }
  conditions.bounces.resize(groups, 0);
  return conditions;
}

std::string contents_digest(const Scene& scene) {
  KeyValues contents;
  for (const Shape& shape : scene.shapes)
    contents.emplace_back("mesh", hash_geometry(shape.mesh, true, true));
  for (const Texture& texture : scene.textures) contents.emplace_back("texture", text(texture));
  return fingerprint_digest(contents);
}

std::string samples_digest(const CacheGroup& group) {
  const HashState state = make_hash();
  for (const auto& plane : group.planes) XXH3_128bits_update(state.get(), plane.data(), plane.size_bytes());
  XXH3_128bits_update(state.get(), group.nodes.data(), group.nodes.size_bytes());
  return digest(state);
}

std::string bytes_digest(std::string_view bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

std::string fingerprint_digest(const KeyValues& fingerprint) {
  const HashState state = make_hash();
  for (const auto& [key, value] : fingerprint) {
    XXH3_128bits_update(state.get(), key.c_str(), key.size() + 1);
    XXH3_128bits_update(state.get(), value.c_str(), value.size() + 1);
  }
  return digest(state);
}

std::string describe_mismatch(const KeyValues& cached, const KeyValues& current) {
  std::string differences;
  int count = 0;
  const auto note = [&](const std::string& difference) {
    if (++count <= 3) differences += (count > 1 ? "; " : "") + difference;
  };
  for (const auto& [key, value] : cached) {
    const std::string* now = find_value(current, key);
    if (!now)
      note(key + " is gone");
    else if (*now != value)
      note(is_kind(key, "/geometry") ? key + " has changed"
                                     : fmt::format("{} was {} and is {}", key, value, *now));
  }
  for (const auto& [key, value] : current)
    if (!find_value(cached, key))
      note(is_kind(key, "/geometry") ? key + " is new" : fmt::format("{} is new ({})", key, value));
  if (count > 3) differences += fmt::format("; and {} more", count - 3);
  return differences;
}

}  // namespace nacre
