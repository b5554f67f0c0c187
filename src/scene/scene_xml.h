// A scene file as a tree of checked elements: $names replaced, includes spliced in, every element with its
// line.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "nacre/scene/scene_file.h"

namespace nacre {

struct XmlElement {
  std::string tag;  // "lookAt" of older files is "lookat" here
  std::string file;
  std::size_t line = 0;
  std::vector<std::pair<std::string, std::string>> attributes;
  std::vector<XmlElement> children;
  std::string sandbox;  // folder that files named here have to lie in; "": anywhere

  /// "file:line"
  std::string place() const { return fmt::format("{}:{}", file, line); }
  bool has(std::string_view attribute) const;
  /// "" if it is absent.
  const std::string& get(std::string_view attribute) const;
};

struct SceneXml {
  XmlElement scene;
  std::vector<std::string> sources;  // the file and what it includes, none twice
  std::vector<std::string> files;    // that their elements name, none twice
};

/// Reads a file and what it includes into one <scene>. Throws Error with "file:line" for what is not XML, an
/// element or attribute that scenes do not have, a required attribute that is missing, an undefined $name,
/// and includes that are missing, circular or too many. Warns of a define that no $name uses. `files` says
/// which files it and its elements may name.
SceneXml load_scene_xml(const std::string& path, const Defines& defines, Warnings& warnings,
                        SceneFiles files = SceneFiles::kAnywhere);

/// `name` as written in an element, relative to the folder of the element's file. Throws Error(kValue) at the
/// element if it, or what a symbolic link makes of it, lies outside of the element's sandbox.
std::string resolve_path(const std::string& name, const XmlElement& element);

}  // namespace nacre
