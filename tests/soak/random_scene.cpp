// The text of a scene, element by element.
#include "soak/random_scene.h"

#include <fmt/format.h>

#include <fstream>

#include "nacre/optics/medium.h"
#include "nacre/render/image_file.h"
#include "soak/dice.h"
#include "soak/random_mesh.h"

namespace nacre::soak {
namespace {

class Writer {
 public:
  Writer(std::uint64_t seed, std::string folder) : dice_(seed), folder_(std::move(folder)) {}
  std::string scene();

 private:
  std::string number(const char* name, double value) {
    return fmt::format("<float name=\"{}\" value=\"{:.7g}\"/>", name, value);
  }
  std::string rgb(const char* name, double low, double high) {
    return fmt::format("<rgb name=\"{}\" value=\"{:.6g}, {:.6g}, {:.6g}\"/>", name, dice_.uniform(low, high),
                       dice_.uniform(low, high), dice_.uniform(low, high));
  }
  std::string log_rgb(const char* name, double low, double high) {
    return fmt::format("<rgb name=\"{}\" value=\"{:.6g}, {:.6g}, {:.6g}\"/>", name,
                       dice_.log_uniform(low, high), dice_.log_uniform(low, high),
                       dice_.log_uniform(low, high));
  }
  std::string triple(double range) {
    return fmt::format("{:.6g}, {:.6g}, {:.6g}", dice_.uniform(-range, range), dice_.uniform(-range, range),
                       dice_.uniform(-range, range));
  }
  std::string placement(double size, double range) {
    std::string text = "<transform name=\"toWorld\">";
    if (dice_.chance(0.3))
      text += fmt::format("<scale x=\"{:.5g}\" y=\"{:.5g}\" z=\"{:.5g}\"/>", dice_.uniform(0.4, 1.5),
                          dice_.uniform(0.4, 1.5), dice_.uniform(0.4, 1.5) * (dice_.chance(0.2) ? -1 : 1));
    return text + fmt::format(
                      "<scale value=\"{:.6g}\"/><rotate x=\"{:.4g}\" y=\"1\" z=\"{:.4g}\" angle=\"{:.5g}\"/>"
                      "<translate value=\"{}\"/></transform>",
                      size, dice_.uniform(-1, 1), dice_.uniform(-1, 1), dice_.uniform(-180, 180),
                      triple(range));
  }
  std::string medium();
  std::string body(double size, const std::string& medium);
  std::string surface(bool over_medium);
  std::string lights();
  std::string camera(int index);
  void write_sky(const std::string& name);

  Dice dice_;
  std::string folder_;
  double unit_ = 1;    // size of the scene in its own units
  double length_ = 1;  // mean free paths across a unit, about
};

// Between a few and some hundreds of mean free paths across.
std::string Writer::medium() {
  const double mean_free_path = length_;
  std::string text = number("scale", 1 / unit_);  // coefficients are per size of the scene
  if (dice_.chance(0.4)) text += number("g", dice_.uniform(-0.4, 0.9));
  const int kind = dice_.integer(0, 3);
  if (kind == 0) {
    text += log_rgb("sigmaS", 0.7 / mean_free_path, 1.5 / mean_free_path);
    text += dice_.chance(0.25)
                ? std::string("<rgb name=\"sigmaA\" value=\"0\"/>")
                : log_rgb("sigmaA", 1e-5 / mean_free_path, dice_.one_of({0.1, 1.0, 10.0}) / mean_free_path);
  } else if (kind == 1) {
    text += log_rgb("sigmaT", 0.7 / mean_free_path, 1.5 / mean_free_path);
    text += dice_.chance(0.2) ? "<rgb name=\"albedo\" value=\"1\"/>" : rgb("albedo", 0.1, 1);
  } else if (kind == 2) {
    text += rgb("diffuseReflectance", 0.02, 0.95) +
            log_rgb("meanFreePath", mean_free_path * 0.5, mean_free_path * 2);
  } else {
    // Of a measured material only the proportions: it is as many mm across as it takes.
    const Preset& preset =
        presets()[static_cast<std::size_t>(dice_.integer(0, static_cast<int>(presets().size()) - 1))];
    const Medium m = make_medium(preset);
    text = number("scale", static_cast<double>(smallest_mean_free_path(m)) / (mean_free_path * unit_));
    text += fmt::format("<string name=\"material\" value=\"{}\"/>", preset.name);
  }
  if (dice_.chance(0.7)) text += number("intIOR", dice_.uniform(1.0, 1.9)) + number("extIOR", 1);
  if (dice_.chance(0.6))
    text += fmt::format("<string name=\"profile\" value=\"{}\"/>",
                        dice_.one_of({"dipole", "betterdipole", "normalized"}));
  if (dice_.chance(0.2)) text += "<string name=\"convention\" value=\"conserving\"/>";
  const double albedo = dice_.uniform(0, 1);
  if (albedo < 0.2) text += rgb("surfaceAlbedo", 0, 1);
  if (albedo > 0.9) text += "<texture type=\"checkerboard\" name=\"surfaceAlbedo\"/>";
  return text;
}

std::string Writer::surface(bool over_medium) {
  const std::string rough = dice_.chance(0.5) ? "rough" : "";
  const std::string roughness = rough.empty() ? "" : number("alpha", dice_.uniform(0, 0.6));
  switch (dice_.integer(0, over_medium ? 1 : 4)) {
    case 0:
      return over_medium ? "" : "<bsdf type=\"diffuse\">" + rgb("reflectance", 0, 1) + "</bsdf>";
    case 1:
      return "<bsdf type=\"" + rough + "plastic\">" + roughness + rgb("diffuseReflectance", 0, 0.3) +
             "</bsdf>";
    case 2:
      return "<bsdf type=\"" + rough + "dielectric\">" + roughness + "</bsdf>";
    case 3:
      return "<bsdf type=\"" + rough + "conductor\">" + roughness + "</bsdf>";
    default:
      return "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"><texture type=\"checkerboard\" "
             "name=\"reflectance\"/></bsdf></bsdf>";
  }
}

std::string Writer::body(double size, const std::string& medium) {
  std::string type =
                  dice_.one_of({"sphere", "cube", "cylinder", "rectangle", "disk", "mesh", "mesh", "mesh"}),
              text;
  if (type == "mesh") {
    const std::string name = fmt::format("mesh{}", dice_.bits() % 1000000);
    type = write_random_mesh(dice_, folder_ + "/" + name);
    text = fmt::format("<string name=\"filename\" value=\"{}.{}\"/>", name, type);
    if (dice_.chance(0.2)) text += "<boolean name=\"fillHoles\" value=\"true\"/>";
    if (dice_.chance(0.2)) text += "<boolean name=\"faceNormals\" value=\"true\"/>";
    if (dice_.chance(0.1)) text += "<integer name=\"subdivisions\" value=\"1\"/>";
  }
  if (dice_.chance(0.1)) text += "<boolean name=\"flipNormals\" value=\"true\"/>";
  return "<shape type=\"" + type + "\">" + text + placement(size, unit_ * 0.4) + medium +
         surface(!medium.empty()) + "</shape>\n";
}

void Writer::write_sky(const std::string& name) {
  Image sky;
  sky.full_width = sky.width = 8;
  sky.full_height = sky.height = 4;
  for (const char* const channel : {"R", "G", "B"}) {
    sky.channels.push_back({channel, std::vector<float>(32)});
    for (float& value : sky.channels.back().values)
      value = dice_.chance(0.3) ? 0 : static_cast<float>(dice_.log_uniform(0.01, 100));
  }
  save_exr(sky, folder_ + "/" + name);
}

std::string Writer::lights() {
  std::string text;
  bool has_sky = false;
  for (int i = dice_.chance(0.1) ? 12 : dice_.integer(1, 4); i > 0; --i) {
    const std::string group = dice_.chance(0.2) ? "<string name=\"group\" value=\"some\"/>" : "";
    const int kind = dice_.integer(0, 5);
    const std::string at = fmt::format(
        "<transform name=\"toWorld\"><lookat origin=\"{}\" target=\"{}\" up=\"0.1, 1, 0.2\"/></transform>",
        triple(unit_ * 4), triple(unit_ * 0.2));
    const std::string bright =
        dice_.chance(0.05) ? "0" : fmt::format("{:.5g}", dice_.log_uniform(0.1, 100) * unit_ * unit_);
    if (kind == 0) {
      text += "<emitter type=\"point\"><rgb name=\"intensity\" value=\"" + bright + "\"/>" + at + group +
              "</emitter>\n";
    } else if (kind == 1) {
      text += "<emitter type=\"spot\"><rgb name=\"intensity\" value=\"" + bright + "\"/>" +
              number("cutoffAngle", dice_.uniform(5, 80)) + at + group + "</emitter>\n";
    } else if (kind == 2) {
      text += "<emitter type=\"directional\">" + rgb("irradiance", 0, 3) + at + group + "</emitter>\n";
    } else if (kind == 3 && !has_sky) {
      has_sky = true;
      if (dice_.chance(0.5)) {
        text += "<emitter type=\"constant\">" + rgb("radiance", 0, 1) + "</emitter>\n";
      } else {
        write_sky("sky.exr");
        text += "<emitter type=\"envmap\"><string name=\"filename\" value=\"sky.exr\"/></emitter>\n";
      }
    } else {
      const std::string shape = dice_.one_of({"rectangle", "disk", "sphere"});
      text += "<shape type=\"" + shape + "\"><transform name=\"toWorld\">" +
              fmt::format("<scale value=\"{:.5g}\"/>", unit_ * dice_.log_uniform(0.03, 1)) +
              fmt::format("<lookat origin=\"{}\" target=\"0, 0, 0\" up=\"0.1, 1, 0.2\"/></transform>",
                          triple(unit_ * 4)) +
              "<emitter type=\"area\">" + rgb("radiance", 0, 20) + group + "</emitter></shape>\n";
    }
  }
  return text;
}

std::string Writer::camera(int index) {
  const std::string type = dice_.one_of({"perspective", "perspective", "thinlens", "orthographic"});
  const double distance = unit_ * (dice_.chance(0.1) ? dice_.uniform(0, 0.5) : dice_.uniform(2, 6));
  std::string text =
      fmt::format("<sensor type=\"{}\" id=\"camera {}\"><transform name=\"toWorld\">", type, index);
  if (type == "orthographic") text += fmt::format("<scale x=\"{0:.5g}\" y=\"{0:.5g}\"/>", unit_ * 1.5);
  const double height = dice_.uniform(-0.8, 0.8), angle = dice_.uniform(0, 6.28),
               side = std::sqrt(1 - height * height);
  text += fmt::format("<lookat origin=\"{:.6g}, {:.6g}, {:.6g}\" target=\"{}\" up=\"0, 1, 0\"/></transform>",
                      distance * side * std::cos(angle), distance * height, distance * side * std::sin(angle),
                      triple(unit_ * 0.1));
  text += number("nearClip", unit_ * 1e-3) + number("farClip", unit_ * 1e3);
  if (type != "orthographic") text += number("fov", dice_.uniform(20, 60));
  if (type == "thinlens")
    text += number("apertureRadius", unit_ * dice_.uniform(0.001, 0.1)) +
            number("focusDistance", distance + unit_ * 1e-3);
  text += fmt::format(
      "<film type=\"hdrfilm\"><integer name=\"width\" value=\"{}\"/><integer name=\"height\" value=\"{}\"/>"
      "<rfilter type=\"{}\"/></film><sampler type=\"independent\"><integer name=\"sampleCount\" "
      "value=\"{}\"/></sampler>",
      dice_.integer(16, 64), dice_.integer(16, 64), dice_.one_of({"box", "gaussian", "tent"}), 2);
  return text + "</sensor>\n";
}

std::string Writer::scene() {
  unit_ = dice_.chance(0.6) ? 1 : dice_.log_uniform(1e-5, 1e5);
  std::string media, shapes;
  const int medium_count = dice_.chance(0.7) ? 1 : 2;
  for (int i = 0; i < medium_count; ++i) {
    length_ = dice_.log_uniform(0.004, 0.5);
    media += fmt::format("<subsurface type=\"dipole\" id=\"medium {}\">", i) + medium() + "</subsurface>\n";
    const std::string ref = fmt::format("<ref id=\"medium {}\"/>", i);
    for (int k = dice_.chance(0.7) ? 1 : dice_.integer(2, 3); k > 0; --k)
      shapes += body(unit_ * dice_.uniform(0.3, 0.8), ref);
    if (dice_.chance(0.15)) {
      shapes += fmt::format("<shape type=\"shapegroup\" id=\"group {}\">", i) + body(unit_ * 0.4, ref) +
                "</shape>\n";
      for (int k = dice_.integer(1, 3); k > 0; --k)
        shapes += fmt::format("<shape type=\"instance\"><ref id=\"group {}\"/>", i) +
                  placement(1, unit_ * 0.6) + "</shape>\n";
    }
  }
  if (dice_.chance(0.6))
    shapes += fmt::format(
                  "<shape type=\"rectangle\"><transform name=\"toWorld\"><scale value=\"{:.5g}\"/><rotate "
                  "x=\"1\" angle=\"-90\"/>"
                  "<translate y=\"{:.5g}\"/></transform>",
                  unit_ * 5, -unit_ * dice_.uniform(0.3, 1.2)) +
              surface(false) + "</shape>\n";
  if (dice_.chance(0.2)) shapes += body(unit_ * 0.3, "");
  std::string integrator =
      dice_.chance(0.6)
          ? "<integrator type=\"direct\"/>\n"
          : fmt::format("<integrator type=\"path\"><integer name=\"maxDepth\" value=\"{}\"/></integrator>\n",
                        dice_.integer(1, 5));
  std::string text = "<scene version=\"0.6.0\">\n" + integrator;
  for (int i = dice_.integer(1, 2); i > 0; --i) text += camera(i);
  return text + media + shapes + lights() + "</scene>\n";
}

}  // namespace

std::string write_random_scene(std::uint64_t seed, const std::string& folder) {
  Writer writer(seed, folder);
  const std::string path = folder + "/scene.xml";
  std::ofstream(path) << writer.scene();
  return path;
}

}  // namespace nacre::soak
