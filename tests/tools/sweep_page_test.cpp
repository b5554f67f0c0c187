// label: cli
// The page of a sweep in a browser: it has a slider for each key, and moving one changes the picture.
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "tools/cli.h"

namespace nacre {
namespace {

using testing_support::kSmallScene;
using testing_support::read_file;
using testing_support::run_nacre;
using testing_support::TemporaryFolder;

class SweepPage : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v chromium > /dev/null") != 0)
      GTEST_SKIP()
          << "there is no chromium, which tools/setup.sh installs: the page of a sweep is not opened";
    folder_.write("s.xml", kSmallScene);
    run("bake s.xml -o c.nacre --quiet --points 2000");
  }
  void run(const std::string& arguments) {
    const auto result = run_nacre(folder_, arguments);
    ASSERT_EQ(result.exit_code, 0) << result.output;
  }
  void sweep(const std::string& arguments) {
    run("sweep s.xml --cache c.nacre --quiet --size 24x18 --spp 1 -o d " + arguments);
  }

  // Opens the page with `where` after its address, runs `script` in it, and tells what is seen then: `shown`
  // is the number of the thumbnail that is shown large.
  nlohmann::json open(const std::string& where, const std::string& script = "") {
    std::string page = read_file(folder_.file("d/index.html"));
    const std::size_t end = page.rfind("</body>");
    EXPECT_NE(end, std::string::npos);
    page.insert(end, R"(<script>
      const at = selector => document.querySelector(selector);
      const slide = (number, value) => {
        const slider = document.querySelectorAll('input[type=range]')[number];
        slider.value = value;
        slider.dispatchEvent(new Event('input'));
      };
      )" + script + R"(
      addEventListener('load', () => {
        const thumbnails = [...document.querySelectorAll('#all img')];
        document.body.textContent = JSON.stringify({
          title: at('#title').textContent, caption: at('#one figcaption').textContent,
          link: at('#one a').getAttribute('href'), where: location.hash,
          sliders: [...document.querySelectorAll('#axes label')].map(label => label.textContent),
          wide: thumbnails.filter(image => image.naturalWidth == 24).length,
          distinct: new Set(thumbnails.map(image => image.src)).size,
          shown: thumbnails.findIndex(image => image.src === at('#one img').src),
          framed: thumbnails.findIndex(image => image.parentNode.classList.contains('chosen'))});
      });</script>)");
    const std::string path = folder_.write("d/test.html", page);
    const std::string command =
        "HOME='" + folder_.path().string() +
        "' timeout 60 chromium --headless --no-sandbox --disable-gpu --dump-dom 'file://" + path + where +
        "' 2> /dev/null";
    std::string document;
    FILE* const pipe = ::popen(command.c_str(), "r");
    std::array<char, 4096> buffer;
    while (const std::size_t got = pipe ? std::fread(buffer.data(), 1, buffer.size(), pipe) : 0)
      document.append(buffer.data(), got);
    EXPECT_EQ(pipe ? ::pclose(pipe) : -1, 0);
    const std::size_t begin = document.find("<body>") + 6;
    std::string text = document.substr(begin, document.rfind("</body>") - begin);
    for (std::size_t i = 0; (i = text.find("&amp;", i)) != std::string::npos; ++i) text.erase(i + 1, 4);
    const nlohmann::json seen = nlohmann::json::parse(text, nullptr, false);
    EXPECT_TRUE(seen.is_object()) << document;
    return seen.is_object() ? seen : nlohmann::json::object();
  }
  TemporaryFolder folder_;
};

TEST_F(SweepPage, SlidersChooseThePicture) {
  sweep("--vary sigma_a*=1:400:3:log --vary 'material=Marble;Ketchup'");
  const nlohmann::json first = open("");
  EXPECT_EQ(first["title"], "s.xml");
  EXPECT_EQ(first["sliders"], (std::vector<std::string>{"sigma_a*  1", "material  Marble"}));
  EXPECT_EQ(first["wide"], 6);
  EXPECT_EQ(first["distinct"], 6);
  EXPECT_EQ(first["shown"], 0);
  EXPECT_EQ(first["link"], "0001.png");

  const nlohmann::json moved = open("", "slide(0, 2); slide(1, 1);");
  EXPECT_EQ(moved["shown"], 5);
  EXPECT_EQ(moved["framed"], 5);
  EXPECT_EQ(moved["link"], "0006.png");
  EXPECT_EQ(moved["caption"], "sigma_a * 400, material = Ketchup");
  EXPECT_EQ(moved["sliders"][0], "sigma_a*  400");
  // What is shown has an address.
  EXPECT_EQ(moved["where"], "#sigma_a*=400&material=Ketchup");
  EXPECT_EQ(open(moved["where"])["shown"], 5);
  EXPECT_EQ(open("#material=Ketchup&sigma_a*=none")["shown"], 1);
  EXPECT_EQ(open("", "document.querySelectorAll('#all figure')[3].click();")["shown"], 3);
}

TEST_F(SweepPage, OneSliderMovesAllThatVaryTogether) {
  sweep("--zip --vary sigma_a*=1:400:3:log --vary 'material=Marble;Ketchup;Skin1'");
  EXPECT_EQ(open("", "slide(1, 2);")["sliders"],
            (std::vector<std::string>{"sigma_a*  400", "material  Skin1"}));
}

TEST_F(SweepPage, PlansAreLeafedThrough) {
  folder_.write("p.csv", "material\nMarble\nKetchup\nSkin1\n");
  sweep("--plan p.csv");
  const nlohmann::json moved = open("", "slide(0, 1);");
  EXPECT_EQ(moved["sliders"], (std::vector<std::string>{"picture  2"}));
  EXPECT_EQ(moved["caption"], "material = Ketchup");
  EXPECT_EQ(moved["shown"], 1);
}

}  // namespace
}  // namespace nacre
