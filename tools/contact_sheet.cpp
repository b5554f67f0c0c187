// Thumbnails on a sheet, with their labels.
#include "contact_sheet.h"

#include <fmt/format.h>
#include <stb/stb_easy_font.h>

#include <algorithm>
#include <cmath>

namespace nacre::tools {
namespace {

constexpr int kGap = 6, kLineHeight = 12;
constexpr int kLeastWidth = 160;       // of a cell, which small pictures share with their labels
constexpr std::size_t kMostLines = 3;  // of a label
constexpr std::uint8_t kBackground = 24, kInk = 220;

void fill(Preview& sheet, int left, int top, int right, int bottom, std::uint8_t value) {
  for (int y = std::max(top, 0); y < std::min(bottom, sheet.height); ++y)
    for (int x = std::max(left, 0); x < std::min(right, sheet.width); ++x)
      for (int c = 0; c < 3; ++c)
        sheet.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(sheet.width) +
                       static_cast<std::size_t>(x)) +
                  static_cast<std::size_t>(c)] = value;
}

bool fits(std::string text, int width) { return stb_easy_font_width(text.data()) <= width; }

// Lines no wider than that, broken after blanks and commas where there are any.
std::vector<std::string> wrap(const std::string& text, int width) {
  std::vector<std::string> lines;
  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = begin, good = begin;
    while (end < text.size() && fits(text.substr(begin, end + 1 - begin), width)) {
      ++end;
      if (text[end - 1] == ' ' || text[end - 1] == ',') good = end;
    }
    const bool is_last = end == text.size() || lines.size() + 1 == kMostLines;
    if (!is_last && good > begin) end = good;
    lines.push_back(text.substr(begin, std::max(end, begin + 1) - begin));
    begin += lines.back().size();
    if (lines.size() < kMostLines || begin == text.size()) continue;
    std::string& cut = lines.back();
    while (!cut.empty() && !fits(cut + "..", width)) cut.pop_back();
    cut += "..";
    break;
  }
  return lines;
}

std::vector<std::string> label_lines(const SheetPicture& picture, int width) {
  std::vector<std::string> lines;
  for (const Setting& setting : picture.settings)
    for (std::string& line : wrap(describe(setting), width)) lines.push_back(std::move(line));
  return lines;
}

// Letters are made of rectangles, four corners of x, y, z and a colour each.
void write(Preview& sheet, int left, int top, std::string text) {
  struct Corner {
    float x, y, z;
    std::uint32_t colour;
  };
  std::vector<Corner> corners(4 * (text.size() * 20 + 16));
  const int quads = stb_easy_font_print(0, 0, text.data(), nullptr, corners.data(),
                                        static_cast<int>(corners.size() * sizeof(Corner)));
  for (std::size_t q = 0; q < static_cast<std::size_t>(quads); ++q) {
    const Corner &a = corners[4 * q], &b = corners[4 * q + 2];
    fill(sheet, left + static_cast<int>(a.x), top + static_cast<int>(a.y), left + static_cast<int>(b.x),
         top + static_cast<int>(b.y), kInk);
  }
}

}  // namespace

std::string describe(const Setting& setting) {
  return setting.key + (setting.relative ? " * " : " = ") + setting.value;
}

Image shrink(const Image& image, int edge) {
  const int factor = std::max((std::max(image.width, image.height) + edge - 1) / edge, 1);
  Image small;
  small.full_width = small.width = (image.width + factor - 1) / factor;
  small.full_height = small.height = (image.height + factor - 1) / factor;
  for (const char* const name : {"R", "G", "B"}) {
    const Channel* const from = find_channel(image, name);
    Channel& to = small.channels.emplace_back();
    to.name = name;
    if (!from) continue;
    for (int y = 0; y < small.height; ++y)
      for (int x = 0; x < small.width; ++x) {
        double sum = 0;
        int count = 0;
        for (int j = y * factor; j < std::min((y + 1) * factor, image.height); ++j)
          for (int i = x * factor; i < std::min((x + 1) * factor, image.width); ++i, ++count)
            sum += double{from->values[static_cast<std::size_t>(j) * static_cast<std::size_t>(image.width) +
                                       static_cast<std::size_t>(i)]};
        to.values.push_back(static_cast<float>(sum / count));
      }
  }
  return small;
}

Preview make_contact_sheet(const SweepPlan& plan, const std::vector<SheetPicture>& pictures) {
  const std::size_t count = pictures.size();
  std::size_t columns = plan.axes.size() > 1 ? plan.axes.back().values.size()
                                             : static_cast<std::size_t>(std::ceil(std::sqrt(count)));
  columns = std::clamp<std::size_t>(columns, 1, std::max<std::size_t>(count, 1));
  int width = kLeastWidth, height = 0;
  std::size_t lines = 0;
  std::vector<std::vector<std::string>> labels;
  for (const SheetPicture& picture : pictures) {
    width = std::max(width, picture.thumbnail.width);
    height = std::max(height, picture.thumbnail.height);
  }
  for (const SheetPicture& picture : pictures) {
    labels.push_back(label_lines(picture, width));
    lines = std::max(lines, labels.back().size());
  }
  const int cell_width = width + kGap, cell_height = height + kLineHeight * static_cast<int>(lines) + kGap;
  const auto rows = static_cast<int>((count + columns - 1) / columns);
  Preview sheet;
  sheet.width = kGap + cell_width * static_cast<int>(columns);
  sheet.height = kGap + cell_height * rows;
  sheet.rgb.assign(3 * static_cast<std::size_t>(sheet.width) * static_cast<std::size_t>(sheet.height),
                   kBackground);
  for (std::size_t i = 0; i < count; ++i) {
    const Preview& from = pictures[i].thumbnail;
    const int left = kGap + cell_width * static_cast<int>(i % columns);
    const int top = kGap + cell_height * static_cast<int>(i / columns);
    for (int y = 0; y < from.height; ++y)
      std::copy_n(from.rgb.begin() + std::ptrdiff_t{3} * y * from.width, 3 * from.width,
                  sheet.rgb.begin() + 3 * (std::ptrdiff_t{top + y} * sheet.width + left));
    int line = top + height + 2;
    for (const std::string& text : labels[i]) {
      write(sheet, left, line, text);
      line += kLineHeight;
    }
  }
  return sheet;
}

}  // namespace nacre::tools
