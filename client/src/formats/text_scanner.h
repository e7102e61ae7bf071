// Reads words and numbers from text held in memory and remembers where it stands.
//
// Never allocates, never reads past the end; every error names the line.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace amhex::client {

class TextScanner {
 public:
  // `comment` starts a comment that runs to the end of its line; 0 = the format has none.
  // The text must outlive the scanner.
  explicit TextScanner(std::string_view text, char comment = 0) : text_(text), comment_(comment) {}

  // The next word on any line; empty at the end of the text.
  std::string_view NextWord();
  // The next word of the current line; empty at the line's end.
  std::string_view NextWordOnLine();
  // Leaves the current line, whatever is left of it.
  void SkipLine();

  // The next word as a number; `what` is named in the error, e.g. "x of vertex 3".
  absl::StatusOr<double> NextDouble(std::string_view what);
  absl::StatusOr<int64_t> NextInteger(std::string_view what);

  // INVALID_ARGUMENT "line 12: <message>".
  absl::Status Error(std::string_view message) const;

  int64_t line() const { return line_; }
  size_t position() const { return position_; }
  size_t remaining() const { return text_.size() - position_; }
  bool AtEnd() const { return position_ >= text_.size(); }

 private:
  void SkipBlanks();
  std::string_view TakeWord();

  std::string_view text_;
  char comment_ = 0;
  size_t position_ = 0;
  int64_t line_ = 1;
};

// Whole word as a number; false if anything but a number stands there.
bool ParseDouble(std::string_view word, double* value);
bool ParseInteger(std::string_view word, int64_t* value);

// At most 40 printable characters of `word`, for messages about hostile files.
std::string Quoted(std::string_view word);

}  // namespace amhex::client
