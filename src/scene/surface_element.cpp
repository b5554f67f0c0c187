// <bsdf>: diffuse, dielectric, plastic.
#include "scene/elements.h"
#include "scene/parameters.h"

namespace nacre {

Surface read_surface(const XmlElement& element, Warnings& warnings) {
  Parameters parameters(element, warnings);
  Surface surface{element.get("id"), element.place(), DiffuseSurface{}};
  const Rgb white{1, 1, 1}, grey{0.5f, 0.5f, 0.5f};
  const std::string type = plugin_type(element);
  if (type == "diffuse") {
    // Mitsuba knows the parameter by two names.
    const bool long_name = !parameters.has("reflectance") && parameters.has("diffuseReflectance");
    surface.model =
        DiffuseSurface{parameters.color(long_name ? "diffuseReflectance" : "reflectance", grey, kFraction)};
  } else if (type == "dielectric") {
    surface.model = DielectricSurface{parameters.ior("intIOR", "bk7"), parameters.ior("extIOR", "air"),
                                      parameters.color("specularReflectance", white, kFraction),
                                      parameters.color("specularTransmittance", white, kFraction)};
  } else if (type == "plastic") {
    surface.model = PlasticSurface{parameters.ior("intIOR", "polypropylene"), parameters.ior("extIOR", "air"),
                                   parameters.color("diffuseReflectance", grey, kFraction),
                                   parameters.color("specularReflectance", white, kFraction),
                                   parameters.boolean("nonlinear", false)};
  } else {
    fail_unknown_type(element, "diffuse, dielectric, plastic");
  }
  parameters.finish();
  return surface;
}

}  // namespace nacre
