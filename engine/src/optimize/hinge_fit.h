// One step of Levenberg and Marquardt's for sums of squares of which only the positive parts count.
#pragma once

#include <cstdint>
#include <vector>

#include "amhex/vec3.h"

namespace amhex {

// What something lacks, and how that falls as unknown points move. Points are few: four for a
// corner of a cell.
struct HingeRow {
  double lack = 0;  // what is not positive counts for nothing
  struct Slope {
    int32_t point = 0;
    Vec3d fall;  // of the lack, as the point moves
  };
  std::vector<Slope> slopes;  // each point once
};

// The moves of the points for which
//   sum over rows of max(0, lack - sum of dot(fall, move))^2 + damping * sum of |move|^2
// is least, or nearly: rows change sides a bounded number of times. Damping must be positive. Work:
// the cube of the number of rows that lack, or of coordinates where these are fewer.
class HingeFit {
 public:
  HingeFit(std::vector<HingeRow> rows, int64_t point_count);

  std::vector<Vec3d> Solve(double damping);  // [point]

 private:
  // With F the falls of the active rows, the best moves are F^T x where (F F^T + damping) x = lack,
  // and they are where (F^T F + damping) moves = F^T lack.
  std::vector<Vec3d> MovesByRows(const std::vector<size_t>& active, double damping);
  std::vector<Vec3d> MovesByPoints(const std::vector<size_t>& active, double damping) const;
  void Multiply(size_t row);

  std::vector<HingeRow> rows_;
  size_t point_count_ = 0;
  bool is_by_rows_ = true;
  // Of rows that have been active so far, as few ever are.
  static constexpr int32_t kNotMultiplied = -1;
  std::vector<int32_t> number_;                // [row] in the order in which they came to be
  std::vector<size_t> numbered_;               // the other way round
  std::vector<std::vector<int32_t>> rows_at_;  // [point] their numbers
  std::vector<std::vector<double>> products_;  // [number][number up to that] of their falls
};

}  // namespace amhex
