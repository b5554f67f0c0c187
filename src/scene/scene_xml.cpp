// XML of scenes through pugixml: parsing, <default>, <include>, $names, and the elements that there are.
#include "scene/scene_xml.h"

#include <algorithm>
#include <filesystem>
#include <pugixml.hpp>
#include <set>

#include "nacre/base/file.h"

namespace nacre {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxDepth = 32;                         // of nested elements, and of nested includes
constexpr std::size_t kMaxFileBytes = 64u << 20;      // of one scene file
constexpr std::size_t kMaxExpandedBytes = 64u << 10;  // of one attribute in which a $name was replaced
constexpr std::size_t kMaxFiles = 1000;               // that are included, so that those cannot either
constexpr std::size_t kMaxTreeBytes = 256u << 20;     // of everything, so that includes cannot multiply

// The attributes that an element needs and may have besides. A leaf has no children.
struct TagRule {
  std::string_view tag;
  std::vector<std::string_view> required, optional;
  bool leaf;
};

const std::vector<TagRule>& tag_rules() {
  static const std::vector<TagRule> rules = [] {
    std::vector<TagRule> list = {
        {"scene", {}, {"version"}, false},
        {"include", {"filename"}, {}, true},
        {"default", {"name", "value"}, {}, true},
        {"ref", {"id"}, {"name"}, true},
        {"rgb", {"name", "value"}, {"intent"}, true},
        {"srgb", {"name", "value"}, {"intent"}, true},
        {"spectrum", {"name", "value"}, {"intent"}, true},
        {"point", {"name"}, {"x", "y", "z", "value"}, true},
        {"vector", {"name"}, {"x", "y", "z", "value"}, true},
        {"transform", {"name"}, {}, false},
        {"translate", {}, {"x", "y", "z", "value"}, true},
        {"scale", {}, {"x", "y", "z", "value"}, true},
        {"rotate", {"angle"}, {"x", "y", "z", "value"}, true},
        {"lookat", {"origin", "target"}, {"up"}, true},
        {"matrix", {"value"}, {}, true},
    };
    for (const char* tag : {"integer", "float", "boolean", "string"})
      list.push_back({tag, {"name", "value"}, {}, true});
    for (const char* tag : {"integrator", "sensor", "film", "sampler", "rfilter", "emitter", "shape", "bsdf",
                            "subsurface", "texture"})
      list.push_back({tag, {"type"}, {"id", "name"}, false});
    return list;
  }();
  return rules;
}

const TagRule& find_rule(const XmlElement& element) {
  for (const TagRule& rule : tag_rules())
    if (rule.tag == element.tag) return rule;
  fail(ErrorCode::kUnsupported, element.place(), "<{}> is not an element that nacre reads", element.tag);
}

void check_attributes(const XmlElement& element) {
  const TagRule& rule = find_rule(element);
  for (const std::string_view name : rule.required)
    if (!element.has(name))
      fail(ErrorCode::kSyntax, element.place(), "<{}> lacks the attribute '{}'", element.tag, name);
  std::set<std::string_view> seen;
  for (const auto& [name, value] : element.attributes) {
    if (!seen.insert(name).second)
      fail(ErrorCode::kSyntax, element.place(), "<{}> has the attribute '{}' twice", element.tag, name);
    const auto is_name = [&n = name](std::string_view known) { return known == n; };
    if (std::ranges::none_of(rule.required, is_name) && std::ranges::none_of(rule.optional, is_name))
      fail(ErrorCode::kSyntax, element.place(), "<{}> has no attribute '{}'", element.tag, name);
  }
}

bool is_name_character(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

void check_name(const std::string& name, const std::string& place) {
  if (name.empty() || !std::ranges::all_of(name, is_name_character))
    fail(ErrorCode::kSyntax, place, "'{}' cannot be a $name: use letters, digits and _", name);
}

// Text as a message can show it: one line, not too long.
std::string excerpt(std::string_view text) {
  std::string line;
  for (const char c : text.substr(0, 40)) line += static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  return text.size() > 40 ? line + "..." : line;
}

// Where a path leads. One that cannot be followed (a circle of links, a folder that may not be read) leads
// nowhere.
fs::path resolve_links(const fs::path& path) {
  std::error_code error;
  fs::path result = fs::weakly_canonical(path, error);
  return error ? fs::path() : result;
}

class Loader {
 public:
  Loader(const Defines& defines, std::string sandbox) : values_(defines), sandbox_(std::move(sandbox)) {
    for (const auto& [name, value] : defines) check_name(name, "-D " + excerpt(name));
  }

  // Appends the children of the file's <scene> to `scene`, which gets the file's name and line if it is the
  // first.
  void load(const std::string& path, const std::string& included_from, XmlElement& scene) {
    std::string text;
    try {
      text = read_text_file(path, kMaxFileBytes);
    } catch (const Error& error) {
      if (included_from.empty()) throw;
      throw Error(error.code(), included_from, error.what());
    }
    std::error_code ignored;
    const std::string identity = fs::weakly_canonical(path, ignored).string();
    if (std::ranges::find(open_files_, identity) != open_files_.end())
      fail(ErrorCode::kValue, included_from, "includes '{}', which is being read already: a circle", path);
    if (++file_count_ > kMaxFiles)
      fail(ErrorCode::kLimit, included_from, "more than {} files are included", kMaxFiles);
    if (open_files_.size() >= kMaxDepth)
      fail(ErrorCode::kLimit, included_from, "includes are nested more than {} deep", kMaxDepth);
    open_files_.push_back(identity);
    sources_.insert(path);

    const Source source(path, text);
    if (const std::size_t nul = text.find('\0'); nul != std::string::npos)
      fail(ErrorCode::kSyntax, source.place(static_cast<std::ptrdiff_t>(nul)),
           "not XML: byte {} is zero (expected UTF-8 text)", nul);
    pugi::xml_document document;
    const pugi::xml_parse_result result =
        document.load_buffer(text.data(), text.size(), pugi::parse_default, pugi::encoding_utf8);
    if (!result) fail(ErrorCode::kSyntax, source.place(result.offset), "not XML: {}", result.description());
    const pugi::xml_node root = document.document_element();
    if (root.next_sibling())
      fail(ErrorCode::kSyntax, source.place(root.next_sibling().offset_debug()),
           "more than one outermost element");
    if (std::string_view(root.name()) != "scene")
      fail(ErrorCode::kSyntax, source.place(root.offset_debug()),
           "the outermost element is <{}>, it has to be <scene>", root.name());
    XmlElement element;
    convert(root, source, 0, element);
    if (included_from.empty()) {
      scene = std::move(element);
    } else {
      std::ranges::move(element.children, std::back_inserter(scene.children));
    }
    open_files_.pop_back();
  }

  bool is_used(const std::string& name) const { return used_.contains(name); }
  std::vector<std::string> sources() const { return {sources_.begin(), sources_.end()}; }
  std::vector<std::string> files() const { return {files_.begin(), files_.end()}; }

 private:
  struct Source {
    const std::string& path;
    std::vector<std::ptrdiff_t> line_ends;

    Source(const std::string& file, const std::string& text) : path(file) {
      for (std::size_t i = 0; i < text.size(); ++i)
        if (text[i] == '\n') line_ends.push_back(static_cast<std::ptrdiff_t>(i));
    }
    std::size_t line(std::ptrdiff_t offset) const {
      return static_cast<std::size_t>(std::ranges::lower_bound(line_ends, offset) - line_ends.begin()) + 1;
    }
    std::string place(std::ptrdiff_t offset) const { return fmt::format("{}:{}", path, line(offset)); }
  };

  void convert(pugi::xml_node node, const Source& source, int depth, XmlElement& element);
  std::string expand(const std::string& text, const std::string& place);
  void charge(std::size_t bytes, const XmlElement& element) {
    tree_bytes_ += bytes;
    if (tree_bytes_ > kMaxTreeBytes)
      fail(ErrorCode::kLimit, element.place(), "the scene with its includes is larger than {} MB",
           kMaxTreeBytes >> 20);
  }

  Defines values_;
  std::string sandbox_;
  std::set<std::string> used_, sources_, files_;
  std::vector<std::string> open_files_;
  std::size_t tree_bytes_ = 0, file_count_ = 0;
};

void Loader::convert(pugi::xml_node node, const Source& source, int depth, XmlElement& element) {
  element.tag = node.name();
  if (element.tag == "lookAt") element.tag = "lookat";
  element.file = source.path;
  element.line = source.line(node.offset_debug());
  element.sandbox = sandbox_;
  if (depth > kMaxDepth)
    fail(ErrorCode::kLimit, element.place(), "elements are nested more than {} deep", kMaxDepth);
  charge(sizeof(XmlElement) + source.path.size() + sandbox_.size(), element);
  for (const pugi::xml_attribute attribute : node.attributes()) {
    element.attributes.emplace_back(attribute.name(), expand(attribute.value(), element.place()));
    charge(64 + element.attributes.back().second.size(), element);
  }
  check_attributes(element);
  if (element.get("name") == "filename")
    files_.insert((fs::path(element.file).parent_path() / element.get("value")).string());

  const bool leaf = find_rule(element).leaf;
  for (const pugi::xml_node child_node : node.children()) {
    if (child_node.type() == pugi::node_pcdata || child_node.type() == pugi::node_cdata)
      fail(ErrorCode::kSyntax, element.place(), "text '{}' inside <{}>: values belong into attributes",
           excerpt(child_node.value()), element.tag);
    if (child_node.type() != pugi::node_element) continue;
    XmlElement child;
    convert(child_node, source, depth + 1, child);
    if (leaf)
      fail(ErrorCode::kSyntax, child.place(), "<{}> cannot stand inside <{}>", child.tag, element.tag);
    if (child.tag != "default" && child.tag != "include") {
      element.children.push_back(std::move(child));
    } else if (element.tag != "scene") {
      fail(ErrorCode::kSyntax, child.place(), "<{}> belongs directly inside <scene>", child.tag);
    } else if (child.tag == "default") {
      check_name(child.get("name"), child.place());
      values_.emplace(child.get("name"), child.get("value"));  // a value that is there already wins
    } else {
      load(resolve_path(child.get("filename"), child), child.place(), element);
    }
  }
}

// Replaces each $ with the longest defined name that follows it, as Mitsuba does.
std::string Loader::expand(const std::string& text, const std::string& place) {
  std::string result;
  std::size_t at = 0;
  for (std::size_t dollar; (dollar = text.find('$', at)) != std::string::npos;) {
    result.append(text, at, dollar - at);
    std::size_t end = dollar + 1;
    while (end < text.size() && is_name_character(text[end])) ++end;
    std::string name = text.substr(dollar + 1, end - dollar - 1);
    const std::string whole_name = name;
    while (!name.empty() && !values_.contains(name)) name.pop_back();
    if (name.empty())
      fail(ErrorCode::kValue, place, "${} is not defined: add a <default> before it, or -D {}=VALUE",
           excerpt(whole_name), excerpt(whole_name));
    used_.insert(name);
    result += values_.at(name);
    if (result.size() > kMaxExpandedBytes)
      fail(ErrorCode::kLimit, place, "an attribute is longer than {} kB after ${} is replaced",
           kMaxExpandedBytes >> 10, name);
    at = dollar + 1 + name.size();
  }
  return result.append(text, at);
}

}  // namespace

bool XmlElement::has(std::string_view attribute) const {
  return std::ranges::any_of(attributes, [&](const auto& pair) { return pair.first == attribute; });
}

const std::string& XmlElement::get(std::string_view attribute) const {
  static const std::string none;
  const auto found = std::ranges::find_if(attributes, [&](const auto& p) { return p.first == attribute; });
  return found == attributes.end() ? none : found->second;
}

SceneXml load_scene_xml(const std::string& path, const Defines& defines, Warnings& warnings,
                        SceneFiles files) {
  std::string sandbox;
  if (files == SceneFiles::kOwnFolder) sandbox = resolve_links(fs::absolute(path).parent_path()).string();
  Loader loader(defines, sandbox);
  SceneXml result;
  loader.load(path, "", result.scene);
  result.sources = loader.sources();
  result.files = loader.files();
  for (const auto& [name, value] : defines)
    if (!loader.is_used(name))
      warnings.push_back(fmt::format("-D {}: nothing in {} uses ${}", name, path, name));
  return result;
}

std::string resolve_path(const std::string& name, const XmlElement& element) {
  if (name.empty()) fail(ErrorCode::kValue, element.place(), "names no file");
  const fs::path path = fs::path(element.file).parent_path() / name;
  std::error_code ignored;
  if (const fs::file_status status = fs::status(path, ignored);
      fs::exists(status) && !fs::is_regular_file(status))
    fail(ErrorCode::kValue, element.place(), "'{}' is no regular file", excerpt(name));
  if (!element.sandbox.empty()) {
    const fs::path inside = resolve_links(fs::absolute(path)).lexically_relative(element.sandbox);
    if (inside.empty() || *inside.begin() == "..")
      fail(ErrorCode::kValue, element.place(),
           "'{}' lies outside of {}: --sandbox keeps to the scene's own folder", excerpt(name),
           element.sandbox);
  }
  return path.string();
}

}  // namespace nacre
