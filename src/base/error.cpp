// The exception's text.
#include "nacre/base/error.h"

namespace nacre {

std::string one_line(std::string text) {
  constexpr std::size_t kLongest = 4096;
  if (text.size() > kLongest) text = text.substr(0, kLongest) + "...";
  for (char& c : text)
    if (static_cast<unsigned char>(c) < ' ' || c == 0x7f) c = '?';
  return text;
}

Error::Error(ErrorCode error_code, std::string error_place, std::string error_reason)
    : code_(error_code),
      place_(one_line(std::move(error_place))),
      reason_(one_line(std::move(error_reason))),
      text_(place_.empty() ? reason_ : place_ + ": " + reason_) {}

}  // namespace nacre
