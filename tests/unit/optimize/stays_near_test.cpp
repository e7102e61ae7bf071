// Laws of what refilling may do to the boundary: come nearer to the hull, however much space that
// adds, and go no farther from it.
#include "optimize/stays_near.h"

#include <gtest/gtest.h>

#include "closure/working_mesh.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::GridVertex;

constexpr GridSize kCube{4, 4, 4};

CellComplex WithoutCornerCell() {
  WorkingMesh mesh(GridComplex(kCube));
  mesh.RemoveCell(0);
  for (const CellFace& face : mesh.OpenFaces()) mesh.MarkHull(face);
  return mesh.ToComplex();
}

bool Stays(const CellComplex& before, const CellComplex& after) {
  return StaysNear(GridHull(kCube, 0.5), before, after, {});
}

TEST(StaysNear, FillingWhatWasCutOffDoesAndCuttingItOffDoesNot) {
  const CellComplex whole = GridComplex(kCube), cut = WithoutCornerCell();
  EXPECT_TRUE(Stays(cut, whole));
  EXPECT_FALSE(Stays(whole, cut));
  EXPECT_TRUE(Stays(whole, whole));
  EXPECT_TRUE(Stays(cut, cut));
}

TEST(StaysNear, AFaceThatLeavesTheHullDoesOnlyAsFarAsThatCanBeMended) {
  const CellComplex whole = GridComplex(kCube);
  const auto lifted = [&](double by) {
    CellComplex complex = whole;
    complex.vertices[GridVertex(kCube, 2, 2, 4)].z += by;  // middles of its faces by a quarter
    return complex;
  };
  EXPECT_TRUE(Stays(whole, lifted(0.2)));
  EXPECT_FALSE(Stays(whole, lifted(2.0)));
  EXPECT_FALSE(Stays(whole, lifted(-2.0))) << "samples of the hull are left behind";
  EXPECT_TRUE(Stays(lifted(2.0), lifted(1.9))) << "no worse than it was";
}

TEST(StaysNear, WhatIsFarElsewhereDoesNotMatter) {
  const CellComplex cut = WithoutCornerCell();
  CellComplex moved = cut;
  moved.vertices[static_cast<size_t>(moved.hull_faces.back().v[0])].z += 0.05;
  EXPECT_TRUE(Stays(cut, moved));
}

}  // namespace
}  // namespace amhex
