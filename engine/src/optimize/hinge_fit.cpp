#include "optimize/hinge_fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace amhex {
namespace {

// Which rows lack after a step is found by solving for those that do, again and again.
constexpr int kMostRounds = 8;

// Solves m x = b for a symmetric positive definite m, of which the lower triangle is given row by
// row; both are overwritten, b by x.
void SolveCholesky(std::vector<double>* m, std::vector<double>* b) {
  const size_t n = b->size();
  const auto row = [&](size_t i) { return m->data() + i * n; };
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j <= i; ++j) {
      double sum = row(i)[j];
      for (size_t k = 0; k < j; ++k) sum -= row(i)[k] * row(j)[k];
      row(i)[j] = i == j ? std::sqrt(sum) : sum / row(j)[j];
    }
    for (size_t k = 0; k < i; ++k) (*b)[i] -= row(i)[k] * (*b)[k];
    (*b)[i] /= row(i)[i];
  }
  for (size_t i = n; i-- > 0;) {
    (*b)[i] /= row(i)[i];
    for (size_t k = 0; k < i; ++k) (*b)[k] -= row(i)[k] * (*b)[i];
  }
}

}  // namespace

HingeFit::HingeFit(std::vector<HingeRow> rows, int64_t point_count)
    : rows_(std::move(rows)),
      point_count_(point_count),
      products_(rows_.size() * rows_.size(), 0.0) {
  std::vector<Vec3d> falls(static_cast<size_t>(point_count));  // of one row, zero elsewhere
  for (size_t a = 0; a < rows_.size(); ++a) {
    for (const HingeRow::Slope& slope : rows_[a].slopes) falls[slope.point] = slope.fall;
    for (size_t b = 0; b <= a; ++b) {
      for (const HingeRow::Slope& slope : rows_[b].slopes) {
        ProductOf(a, b) += Dot(falls[slope.point], slope.fall);
      }
      ProductOf(b, a) = ProductOf(a, b);
    }
    for (const HingeRow::Slope& slope : rows_[a].slopes) falls[slope.point] = Vec3d{};
  }
}

std::vector<Vec3d> HingeFit::Solve(double damping) const {
  std::vector<size_t> active;
  for (size_t i = 0; i < rows_.size(); ++i) {
    if (rows_[i].lack > 0) active.push_back(i);
  }
  std::vector<double> factors;
  for (int round = 0; round < kMostRounds; ++round) {
    factors = FactorsOf(active, damping);
    std::vector<size_t> lacking;
    for (size_t i = 0; i < rows_.size(); ++i) {
      double lack = rows_[i].lack;
      for (size_t k = 0; k < active.size(); ++k) lack -= factors[k] * ProductOf(i, active[k]);
      if (lack > 0) lacking.push_back(i);
    }
    if (lacking == active || round + 1 == kMostRounds) break;
    active = std::move(lacking);
  }
  std::vector<Vec3d> moves(static_cast<size_t>(point_count_));
  for (size_t k = 0; k < active.size(); ++k) {
    for (const HingeRow::Slope& slope : rows_[active[k]].slopes) {
      moves[slope.point] += slope.fall * factors[k];
    }
  }
  return moves;
}

// With F the falls of the active rows, the best moves are F^T x where (F F^T + damping) x = lack.
std::vector<double> HingeFit::FactorsOf(const std::vector<size_t>& active, double damping) const {
  const size_t n = active.size();
  std::vector<double> matrix(n * n), factors(n);
  for (size_t i = 0; i < n; ++i) {
    for (size_t j = 0; j <= i; ++j) matrix[i * n + j] = ProductOf(active[i], active[j]);
    matrix[i * n + i] += damping;
    factors[i] = rows_[active[i]].lack;
  }
  SolveCholesky(&matrix, &factors);
  return factors;
}

}  // namespace amhex
