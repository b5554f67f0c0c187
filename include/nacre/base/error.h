// The one exception type of nacre, and the list in which functions return their warnings.
#pragma once

#include <fmt/format.h>

#include <exception>
#include <string>
#include <string_view>
#include <vector>

namespace nacre {

enum class ErrorCode {
  kNotFound,     // a file that is not there
  kIo,           // the machine failed: unreadable, unwritable, full
  kSyntax,       // text or bytes that are not of the format
  kUnsupported,  // well formed, but outside what nacre does
  kValue,        // a value of the wrong type or outside its range
  kNotACache,    // cache files: something else
  kNewerVersion,
  kTruncated,
  kDamaged,
  kMismatch,  // a cache of another scene
  kLimit,     // more than this machine or nacre can hold
};

/// Names and words from files as they may be quoted in a message: one line that does nothing to a terminal,
/// whatever they hold, and not without end.
std::string one_line(std::string text);

/// One thing that went wrong: `place` is "file:line", "file: byte N" or "--option"; `reason` says what is
/// wrong and what to do, in one line. what() is "place: reason".
class Error : public std::exception {
 public:
  Error(ErrorCode error_code, std::string error_place, std::string error_reason);
  const char* what() const noexcept override { return text_.c_str(); }
  ErrorCode code() const noexcept { return code_; }
  const std::string& place() const noexcept { return place_; }
  const std::string& reason() const noexcept { return reason_; }

 private:
  ErrorCode code_;
  std::string place_, reason_, text_;
};

/// Throws Error with a formatted reason.
template <class... Args>
[[noreturn]] void fail(ErrorCode code, std::string place, fmt::format_string<Args...> format,
                       Args&&... args) {
  throw Error(code, std::move(place), fmt::format(format, std::forward<Args>(args)...));
}

/// Things worth saying that did not stop the work: each one line, "place: reason", without a newline.
/// Functions append to the list they are given; only a tool prints it.
using Warnings = std::vector<std::string>;

}  // namespace nacre
