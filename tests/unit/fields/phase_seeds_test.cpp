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
  SeedFreePhases(GridLevel{}, {}, LatticeForm{}, {}, &x);
  EXPECT_TRUE(x.empty());
}

TEST(PhaseSeeds, AdvanceByTheFormAlongEveryEdgeOfTheAxesWithoutTarget) {
  SolvedFields fields(fixtures::MakeBox({3, 4, 5}, 1));
  ASSERT_TRUE(fields.ok);
  const int64_t count = fields.grid.count();
  std::vector<uint8_t> has_target(3 * count, 0);
  // Ties one axis of the first node: in a box that axis keeps its name everywhere or changes it
  // with the codes, but never becomes one of the other two.
  has_target[0] = 1;
  std::vector<float> x(6 * count, 0.0F);
  SeedFreePhases(fields.grid.fine(), fields.codes, fields.form, has_target, &x);
  int64_t free_edges = 0;
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
        EXPECT_LT(std::abs(here * std::polar(1.0, turn) - there), 0.01);
        free_edges += std::abs(here) > 0.5 ? 1 : 0;
      }
    }
  }
  const int64_t edges = 5 * 8 * 10 + 6 * 7 * 10 + 6 * 8 * 9;
  EXPECT_EQ(free_edges, 2 * edges);
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
