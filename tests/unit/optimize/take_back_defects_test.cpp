// Laws of taking moves back: what they broke goes back, what they did not stays.
#include "optimize/take_back_defects.h"

#include <gtest/gtest.h>

#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::AddBeside;
using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::GridVertex;

constexpr GridSize kBar{16, 2, 2};

// A bar with a slit, the cells on whose two sides share no vertex: a short bar ends 0.2 before it.
struct SlitBar {
  CellComplex complex = GridComplex(kBar);
  Hull hull = GridHull({19, 2, 2}, 1.0);
  int32_t beside_slit = GridVertex(kBar, 16, 1, 1);
  int32_t far_from_it = GridVertex(kBar, 0, 1, 1);

  SlitBar() { AddBeside(GridComplex({2, 2, 2}), {16.2, 0, 0}, complex); }
};

TEST(TakeBackDefects, TakesBackWhatDipsIntoTheMeshAndNothingElse) {
  const SlitBar bar;
  CellComplex moved = bar.complex;
  moved.vertices[bar.beside_slit].x += 0.4;
  moved.vertices[bar.far_from_it].x += 0.1;
  TakeBackDefects(bar.hull, bar.complex.vertices, {}, &moved);
  EXPECT_EQ(moved.vertices[bar.beside_slit], bar.complex.vertices[bar.beside_slit]);
  EXPECT_NE(moved.vertices[bar.far_from_it], bar.complex.vertices[bar.far_from_it]);
}

TEST(TakeBackDefects, KeepsMovesWhateverIsWrongElsewhere) {
  SlitBar bar;
  bar.complex.vertices[bar.beside_slit].x += 0.4;  // wrong to begin with
  CellComplex moved = bar.complex;
  moved.vertices[bar.far_from_it].x += 0.1;
  const std::vector<Vec3d> expected = moved.vertices;
  TakeBackDefects(bar.hull, bar.complex.vertices, {}, &moved);
  EXPECT_EQ(moved.vertices, expected);
}

TEST(TakeBackDefects, LeavesWhatHasNotMoved) {
  const SlitBar bar;
  CellComplex same = bar.complex;
  TakeBackDefects(bar.hull, bar.complex.vertices, {}, &same);
  EXPECT_EQ(same.vertices, bar.complex.vertices);
}

}  // namespace
}  // namespace amhex
