// A sphere of latitudes and longitudes with waves on it.
#include "soak/random_mesh.h"

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <numbers>
#include <vector>

#include "nacre/base/math.h"

namespace nacre::soak {
namespace {

struct Body {
  std::vector<Vec3> positions;
  std::vector<std::array<int, 3>> triangles;
};

Body make_body(Dice& dice) {
  const int rings = dice.integer(4, 40), sectors = dice.integer(5, 60);
  const double height = dice.chance(0.5) ? 0 : dice.uniform(0, 0.35);
  const int waves = dice.integer(1, 6);
  const auto point = [&](double theta, double phi) {
    const double r = 1 + height * std::sin(waves * phi) * std::sin(waves * theta) * std::sin(theta);
    return Vec3(static_cast<float>(r * std::sin(theta) * std::cos(phi)),
                static_cast<float>(r * std::cos(theta)),
                static_cast<float>(r * std::sin(theta) * std::sin(phi)));
  };
  Body body;
  body.positions = {point(0, 0), point(std::numbers::pi, 0)};
  for (int i = 1; i < rings; ++i)
    for (int j = 0; j < sectors; ++j)
      body.positions.push_back(point(std::numbers::pi * i / rings, 2 * std::numbers::pi * j / sectors));
  const auto at = [&](int ring, int sector) { return 2 + (ring - 1) * sectors + sector % sectors; };
  for (int j = 0; j < sectors; ++j) {
    body.triangles.push_back({0, at(1, j + 1), at(1, j)});
    for (int i = 1; i + 1 < rings; ++i) {
      body.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
      body.triangles.push_back({at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)});
    }
    body.triangles.push_back({1, at(rings - 1, j), at(rings - 1, j + 1)});
  }
  return body;
}

void damage(Dice& dice, Body& body) {
  const auto triangle = [&]() -> std::array<int, 3>& {
    return body
        .triangles[static_cast<std::size_t>(dice.integer(0, static_cast<int>(body.triangles.size()) - 1))];
  };
  if (dice.chance(0.15)) std::swap(triangle()[0], triangle()[1]);
  if (dice.chance(0.15)) std::swap(triangle(), body.triangles.back()), body.triangles.pop_back();
  if (dice.chance(0.15)) body.triangles.push_back(triangle());
  if (dice.chance(0.15)) body.triangles.push_back({triangle()[0], triangle()[0], triangle()[1]});
  if (dice.chance(0.15)) body.positions.push_back({1e6f, 0, 0});
  if (dice.chance(0.15)) body.positions[2] = body.positions[3];
}

std::string format_obj(const Body& body) {
  std::string text;
  for (const Vec3& p : body.positions) text += fmt::format("v {} {} {}\n", p.x, p.y, p.z);
  for (const auto& t : body.triangles) text += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  return text;
}

std::string format_lists(const Body& body, const std::string& head) {
  std::string text = head;
  for (const Vec3& p : body.positions) text += fmt::format("{} {} {}\n", p.x, p.y, p.z);
  for (const auto& t : body.triangles) text += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
  return text;
}

}  // namespace

std::string write_random_mesh(Dice& dice, const std::string& path_without_ending) {
  Body body = make_body(dice);
  damage(dice, body);
  const std::string type = dice.one_of({"obj", "ply", "off"});
  std::ofstream file(path_without_ending + "." + type);
  if (type == "obj")
    file << format_obj(body);
  else if (type == "off")
    file << format_lists(body, fmt::format("OFF\n{} {} 0\n", body.positions.size(), body.triangles.size()));
  else
    file << format_lists(body,
                         fmt::format("ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty "
                                     "float y\nproperty float z\nelement face {}\nproperty list uchar int "
                                     "vertex_indices\nend_header\n",
                                     body.positions.size(), body.triangles.size()));
  return type;
}

}  // namespace nacre::soak
