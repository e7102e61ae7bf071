#include "fields/phase_seeds.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>

#include "fields/face_links.h"
#include "fields/phase_field.h"
#include "fixtures/solids.h"
#include "unit/fields/field_fixtures.h"

namespace amhex::fields {
namespace {

std::complex<double> PhaseOf(const std::vector<float>& x, int64_t u) {
  return {x[2 * u], x[2 * u + 1]};
}

TEST(PhaseSeeds, OfNoNodesAreNone) {
  std::vector<float> x;
  SeedWeakPhases(GridLevel{}, {}, LatticeForm{}, &x);
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
  SeedWeakPhases(fields.grid.fine(), fields.codes, fields.form, &x);
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
