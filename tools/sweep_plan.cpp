// Reading what a sweep varies.
#include "sweep_plan.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "common.h"
#include "json_file.h"
#include "nacre/base/error.h"
#include "nacre/base/file.h"

namespace nacre::tools {
namespace {

constexpr std::size_t kMostPoints = 1'000'000;

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (;;) {
    const std::size_t end = text.find(separator, begin);
    parts.push_back(text.substr(begin, end - begin));
    if (end == std::string::npos) return parts;
    begin = end + 1;
  }
}

std::string trimmed(const std::string& text) {
  const char* const blanks = " \t\r";
  const std::size_t begin = text.find_first_not_of(blanks);
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(blanks) - begin + 1);
}

template <class Number>
std::optional<Number> parse(const std::string& text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool is_key(const std::string& key) {
  return is_medium_key(key) || key == "camera" || (key.starts_with("light.") && key.size() > 6);
}
constexpr const char* kKeys =
    "sigma_a, sigma_s_prime, mfp, albedo, g, eta, scale, material, light.ID, camera";

// "sigma_a*": what is there is multiplied.
Setting make_setting(std::string key, std::string value) {
  Setting setting{std::move(key), std::move(value)};
  if (setting.key.ends_with('*')) {
    setting.relative = true;
    setting.key.pop_back();
  }
  return setting;
}

bool can_multiply(const std::string& key) { return is_medium_key(key) && key != "material"; }

void check_points(std::size_t count) {
  if (count > kMostPoints) throw UsageError("--vary: more than a million pictures");
}

}  // namespace

SweepAxis parse_axis(const std::string& text) {
  const auto wrong = [&](const std::string& why) {
    throw UsageError("--vary " + text + ": " + why +
                     "; write KEY=A:B:COUNT[:log], KEY*=A:B:COUNT[:log] or KEY=v1;v2;...");
  };
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) wrong("no =");
  SweepAxis axis{text.substr(0, equals), {}};
  const std::string values = text.substr(equals + 1);
  const Setting pattern = make_setting(axis.name, "");
  if (!is_key(pattern.key)) wrong(fmt::format("'{}' is none of {}", pattern.key, kKeys));
  if (pattern.relative && !can_multiply(pattern.key)) wrong("there is nothing to multiply");
  const std::vector<std::string> range = split(values, ':');
  if (range.size() == 1 || pattern.key == "material" || pattern.key == "camera") {
    for (const std::string& value : split(values, ';')) {
      if (trimmed(value).empty()) wrong("an empty value");
      for (const Setting& other : axis.values)
        if (other.value == trimmed(value)) wrong(trimmed(value) + " is given twice");
      axis.values.push_back(make_setting(axis.name, trimmed(value)));
    }
    return axis;
  }
  const bool logarithmic = range.size() == 4 && range[3] == "log";
  if (range.size() != 3 && !logarithmic) wrong("no range");
  const auto first = parse<double>(range[0]), last = parse<double>(range[1]);
  const auto count = parse<int>(range[2]);
  if (!first || !last || !std::isfinite(*first) || !std::isfinite(*last) || !count || *count < 1)
    wrong("A, B and COUNT are numbers, COUNT at least 1");
  if (logarithmic && !(*first > 0 && *last > 0)) wrong("a logarithmic range is above 0");
  check_points(static_cast<std::size_t>(*count));
  if (*first == *last && *count > 1) wrong("A and B are the same");
  for (int i = 0; i < *count; ++i) {
    const double at = *count == 1 ? 0 : static_cast<double>(i) / (*count - 1);
    const double value = logarithmic ? *first * std::pow(*last / *first, at) : *first + (*last - *first) * at;
    axis.values.push_back(make_setting(axis.name, fmt::format("{:.7g}", value)));
    if (i > 0 && axis.values[static_cast<std::size_t>(i) - 1].value == axis.values.back().value)
      wrong("steps are smaller than seven digits show");
  }
  return axis;
}

SweepPlan make_plan(const std::vector<std::string>& axes, bool together) {
  SweepPlan plan;
  for (const std::string& text : axes) {
    plan.axes.push_back(parse_axis(text));
    for (std::size_t i = 0; i + 1 < plan.axes.size(); ++i)
      if (plan.axes[i].values[0].key == plan.axes.back().values[0].key)
        throw UsageError("--vary " + text + ": varied twice");
  }
  if (together) {
    for (const SweepAxis& axis : plan.axes)
      if (axis.values.size() != plan.axes[0].values.size())
        throw UsageError(fmt::format("--zip: {} has {} values and {} has {}", plan.axes[0].name,
                                     plan.axes[0].values.size(), axis.name, axis.values.size()));
    for (std::size_t i = 0; i < plan.axes[0].values.size(); ++i) {
      std::vector<Setting>& point = plan.points.emplace_back();
      for (const SweepAxis& axis : plan.axes) point.push_back(axis.values[i]);
    }
    return plan;
  }
  plan.points.emplace_back();
  for (const SweepAxis& axis : plan.axes) {
    check_points(plan.points.size() * axis.values.size());
    std::vector<std::vector<Setting>> points;
    for (const std::vector<Setting>& point : plan.points)
      for (const Setting& value : axis.values) {
        points.push_back(point);
        points.back().push_back(value);
      }
    plan.points = std::move(points);
  }
  return plan;
}

SweepPlan load_plan(const std::string& path) {
  constexpr std::size_t kMostBytes = std::size_t{64} << 20;
  SweepPlan plan;
  const auto add = [&](std::vector<Setting>& point, const std::string& key, const std::string& value,
                       const std::string& place) {
    const Setting setting = make_setting(key, value);
    if (!is_key(setting.key) || (setting.relative && !can_multiply(setting.key)))
      fail(ErrorCode::kValue, place, "'{}' is none of {}", key, kKeys);
    for (const Setting& other : point)
      if (other.key == setting.key) fail(ErrorCode::kValue, place, "{} is given twice", setting.key);
    point.push_back(setting);
  };
  if (path.ends_with(".json")) {
    const nlohmann::ordered_json json = load_json(path, kMostBytes);
    if (!json.is_array())
      fail(ErrorCode::kSyntax, path, "is no list of points: [{{\"sigma_a\": 0.1, \"g\": \"0,0,0\"}}, ...]");
    for (const auto& entry : json) {
      const std::string place = fmt::format("{}: point {}", path, plan.points.size() + 1);
      if (!entry.is_object() || entry.empty()) fail(ErrorCode::kSyntax, place, "is no object with keys");
      std::vector<Setting>& point = plan.points.emplace_back();
      for (const auto& [key, value] : entry.items()) {
        const bool triple = value.is_array() && value.size() == 3 &&
                            std::ranges::all_of(value, [](const auto& v) { return v.is_number(); });
        if (!value.is_string() && !value.is_number() && !triple)
          fail(ErrorCode::kSyntax, place, "{} is neither a number, nor a text, nor [r, g, b]", key);
        const std::string text =
            triple ? fmt::format("{},{},{}", value[0].dump(), value[1].dump(), value[2].dump())
                   : value.dump();
        add(point, key, value.is_string() ? value.get<std::string>() : text, place);
      }
    }
  } else if (path.ends_with(".csv")) {
    // An r,g,b stands in quotes.
    const auto fields = [&](const std::string& line, int number) {
      std::vector<std::string> cells(1);
      bool quoted = false;
      for (const char c : line) {
        if (c == '"')
          quoted = !quoted;
        else if (c == ',' && !quoted)
          cells.emplace_back();
        else
          cells.back() += c;
      }
      if (quoted) fail(ErrorCode::kSyntax, fmt::format("{}:{}", path, number), "a quote is not closed");
      for (std::string& cell : cells) cell = trimmed(cell);
      return cells;
    };
    std::string text = read_text_file(path, kMostBytes);
    if (text.starts_with("\xef\xbb\xbf")) text.erase(0, 3);  // a mark that spreadsheets put there
    std::vector<std::string> keys;
    int number = 0;
    for (const std::string& line : split(text, '\n')) {
      ++number;
      if (trimmed(line).empty() || line[0] == '#') continue;
      const std::vector<std::string> cells = fields(line, number);
      const std::string place = fmt::format("{}:{}", path, number);
      if (keys.empty()) {
        keys = cells;
        std::vector<Setting> checked;
        for (const std::string& key : keys) add(checked, key, "", place);
        continue;
      }
      if (cells.size() != keys.size())
        fail(ErrorCode::kSyntax, place, "has {} values, and there are {} keys (an r,g,b stands in quotes)",
             cells.size(), keys.size());
      std::vector<Setting>& point = plan.points.emplace_back();
      for (std::size_t i = 0; i < keys.size(); ++i) add(point, keys[i], cells[i], place);
    }
  } else {
    fail(ErrorCode::kUnsupported, path, "a plan is a .csv or .json file");
  }
  if (plan.points.empty()) fail(ErrorCode::kValue, path, "holds no points");
  if (plan.points.size() > kMostPoints) fail(ErrorCode::kLimit, path, "holds more than a million points");
  return plan;
}

}  // namespace nacre::tools
