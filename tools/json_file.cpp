// Where JSON ends to be some.
#include "json_file.h"

#include <algorithm>
#include <set>
#include <vector>

#include "nacre/base/file.h"

namespace nacre::tools {

nlohmann::ordered_json load_json(const std::string& path, std::size_t max_bytes) {
  using Json = nlohmann::ordered_json;
  const std::string text = read_text_file(path, max_bytes);
  std::vector<std::set<std::string>> keys;  // of the objects that are open
  const auto check_keys = [&](int, Json::parse_event_t event, Json& value) {
    if (event == Json::parse_event_t::object_start) keys.emplace_back();
    if (event == Json::parse_event_t::object_end) keys.pop_back();
    if (event == Json::parse_event_t::key && !keys.back().insert(value.get<std::string>()).second)
      fail(ErrorCode::kSyntax, path, "has {} twice in one object",
           value.dump(-1, ' ', true, Json::error_handler_t::replace));
    return true;
  };
  try {
    return Json::parse(text, check_keys);
  } catch (const Json::parse_error& error) {
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
    fail(ErrorCode::kSyntax, fmt::format("{}:{}", path, 1 + std::count(text.begin(), end, '\n')),
         "is not JSON from here on");
  } catch (const Json::out_of_range&) {
    fail(ErrorCode::kValue, path, "holds a number that is too large");
  }
}

}  // namespace nacre::tools
