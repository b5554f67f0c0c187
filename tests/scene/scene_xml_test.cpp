// label: unit
// $names, defaults, includes and hostile XML.
#include "scene/scene_xml.h"

#include "scene/scene_text.h"

namespace nacre {
namespace {

using testing::Test;

XmlElement load(const SceneFolder& folder, const std::string& text, const Defines& defines = {}) {
  Warnings warnings;
  return load_scene_xml(folder.write("main.xml", text), defines, warnings).scene;
}

std::string value_of(const std::string& text, const Defines& defines = {}) {
  const SceneFolder folder;
  return load(folder, "<scene>" + text + "</scene>", defines).children.at(0).get("value");
}

ErrorCode code_of(const SceneFolder& folder, const std::string& text) {
  try {
    load(folder, text);
  } catch (const Error& error) {
    return error.code();
  }
  ADD_FAILURE() << "accepted";
  return ErrorCode::kIo;
}

TEST(SceneNames, AreReplacedAnywhereInsideAnAttribute) {
  EXPECT_EQ(value_of(R"(<default name="r" value="1.5"/><rgb name="x" value="$r, 0,$r"/>)"), "1.5, 0,1.5");
  EXPECT_EQ(value_of(R"(<default name="dir" value="a/b"/><string name="f" value="$dir/c.obj"/>)"),
            "a/b/c.obj");
}

TEST(SceneNames, TheLongestDefinedNameCounts) {
  EXPECT_EQ(value_of(R"(<default name="a" value="1"/><default name="ab" value="2"/>
                        <string name="f" value="$abc $ac"/>)"),
            "2c 1c");
}

TEST(SceneNames, AValueIsNotReplacedAgainAndDefaultsMayUseEarlierNames) {
  EXPECT_EQ(value_of(R"(<string name="f" value="$a"/>)", {{"a", "$b"}}), "$b");
  EXPECT_EQ(value_of(R"(<default name="a" value="x"/><default name="b" value="$a$a"/>
                        <string name="f" value="$b"/>)"),
            "xx");
}

TEST(SceneNames, ADefineWinsOverDefaultsAndTheFirstDefaultOverLaterOnes) {
  const std::string text = R"(<default name="a" value="1"/><default name="a" value="2"/>
                              <string name="f" value="$a"/>)";
  EXPECT_EQ(value_of(text), "1");
  EXPECT_EQ(value_of(text, {{"a", "3"}}), "3");
}

TEST(SceneNames, ADefineThatNothingUsesIsAWarning) {
  const SceneFolder folder;
  const std::string path = folder.write("s.xml", "<scene/>");
  Warnings warnings;
  load_scene_xml(path, {{"typo", "1"}}, warnings);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0], "-D typo: nothing in " + path + " uses $typo");
}

TEST(SceneIncludes, AreRelativeToTheIncludingFileAndKeepTheOrder) {
  const SceneFolder folder;
  folder.write("sub/a.xml",
               "<scene>\n<include filename=\"b.xml\"/>\n<shape type=\"cube\" id=\"$n\"/></scene>");
  folder.write("sub/b.xml", "<scene><default name=\"n\" value=\"second\"/><shape type=\"disk\"/></scene>");
  const XmlElement scene = load(folder,
                                "<scene>\n<include filename=\"sub/a.xml\"/>\n"
                                "<shape type=\"sphere\"/></scene>");
  ASSERT_EQ(scene.children.size(), 3u);
  EXPECT_EQ(scene.children[0].get("type"), "disk");
  EXPECT_EQ(scene.children[0].place(), folder.path() + "/sub/b.xml:1");
  EXPECT_EQ(scene.children[1].get("id"), "second");
  EXPECT_EQ(scene.children[1].place(), folder.path() + "/sub/a.xml:3");
  EXPECT_EQ(scene.children[2].place(), folder.path() + "/main.xml:3");
}

TEST(SceneIncludes, CirclesAreRefusedAtAnyLengthButRepetitionIsNot) {
  const SceneFolder folder;
  folder.write("a.xml", R"(<scene><include filename="b.xml"/></scene>)");
  folder.write("b.xml", R"(<scene><include filename="../)" +
                            std::filesystem::path(folder.path()).filename().string() +
                            R"(/a.xml"/></scene>)");
  folder.write("leaf.xml", R"(<scene><shape type="cube"/></scene>)");
  EXPECT_EQ(code_of(folder, R"(<scene><include filename="a.xml"/></scene>)"), ErrorCode::kValue);
  EXPECT_EQ(load(folder, R"(<scene><include filename="leaf.xml"/><include filename="leaf.xml"/></scene>)")
                .children.size(),
            2u);
}

// What would grow without bound stops with an error, quickly.
TEST(SceneLimits, NamesThatDoubleAndIncludesThatMultiplyAreRefused) {
  const SceneFolder folder;
  std::string doubling = "<scene><default name=\"a0\" value=\"0123456789\"/>";
  for (int i = 1; i < 60; ++i)
    doubling += fmt::format("<default name=\"a{}\" value=\"$a{}$a{}\"/>", i, i - 1, i - 1);
  EXPECT_EQ(code_of(folder, doubling + "</scene>"), ErrorCode::kLimit);

  std::string leaf = "<scene>";
  for (int i = 0; i < 1000; ++i) leaf += "<shape type=\"cube\"/>";
  folder.write("i0.xml", leaf + "</scene>");
  for (int i = 1; i < 10; ++i) {
    std::string text = "<scene>";
    for (int k = 0; k < 10; ++k) text += fmt::format("<include filename=\"i{}.xml\"/>", i - 1);
    folder.write(fmt::format("i{}.xml", i), text + "</scene>");
  }
  EXPECT_EQ(code_of(folder, R"(<scene><include filename="i9.xml"/></scene>)"), ErrorCode::kLimit);
}

TEST(SceneLimits, DeepNestingIsRefused) {
  const SceneFolder folder;
  std::string deep = "<scene>";
  for (int i = 0; i < 100'000; ++i) deep += "<shape type=\"x\">";
  for (int i = 0; i < 100'000; ++i) deep += "</shape>";
  EXPECT_EQ(code_of(folder, deep + "</scene>"), ErrorCode::kLimit);
}

// With a sandbox, no way leads out of the scene's folder: not a path, and not a symbolic link.
TEST(SceneSandbox, KeepsToTheFolderOfTheScene) {
  const SceneFolder folder;
  const std::string outside = folder.write("outside/leaf.xml", R"(<scene><shape type="cube"/></scene>)");
  const std::string mesh = folder.write("outside/a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  folder.write("home/below/leaf.xml", R"(<scene><include filename="../leaf.xml"/></scene>)");
  folder.write("home/leaf.xml", R"(<scene><shape type="cube"/></scene>)");
  std::filesystem::create_symlink("../outside", folder.path() + "/home/out");
  std::filesystem::create_symlink("../outside/a.obj", folder.path() + "/home/a.obj");
  std::filesystem::create_symlink("circle.xml", folder.path() + "/home/circle.xml");
  std::filesystem::create_symlink("home", folder.path() + "/door");
  const auto refusal = [&](const std::string& body, const char* home, SceneFiles files) {
    folder.write("home/main.xml", "<scene>\n" + body + "</scene>");
    try {
      load_scene(folder.path() + home, {}, files);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const auto include = [](const std::string& file) { return "<include filename=\"" + file + "\"/>"; };
  const auto shape = [](const std::string& type, const std::string& file) {
    return "<shape type=\"" + type + "\"><string name=\"filename\" value=\"" + file + "\"/></shape>";
  };
  const std::string map =
      R"(<shape type="cube"/><emitter type="envmap"><string name="filename" value="/etc/x.exr"/></emitter>)";
  const std::string texture =
      R"(<shape type="cube"><bsdf type="diffuse"><texture name="reflectance" type="bitmap">
                                 <string name="filename" value="../outside/x.png"/></texture></bsdf></shape>)";
  for (const char* const home : {"/home/main.xml", "/door/main.xml"}) {
    for (const std::string& body :
         {include("../outside/leaf.xml"), include(outside), include("out/leaf.xml"),
          include("below/../../outside/leaf.xml"), include("circle.xml"), shape("obj", "a.obj"),
          shape("obj", mesh), shape("serialized", "/dev/x.serialized"), map, texture}) {
      const std::string what = refusal(body, home, SceneFiles::kOwnFolder);
      EXPECT_NE(what.find("main.xml:2"), std::string::npos) << what << body;
      EXPECT_NE(what.find("--sandbox"), std::string::npos) << what << body;
    }
    for (const std::string& body :
         {include("leaf.xml"), include("below/leaf.xml"), include(folder.path() + "/home/leaf.xml")})
      EXPECT_EQ(refusal(body, home, SceneFiles::kOwnFolder), "") << body;
    for (const std::string& body :
         {include("../outside/leaf.xml"), include("out/leaf.xml"), shape("obj", "a.obj")})
      EXPECT_EQ(refusal(body, home, SceneFiles::kAnywhere), "") << body;
  }
}

TEST(SceneXml, NulBytesEmptyFilesAndFoldersAreErrors) {
  const SceneFolder folder;
  EXPECT_EQ(code_of(folder, std::string("<scene>\0</scene>", 16)), ErrorCode::kSyntax);
  EXPECT_EQ(code_of(folder, ""), ErrorCode::kSyntax);
  Warnings warnings;
  EXPECT_THROW(load_scene_xml(folder.path(), {}, warnings), Error);
  EXPECT_THROW(load_scene_xml(folder.path() + "/none.xml", {}, warnings), Error);
}

// Every prefix of a scene is an error with a line, never a crash or a scene.
TEST(SceneXml, TruncatedFilesAreSyntaxErrors) {
  const SceneFolder folder;
  const std::string text =
      "<?xml version=\"1.0\"?>\n<scene version=\"0.6.0\">\n<!-- c -->\n<shape type=\"cube\"/>\n</scene>";
  for (std::size_t n = 0; n < text.size(); ++n)
    EXPECT_EQ(code_of(folder, text.substr(0, n)), ErrorCode::kSyntax) << n;
  EXPECT_EQ(load(folder, text).children.at(0).line, 4u);
}

}  // namespace
}  // namespace nacre
