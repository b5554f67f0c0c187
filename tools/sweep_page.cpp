// A sweep as one page of HTML.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "contact_sheet.h"

namespace nacre::tools {
namespace {

std::string base64(const std::vector<std::uint8_t>& bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) bits = bits << 8 | (k < left ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= left ? kDigits[bits >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

// Text within a script: no tag ends it.
std::string script_text(const nlohmann::ordered_json& json) {
  std::string text = json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
  for (std::size_t at = 0; (at = text.find('<', at)) != std::string::npos;) text.replace(at, 1, "\\u003c");
  return text;
}

constexpr std::string_view kHead = R"html(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>nacre sweep</title>
<style>
body { background: #181818; color: #ddd; font: 14px sans-serif; margin: 16px; }
a { color: inherit; }
#axes label { display: inline-block; margin: 0 24px 8px 0; }
#one { margin: 0; }
#one img { min-width: 320px; image-rendering: auto; }
#all { display: grid; gap: 8px; margin-top: 16px; }
#all figure { margin: 0; }
#all figure.chosen img { outline: 2px solid #fa0; }
#all img { width: 100%; display: block; }
figcaption { font-size: 12px; }
</style>
</head>
<body>
<h1 id="title"></h1>
<div id="axes"></div>
<figure id="one"><a><img alt=""></a><figcaption></figcaption></figure>
<div id="all"></div>
<script>
const sweep = )html";

constexpr std::string_view kTail = R"html(;
document.getElementById('title').textContent = sweep.title;
const all = document.getElementById('all'), one = document.getElementById('one');
const axes = document.getElementById('axes');
const sliders = sweep.axes.map(axis => {
  const label = document.createElement('label'), range = document.createElement('input');
  const text = document.createElement('span');
  range.type = 'range';
  range.min = 0;
  range.max = axis.values.length - 1;
  range.value = 0;
  label.append(axis.name + ' ', range, ' ', text);
  axes.append(label);
  range.addEventListener('input', () => choose(sweep.together ? Number(range.value) : chosen()));
  return {axis, range, text};
});
function chosen() {
  return sweep.together ? Number(sliders[0].range.value)
    : sliders.reduce((index, s) => index * s.axis.values.length + Number(s.range.value), 0);
}
function place(index) {
  for (let i = sliders.length - 1; i >= 0; --i) {
    const count = sliders[i].axis.values.length;
    sliders[i].range.value = sweep.together ? index : index % count;
    if (!sweep.together) index = Math.floor(index / count);
  }
}
function show(index) {
  const picture = sweep.pictures[index];
  place(index);
  for (const s of sliders) s.text.textContent = s.axis.values[s.range.value];
  one.querySelector('a').href = picture.file;
  one.querySelector('img').src = picture.thumbnail;
  one.querySelector('figcaption').textContent = picture.label;
  [...all.children].forEach((figure, i) => figure.classList.toggle('chosen', i === index));
}
// The address leads back to what is shown: page.html#key=value&key=value
function choose(index) {
  show(index);
  history.replaceState(null, '', '#' + sliders.map(s => encodeURIComponent(s.axis.name) + '=' +
    encodeURIComponent(s.axis.values[s.range.value])).join('&'));
}
function follow() {
  const wanted = new URLSearchParams(location.hash.slice(1));
  for (const s of sliders) {
    const value = s.axis.values.indexOf(wanted.get(s.axis.name));
    if (value >= 0) (sweep.together ? sliders[0] : s).range.value = value;
  }
  show(chosen());
}
all.style.gridTemplateColumns = 'repeat(' + sweep.columns + ', minmax(96px, 1fr))';
sweep.pictures.forEach((picture, index) => {
  const figure = document.createElement('figure'), image = document.createElement('img');
  const caption = document.createElement('figcaption');
  image.src = picture.thumbnail;
  image.alt = caption.textContent = picture.label;
  figure.append(image, caption);
  figure.addEventListener('click', () => choose(index));
  all.append(figure);
});
addEventListener('hashchange', follow);
follow();
</script>
</body>
</html>
)html";

}  // namespace

std::string make_sweep_page(const SweepPlan& plan, const std::vector<SheetPicture>& pictures,
                            const std::string& title) {
  nlohmann::ordered_json sweep;
  sweep["title"] = title;
  std::size_t grid = 1;
  sweep["axes"] = nlohmann::ordered_json::array();
  for (const SweepAxis& axis : plan.axes) {
    nlohmann::ordered_json values;
    for (const Setting& value : axis.values) values.push_back(value.value);
    sweep["axes"].push_back({{"name", axis.name}, {"values", values}});
    grid *= axis.values.size();
  }
  if (plan.axes.empty()) {
    nlohmann::ordered_json numbers;
    for (std::size_t i = 0; i < pictures.size(); ++i) numbers.push_back(std::to_string(i + 1));
    sweep["axes"].push_back({{"name", "picture"}, {"values", numbers}});
    grid = pictures.size();
  }
  sweep["together"] = grid != pictures.size();
  sweep["columns"] = plan.axes.size() > 1 && grid == pictures.size()
                         ? plan.axes.back().values.size()
                         : std::min<std::size_t>(pictures.size(), 6);
  for (const SheetPicture& picture : pictures) {
    std::string label;
    for (const Setting& setting : picture.settings) label += (label.empty() ? "" : ", ") + describe(setting);
    sweep["pictures"].push_back(
        {{"file", picture.file},
         {"label", label},
         {"thumbnail", "data:image/png;base64," + base64(encode_png(picture.thumbnail, picture.file))}});
  }
  return std::string(kHead) + script_text(sweep) + std::string(kTail);
}

}  // namespace nacre::tools
