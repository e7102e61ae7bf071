// Clouds as scanners and their programs write them: a line of numbers per point, its position
// first. There is no standard; what is understood is told in hull_reader.h.
#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"
#include "formats/hull_builder.h"
#include "formats/hull_reader.h"
#include "formats/status_macros.h"
#include "formats/text_scanner.h"

namespace amhex::client {
namespace {

// Positions, colours, an intensity, a normal and some more.
constexpr int kMaxColumns = 16;
// Lengths of normals that were written with two or more decimals.
constexpr double kUnitTolerance = 0.02;

struct Row {
  std::array<double, kMaxColumns> number{};
  int count = 0;                // numbers before the first word that is none
  std::string_view other = {};  // that word

  Vec3d At(int column) const { return {number[column], number[column + 1], number[column + 2]}; }
  bool HasNormalAt(int column) const {
    return column >= 3 && column + 3 <= count && std::abs(Norm(At(column)) - 1) < kUnitTolerance;
  }
};

bool IsSeparator(char c) { return c == ' ' || c == '\t' || c == '\r' || c == ',' || c == ';'; }

Row RowOf(std::string_view line) {
  Row row;
  size_t at = 0;
  while (row.count < kMaxColumns) {
    while (at < line.size() && IsSeparator(line[at])) ++at;
    if (at == line.size()) break;
    const size_t begin = at;
    while (at < line.size() && !IsSeparator(line[at])) ++at;
    const std::string_view word = line.substr(begin, at - begin);
    if (!ParseDouble(word, &row.number[row.count])) {
      row.other = word;
      break;
    }
    ++row.count;
  }
  return row;
}

// In the last three columns, or right after the position; -1 if there is none.
int NormalColumnOf(const Row& row) {
  for (const int column : {row.count - 3, 3}) {
    if (row.HasNormalAt(column)) return column;
  }
  return -1;
}

bool IsComment(const Row& row) {
  return row.count == 0 &&
         (row.other.empty() || row.other.front() == '#' || row.other.substr(0, 2) == "//");
}

}  // namespace

absl::StatusOr<InputHull> ReadXyz(std::string_view bytes) {
  HullBuilder builder;
  int normal_column = -1;
  int64_t line_number = 0;
  bool is_first = true;
  while (!bytes.empty()) {
    const size_t length = std::min(bytes.find('\n'), bytes.size());
    const Row row = RowOf(bytes.substr(0, length));
    bytes.remove_prefix(std::min(length + 1, bytes.size()));
    ++line_number;
    if (IsComment(row)) continue;
    // The names of the columns, or how many points there are.
    const bool is_header = is_first && row.count < 3 && (row.count == 0 || row.other.empty());
    is_first = false;
    if (is_header) continue;
    if (row.count < 3) {
      return absl::InvalidArgumentError(
          absl::StrCat("line ", line_number, ": a point has three coordinates, here ", row.count,
                       " numbers", row.other.empty() ? "" : " are followed by ",
                       row.other.empty() ? "" : Quoted(row.other)));
    }
    if (builder.vertices.empty()) normal_column = NormalColumnOf(row);
    builder.vertices.push_back(row.At(0));
    if (normal_column >= 0 && !row.HasNormalAt(normal_column)) {
      normal_column = -1;  // no normals then, but colours or the like
      builder.normals.clear();
    }
    if (normal_column >= 0) builder.normals.push_back(row.At(normal_column));
  }
  return builder.Build();
}

}  // namespace amhex::client
