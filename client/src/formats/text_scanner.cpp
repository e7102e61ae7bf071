#include "formats/text_scanner.h"

#include <charconv>

#include "absl/strings/str_cat.h"

namespace amhex::client {
namespace {

constexpr size_t kQuotedLength = 40;

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

std::string_view WithoutPlus(std::string_view word) {
  if (word.size() > 1 && word.front() == '+') word.remove_prefix(1);
  return word;
}

}  // namespace

bool ParseDouble(std::string_view word, double* value) {
  const std::string_view digits = WithoutPlus(word);
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, *value);
  // Numbers too small for a double are zero for us, not an error.
  if (error == std::errc::result_out_of_range && stop == end) {
    *value = digits.find("e-") != std::string_view::npos ? 0.0 : 1e308 * 10;
    return true;
  }
  return error == std::errc() && stop == end;
}

bool ParseInteger(std::string_view word, int64_t* value) {
  const std::string_view digits = WithoutPlus(word);
  const char* end = digits.data() + digits.size();
  const auto [stop, error] = std::from_chars(digits.data(), end, *value);
  return error == std::errc() && stop == end;
}

std::string Quoted(std::string_view word) {
  std::string quoted = "\"";
  for (char c : word.substr(0, kQuotedLength)) quoted += (c >= 32 && c < 127) ? c : '?';
  return quoted + (word.size() > kQuotedLength ? "...\"" : "\"");
}

void TextScanner::SkipBlanks() {
  while (position_ < text_.size() && IsBlank(text_[position_])) ++position_;
  if (comment_ != 0 && position_ < text_.size() && text_[position_] == comment_) {
    while (position_ < text_.size() && text_[position_] != '\n') ++position_;
  }
}

std::string_view TextScanner::TakeWord() {
  const size_t begin = position_;
  while (position_ < text_.size() && text_[position_] != '\n' && !IsBlank(text_[position_])) {
    ++position_;
  }
  return text_.substr(begin, position_ - begin);
}

std::string_view TextScanner::NextWord() {
  SkipBlanks();
  while (position_ < text_.size() && text_[position_] == '\n') {
    ++position_;
    ++line_;
    SkipBlanks();
  }
  return TakeWord();
}

std::string_view TextScanner::NextWordOnLine() {
  SkipBlanks();
  return TakeWord();
}

void TextScanner::SkipLine() {
  while (position_ < text_.size() && text_[position_] != '\n') ++position_;
  if (position_ < text_.size()) {
    ++position_;
    ++line_;
  }
}

absl::StatusOr<double> TextScanner::NextDouble(std::string_view what) {
  const std::string_view word = NextWord();
  if (word.empty()) return Error("the text ends where " + std::string(what) + " is expected");
  double value = 0;
  if (!ParseDouble(word, &value)) {
    return Error(std::string(what) + " is not a number: " + Quoted(word));
  }
  return value;
}

absl::StatusOr<int64_t> TextScanner::NextInteger(std::string_view what) {
  const std::string_view word = NextWord();
  if (word.empty()) return Error("the text ends where " + std::string(what) + " is expected");
  int64_t value = 0;
  if (!ParseInteger(word, &value)) {
    return Error(std::string(what) + " is not a whole number: " + Quoted(word));
  }
  return value;
}

absl::Status TextScanner::Error(std::string_view message) const {
  return absl::InvalidArgumentError(absl::StrCat("line ", line_, ": ", std::string(message)));
}

}  // namespace amhex::client
