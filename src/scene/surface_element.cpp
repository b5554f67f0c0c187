// <bsdf>: diffuse, and smooth and rough dielectric, plastic, conductor; twosided.
#include "scene/conductors.h"
#include "scene/elements.h"

namespace nacre {
namespace {

const Rgb kWhite{1, 1, 1}, kGrey{0.5f, 0.5f, 0.5f};

// Reads one bsdf that is not an adapter around another.
class SurfaceReader {
 public:
  SurfaceReader(const XmlElement& element, const TextureIndex& textures, Warnings& warnings)
      : element_(element), textures_(textures), warnings_(warnings), parameters_(element, warnings) {}

  Surface read() {
    surface_.id = element_.get("id");
    surface_.place = element_.place();
    std::string type = plugin_type(element_);
    const bool rough = type.starts_with("rough");
    if (rough) type.erase(0, 5);
    if (type == "diffuse" && !rough)
      surface_.model = read_diffuse();
    else if (type == "dielectric")
      surface_.model = read_dielectric(rough);
    else if (type == "plastic")
      surface_.model = read_plastic(rough);
    else if (type == "conductor")
      surface_.model = read_conductor(rough);
    else
      fail_unknown_type(element_,
                        "diffuse, dielectric, roughdielectric, plastic, roughplastic, conductor, "
                        "roughconductor, twosided");
    parameters_.finish();
    return std::move(surface_);
  }

 private:
  Rgb color(std::string_view name, const Rgb& fallback, int& texture) {
    const ColorOrTexture read = parameters_.color_or_texture(name, fallback, kFraction, textures_);
    texture = read.texture;
    return read.color;
  }
  Rgb specular_reflectance() {
    return color("specularReflectance", kWhite, surface_.textures.specular_reflectance);
  }

  DiffuseSurface read_diffuse() {
    // Mitsuba knows the parameter by two names.
    const bool long_name = !parameters_.has("reflectance") && parameters_.has("diffuseReflectance");
    return {color(long_name ? "diffuseReflectance" : "reflectance", kGrey, surface_.textures.diffuse)};
  }

  DielectricSurface read_dielectric(bool rough) {
    DielectricSurface model;
    model.int_ior = parameters_.ior("intIOR", "bk7");
    model.ext_ior = parameters_.ior("extIOR", "air");
    model.specular_reflectance = specular_reflectance();
    model.specular_transmittance =
        color("specularTransmittance", kWhite, surface_.textures.specular_transmittance);
    if (rough) model.roughness = read_roughness(true);
    return model;
  }

  PlasticSurface read_plastic(bool rough) {
    PlasticSurface model;
    model.int_ior = parameters_.ior("intIOR", "polypropylene");
    model.ext_ior = parameters_.ior("extIOR", "air");
    model.diffuse_reflectance = color("diffuseReflectance", kGrey, surface_.textures.diffuse);
    model.specular_reflectance = specular_reflectance();
    model.nonlinear = parameters_.boolean("nonlinear", false);
    if (rough) model.roughness = read_roughness(false);
    return model;
  }

  ConductorSurface read_conductor(bool rough) {
    constexpr Range kIndex{0, 1000};
    const std::string name = parameters_.string("material", "Cu");
    const Conductor* metal = find_conductor(name);
    if (!metal)
      fail(ErrorCode::kValue, parameters_.place("material"), "there is no metal '{}'; there is {}", name,
           conductor_names());
    ConductorSurface model;
    const float outside = parameters_.ior("extEta", "air");
    model.eta = parameters_.color("eta", metal->eta, kIndex) / outside;
    model.k = parameters_.color("k", metal->k, kIndex) / outside;
    model.specular_reflectance = specular_reflectance();
    if (rough) model.roughness = read_roughness(true);
    return model;
  }

  Roughness read_roughness(bool anisotropic) {
    const std::string place = parameters_.place("distribution");
    if (parameters_.choice("distribution", {"ggx", "beckmann"}) == 1)
      warnings_.push_back(place + ": distribution 'beckmann' is rendered as 'ggx'");
    parameters_.boolean("sampleVisible", true);
    const float alpha = parameters_.number("alpha", 0.1f, kFraction);
    if (!anisotropic) return {alpha, alpha};
    return {parameters_.number("alphaU", alpha, kFraction), parameters_.number("alphaV", alpha, kFraction)};
  }

  const XmlElement& element_;
  const TextureIndex& textures_;
  Warnings& warnings_;
  Parameters parameters_;
  Surface surface_{};
};

Surface read_two_sided(const XmlElement& element, const Resolve& resolve, const TextureIndex& textures,
                       Warnings& warnings) {
  const XmlElement* inner = nullptr;
  for (const XmlElement& child : element.children) {
    const XmlElement& target = child.tag == "ref" ? resolve(child) : child;
    if (target.tag != "bsdf")
      fail(ErrorCode::kSyntax, child.place(), "<{}> cannot stand inside bsdf 'twosided', only one <bsdf>",
           target.tag);
    if (inner)
      fail(ErrorCode::kUnsupported, child.place(),
           "twosided with a second bsdf for the back is not supported: use two shapes");
    inner = &target;
  }
  if (!inner) fail(ErrorCode::kSyntax, element.place(), "twosided needs a <bsdf> inside");
  if (plugin_type(*inner) == "twosided")
    fail(ErrorCode::kValue, inner->place(), "a twosided bsdf inside another one");
  Surface surface = SurfaceReader(*inner, textures, warnings).read();
  if (std::holds_alternative<DielectricSurface>(surface.model))
    fail(ErrorCode::kValue, inner->place(), "a {} lets light through and has two sides already",
         inner->get("type"));
  surface.id = element.get("id");
  surface.place = element.place();
  surface.two_sided = true;
  return surface;
}

}  // namespace

Surface read_surface(const XmlElement& element, const Resolve& resolve, const TextureIndex& textures,
                     Warnings& warnings) {
  if (plugin_type(element) == "twosided") return read_two_sided(element, resolve, textures, warnings);
  return SurfaceReader(element, textures, warnings).read();
}

}  // namespace nacre
