#include "fields/phase_seeds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "exec/cpu_executor.h"
#include "fields/face_links.h"
#include "fields/node_links.h"
#include "fields/phase_field.h"
#include "fields/phase_seeds_impl.h"
#include "fixtures/solids.h"
#include "unit/fields/field_fixtures.h"

namespace amhex::fields {
namespace {

std::complex<double> PhaseOf(const std::vector<float>& x, int64_t u) {
  return {x[2 * u], x[2 * u + 1]};
}

// The matrix' turns without any hull.
class TurnedEdges {
 public:
  explicit TurnedEdges(const SolvedFields& fields)
      : links_(fields.grid.fine(), fields.codes, fields.run), turns_(18 * fields.grid.count()) {
    for (int64_t k = 0; k < 9 * fields.grid.count(); ++k) {
      const double increments = fields.form.increments[k / 9][k / 3 % 3][static_cast<int>(k % 3)];
      const std::complex<double> turn = std::polar(1.0, 2 * std::numbers::pi * increments);
      turns_[2 * k] = static_cast<float>(turn.real());
      turns_[2 * k + 1] = static_cast<float>(turn.imag());
    }
  }
  PhaseOperator Matrix() const {
    return {links_.View(), {turns_.data(), static_cast<int64_t>(turns_.size())}, {}, {}, 0};
  }

 private:
  OwnedLinks links_;
  std::vector<float> turns_;
};

TEST(PhaseSeeds, OfNoNodesAreNone) {
  std::vector<float> x;
  SeedWeakPhases(PhaseOperator{}, {}, &x);
  EXPECT_TRUE(x.empty());
}

TEST(PhaseSeeds, AdvanceByTheFormAlongEveryEdgeFromTheOneKnownPhase) {
  SolvedFields fields(fixtures::MakeBox({3, 4, 5}, 1));
  ASSERT_TRUE(fields.ok);
  const int64_t count = fields.grid.count();
  std::vector<float> x(6 * count, 0.0F);
  const std::complex<double> known = 0.3 * std::polar(1.0, 1.1);
  x[0] = static_cast<float>(known.real());
  x[1] = static_cast<float>(known.imag());
  x[2] = static_cast<float>(kWeakPhase / 2);  // noise: not kept
  const TurnedEdges edges(fields);
  SeedWeakPhases(edges.Matrix(), {}, &x);
  EXPECT_LT(std::abs(PhaseOf(x, 0) - known), 1e-6);
  x[0] /= 0.3F, x[1] /= 0.3F;
  for (int64_t i = 0; i < count; ++i) {
    for (int d = 0; d < 3; ++d) {
      const int32_t j = fields.grid.fine().neighbours[i][d];
      if (j < 0) continue;
      const AxisRotation& rotation = kAxisRotations[fields.codes[i][d]];
      for (int a = 0; a < 3; ++a) {
        const std::complex<double> here = PhaseOf(x, 3 * i + a);
        std::complex<double> there = PhaseOf(x, 3 * int64_t{j} + rotation.source[a]);
        if (rotation.sign[a] < 0) there = std::conj(there);
        const double turn = 2 * std::numbers::pi * fields.form.increments[i][d][a];
        EXPECT_NEAR(std::abs(here), 1, 1e-5);
        EXPECT_LT(std::abs(here * std::polar(1.0, turn) - there), 0.01);
      }
    }
  }
}

// Strong phases here and there, parts of the grid that none reaches, and none at all.
TEST(PhaseSeeds, AreTheSameWhenAllNumbersLookForTheirNeighboursAtOnce) {
  SolvedFields fields(fixtures::MakeTorus(3, 1.2, 0.5));
  ASSERT_TRUE(fields.ok);
  const TurnedEdges edges(fields);
  const int64_t count = 3 * fields.grid.count();
  for (const int64_t strong_each : {count + 1, int64_t{997}, int64_t{31}}) {
    std::vector<float> x(2 * count, 0.0F);
    for (int64_t u = strong_each - 1; u < count; u += strong_each) x[2 * u + u % 2] = 0.5F;
    std::vector<float> expected = x;
    SeedWeakPhases(edges.Matrix(), {}, &expected);
    CpuExecutor executor;
    PhaseSeeds<CpuExecutor>(executor, edges.Matrix(), {x.data(), 2 * count}).Run();
    EXPECT_EQ(x, expected);
    for (int64_t u = 0; u < count; ++u) EXPECT_GT(std::abs(PhaseOf(x, u)), 0.4);
  }
}

// Nothing on a ring fixes the phase along it.
TEST(PhaseField, ClosesAlmostEverywhereAroundARing) {
  SolvedFields fields(fixtures::MakeTorus(8, 2.5, 0.5));
  ASSERT_TRUE(fields.ok);
  const auto positions =
      SolvePhaseField(fields.grid, fields.codes, fields.form, {}, ProgressSlice(fields.run, 0, 1));
  ASSERT_TRUE(positions.ok());
  const FieldDefects defects = CountDefects(fields.grid, fields.form, *positions, fields.run);
  EXPECT_LT(defects.dislocated, defects.square_count / 100);
}

}  // namespace
}  // namespace amhex::fields
