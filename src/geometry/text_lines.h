// Lines, words and numbers of a text that may be hostile, with errors that name the line.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "nacre/base/error.h"

namespace nacre {

inline bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

/// Takes the next word off the front of `line`; empty at its end.
inline std::string_view take_word(std::string_view& line) {
  std::size_t begin = 0;
  while (begin < line.size() && is_blank(line[begin])) ++begin;
  std::size_t end = begin;
  while (end < line.size() && !is_blank(line[end])) ++end;
  const std::string_view word = line.substr(begin, end - begin);
  line.remove_prefix(end);
  return word;
}

/// A word for an error message: of bounded length and printable, whatever the file holds.
inline std::string quote_word(std::string_view word) {
  std::string text(word.substr(0, 40));
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 32 || static_cast<unsigned char>(c) > 126) c = '?';
  return '"' + text + (word.size() > 40 ? "...\"" : "\"");
}

/// Goes through the lines of a text, which may be changed in place meanwhile.
class LineReader {
 public:
  LineReader(std::string& text, std::string path) : text_(text), path_(std::move(path)) {}

  /// Moves to the next line; false at the end.
  bool next() {
    if (next_ >= text_.size()) return false;
    begin_ = next_;
    end_ = std::min(text_.find('\n', begin_), text_.size());
    next_ = end_ + 1;
    ++number_;
    return true;
  }
  /// Moves to the next line that is not blank; fails at the end, where `what` was expected.
  void require_next(const char* what) {
    while (next())
      if (line().find_first_not_of(" \t\r\v\f") != std::string_view::npos) return;
    fail_here(ErrorCode::kSyntax, "the file ends where {} should follow", what);
  }
  std::string_view line() const { return std::string_view(text_).substr(begin_, end_ - begin_); }
  /// Overwrites `part`, a view into the text, with blanks.
  void blank(std::string_view part) {
    std::fill_n(text_.begin() + (part.data() - text_.data()), part.size(), ' ');
  }
  std::uint64_t number() const { return number_; }
  /// Where the next line begins in the text.
  std::size_t next_begin() const { return std::min(next_, text_.size()); }

  template <class... Args>
  [[noreturn]] void fail_here(ErrorCode code, fmt::format_string<Args...> format, Args&&... args) const {
    fail(code, path_, "line {}: {}", number_, fmt::format(format, std::forward<Args>(args)...));
  }

  /// Takes a finite number that fits a float off the front of `line`.
  double take_number(std::string_view& line, const char* what) const {
    const std::string_view word = take_word(line);
    if (word.empty()) fail_here(ErrorCode::kSyntax, "a number is missing in {}", what);
    const std::string_view digits = word.front() == '+' ? word.substr(1) : word;
    double value = 0;
    const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (stop != digits.data() + digits.size())
      fail_here(ErrorCode::kSyntax, "{} in {} is not a number", quote_word(word), what);
    if (error != std::errc{} || !(std::abs(value) <= double{std::numeric_limits<float>::max()}))
      fail_here(ErrorCode::kValue, "{} in {} is not a finite number", quote_word(word), what);
    return value;
  }

  /// Parses a whole word as an integer.
  std::int64_t parse_integer(std::string_view word, const char* what) const {
    std::int64_t value = 0;
    const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || stop != word.data() + word.size())
      fail_here(ErrorCode::kSyntax, "{} in {} is not an integer", quote_word(word), what);
    return value;
  }

 private:
  std::string& text_;
  std::string path_;
  std::size_t begin_ = 0, end_ = 0, next_ = 0;
  std::uint64_t number_ = 0;
};

}  // namespace nacre
