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

  std::vector<Vec3d> Solve(double damping) const;  // [point]

 private:
  // With F the falls of the active rows, the best moves are F^T x where (F F^T + damping) x = lack,
  // and they are where (F^T F + damping) moves = F^T lack.
  std::vector<Vec3d> MovesByRows(const std::vector<size_t>& active, double damping) const;
  std::vector<Vec3d> MovesByPoints(const std::vector<size_t>& active, double damping) const;
  void MultiplyRows();
  double& ProductOf(size_t a, size_t b) { return products_[a * rows_.size() + b]; }
  double ProductOf(size_t a, size_t b) const { return products_[a * rows_.size() + b]; }

  std::vector<HingeRow> rows_;
  size_t point_count_ = 0;
  bool is_by_rows_ = true;
  std::vector<double> products_;  // [row][row] of their falls, by rows
};

}  // namespace amhex
