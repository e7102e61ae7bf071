// Laws of moving the vertices of a place together: how firmly guards hold is the place's own.
#include "optimize/joint_place.h"

#include <gtest/gtest.h>

#include <vector>

#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;

constexpr GridSize kSize{4, 4, 4};

TEST(JointPlace, GuardsEachPlaceLooselyAtFirstAndNotEverMoreFirmly) {
  const Hull hull = GridHull(kSize, 0.5);
  const HullFeatures features(hull);
  CellComplex complex = GridComplex(kSize);
  Placement placement = PreparePlacement(complex, features);
  JointPlace place(placement);
  for (const int32_t cell : {0, 5}) {
    place.Enter({cell});
    int times = 0;
    while (times < 100 && place.GuardMoreFirmly()) ++times;
    EXPECT_GT(times, 0) << cell;
    EXPECT_LT(times, 10) << cell;
    EXPECT_FALSE(place.GuardMoreFirmly()) << cell;
    place.Leave();
  }
}

}  // namespace
}  // namespace amhex
