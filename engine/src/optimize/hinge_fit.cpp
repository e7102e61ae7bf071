#include "optimize/hinge_fit.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "base/vector_lanes.h"

namespace amhex {
namespace {

// Which rows lack after a step is found by solving for those that do, again and again.
constexpr int kMostHingeRounds = 8;
// Fits with more rows that lack are solved by coordinates. That is less work from 3 on, but up to 6
// neither shows in a run's time.
constexpr size_t kMostRowsPerPoint = 6;

size_t PaddedToLanes(size_t count) {
  return static_cast<size_t>(LaneBlocks(static_cast<int64_t>(count))) * kLanes;
}

// Four numbers, not eight: those the compiler would keep in memory where registers hold four.
AMHEX_LANES_INLINE HalfLanes& LanesAt(double* p) { return *reinterpret_cast<HalfLanes*>(p); }

// The rows before row i of a factor, as far as they reach beyond column i, times what they have
// there, are subtracted from it. Each number sees the rows in their order, but four of them while
// it is at hand.
AMHEX_LANES_INLINE void SubtractRowsBefore(size_t i, size_t stride, double* m) {
  double* row = m + i * stride;
  const size_t begin = i / kHalfLanes * kHalfLanes;
  size_t k = 0;
  for (; k + 4 <= i; k += 4) {
    double *a = m + k * stride, *b = a + stride, *c = b + stride, *d = c + stride;
    const double at_a = a[i], at_b = b[i], at_c = c[i], at_d = d[i];
    for (size_t j = begin; j < stride; j += kHalfLanes) {
      HalfLanes rest = LanesAt(row + j) - at_a * LanesAt(a + j);
      rest -= at_b * LanesAt(b + j);
      rest -= at_c * LanesAt(c + j);
      LanesAt(row + j) = rest - at_d * LanesAt(d + j);
    }
  }
  for (; k < i; ++k) {
    double* a = m + k * stride;
    const double at_a = a[i];
    for (size_t j = begin; j < stride; j += kHalfLanes) {
      LanesAt(row + j) -= at_a * LanesAt(a + j);
    }
  }
}

// Solves m x = b for a symmetric positive definite m, of which the upper triangle is given row by
// row, each padded to a multiple of kLanes; both are overwritten, b by x.
void SolveCholesky(std::vector<double>* m, std::vector<double>* b) {
  const size_t n = b->size(), stride = PaddedToLanes(n);
  const auto row = [&](size_t i) { return m->data() + i * stride; };
  RunWithWidestVectors([&] {
    for (size_t i = 0; i < n; ++i) {
      SubtractRowsBefore(i, stride, m->data());
      row(i)[i] = std::sqrt(row(i)[i]);
      for (size_t j = i + 1; j < n; ++j) row(i)[j] /= row(i)[i];
    }
  });
  for (size_t k = 0; k < n; ++k) {
    (*b)[k] /= row(k)[k];
    for (size_t i = k + 1; i < n; ++i) (*b)[i] -= row(k)[i] * (*b)[k];
  }
  for (size_t k = n; k-- > 0;) {
    for (size_t i = n; i-- > k + 1;) (*b)[k] -= row(k)[i] * (*b)[i];
    (*b)[k] /= row(k)[k];
  }
}

double Remainder(const HingeRow& row, const std::vector<Vec3d>& moves) {
  double lack = row.lack;
  for (const HingeRow::Slope& slope : row.slopes) lack -= Dot(slope.fall, moves[slope.point]);
  return lack;
}

}  // namespace

HingeFit::HingeFit(std::vector<HingeRow> rows, int64_t point_count)
    : rows_(std::move(rows)), point_count_(static_cast<size_t>(point_count)) {
  const auto lacking = static_cast<size_t>(
      std::count_if(rows_.begin(), rows_.end(), [](const HingeRow& row) { return row.lack > 0; }));
  is_by_rows_ = lacking <= kMostRowsPerPoint * point_count_;
  if (!is_by_rows_) return;
  number_.assign(rows_.size(), kNotMultiplied);
  rows_at_.resize(point_count_);
}

// With those that have been before. A sum goes along the points of the earlier one of two rows.
void HingeFit::Multiply(size_t row) {
  if (number_[row] != kNotMultiplied) return;
  const auto own = static_cast<int32_t>(numbered_.size());
  number_[row] = own;
  numbered_.push_back(row);
  std::vector<double>& products = products_.emplace_back(numbered_.size(), 0.0);
  std::vector<uint8_t> is_met(numbered_.size(), 0);
  for (const HingeRow::Slope& slope : rows_[row].slopes) rows_at_[slope.point].push_back(own);
  for (const HingeRow::Slope& shared : rows_[row].slopes) {
    for (const int32_t other : rows_at_[shared.point]) {
      if (std::exchange(is_met[other], 1) != 0) continue;
      const size_t first = std::min(row, numbered_[other]), last = std::max(row, numbered_[other]);
      for (const HingeRow::Slope& slope : rows_[first].slopes) {
        for (const HingeRow::Slope& of_last : rows_[last].slopes) {
          if (of_last.point == slope.point) products[other] += Dot(of_last.fall, slope.fall);
        }
      }
    }
  }
}

std::vector<Vec3d> HingeFit::Solve(double damping) {
  std::vector<Vec3d> moves(point_count_);
  std::vector<size_t> active;
  for (int round = 0; round < kMostHingeRounds; ++round) {
    std::vector<size_t> lacking;
    for (size_t i = 0; i < rows_.size(); ++i) {
      if (Remainder(rows_[i], moves) > 0) lacking.push_back(i);
    }
    if (lacking == active) break;
    active = std::move(lacking);
    moves = is_by_rows_ ? MovesByRows(active, damping) : MovesByPoints(active, damping);
  }
  return moves;
}

std::vector<Vec3d> HingeFit::MovesByRows(const std::vector<size_t>& active, double damping) {
  for (const size_t row : active) Multiply(row);
  const size_t n = active.size(), stride = PaddedToLanes(n);
  std::vector<double> matrix(n * stride), factors(n);
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = i; j < n; ++j) {
      const auto [low, high] = std::minmax(number_[active[i]], number_[active[j]]);
      matrix[i * stride + j] = products_[high][low];
    }
    matrix[i * stride + i] += damping;
    factors[i] = rows_[active[i]].lack;
  }
  SolveCholesky(&matrix, &factors);
  std::vector<Vec3d> moves(point_count_);
  for (size_t k = 0; k < n; ++k) {
    for (const HingeRow::Slope& slope : rows_[active[k]].slopes) {
      moves[slope.point] += slope.fall * factors[k];
    }
  }
  return moves;
}

std::vector<Vec3d> HingeFit::MovesByPoints(const std::vector<size_t>& active,
                                           double damping) const {
  const size_t n = 3 * point_count_, stride = PaddedToLanes(n);
  std::vector<double> matrix(n * stride), moves(n);
  for (size_t i = 0; i < n; ++i) matrix[i * stride + i] = damping;
  for (const size_t row : active) {
    for (const HingeRow::Slope& a : rows_[row].slopes) {
      double* at = moves.data() + ptrdiff_t{3} * a.point;
      for (int i = 0; i < 3; ++i) at[i] += a.fall[i] * rows_[row].lack;
      for (const HingeRow::Slope& b : rows_[row].slopes) {
        if (b.point < a.point) continue;  // the upper triangle
        double* block = matrix.data() + 3 * (a.point * stride + b.point);
        for (int i = 0; i < 3; ++i) {
          for (int j = 0; j < 3; ++j) block[i * stride + j] += a.fall[i] * b.fall[j];
        }
      }
    }
  }
  SolveCholesky(&matrix, &moves);
  std::vector<Vec3d> by_point(point_count_);
  for (size_t p = 0; p < point_count_; ++p) {
    by_point[p] = {moves[3 * p], moves[3 * p + 1], moves[3 * p + 2]};
  }
  return by_point;
}

}  // namespace amhex
