#include "closure/carve.h"

#include <gtest/gtest.h>

#include <random>

#include "closure/cavities.h"
#include "closure/hull_patch.h"
#include "closure/prepare_cavities.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;

constexpr GridSize kSize{8, 8, 8};

// One connected void, far too long for one star: a random walk through the inside of the grid.
WorkingMesh GridWithTunnel(unsigned seed) {
  WorkingMesh mesh(GridComplex(kSize));
  std::minstd_rand random(seed);
  std::array<int, 3> at = {4, 4, 4};
  for (int step = 0; step < 40; ++step) {
    const int cell = at[0] + kSize.nx * (at[1] + kSize.ny * at[2]);
    if (mesh.alive(cell)) mesh.RemoveCell(cell);
    int& coordinate = at[random() / 7 % 3];
    coordinate = std::clamp(coordinate + (random() / 7 % 2 == 0 ? 1 : -1), 1, 6);
  }
  return mesh;
}

double Volume(const WorkingMesh& mesh) {
  double volume = 0;
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (mesh.alive(cell)) volume += CellVolume(mesh.corners(cell), mesh.vertices());
  }
  return volume;
}

TEST(CarveCavities, LeavesAMeshWithoutOpenFacesAlone) {
  const Hull hull = GridHull(kSize, 1.0);
  WorkingMesh mesh(GridComplex(kSize));
  CarveMemory memory;
  RunContext run;
  EXPECT_EQ(CarveCavities(hull, {}, run, &memory, &mesh), 0);
  EXPECT_EQ(mesh.cell_slots(), 512);
}

TEST(CarveCavities, EveryRoundLeavesFewerFacesOpenAndOnlyGoodCells) {
  const Hull hull = GridHull(kSize, 1.0);
  const CarveLimits limits{0.1, 8.0, 3};
  for (unsigned seed = 1; seed <= 6; ++seed) {
    SCOPED_TRACE(seed);
    WorkingMesh mesh = GridWithTunnel(seed);
    const double before = Volume(mesh);
    CarveMemory memory;
    RunContext run;
    size_t open = mesh.OpenFaces().size();
    int stars = 0;
    while (const int applied = CarveCavities(hull, limits, run, &memory, &mesh)) {
      stars += applied;
      EXPECT_LT(mesh.OpenFaces().size(), open);
      open = mesh.OpenFaces().size();
    }
    EXPECT_GT(stars, 0);
    EXPECT_GT(Volume(mesh), before);
    EXPECT_LT(Volume(mesh), 512 + 1e-9);
    for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
      if (!mesh.alive(cell)) continue;
      EXPECT_GE(ScaledJacobian(mesh.corners(cell), mesh.vertices()), limits.min_quality - 1e-12);
    }
  }
}

TEST(CarveCavities, IsTheSameEveryTime) {
  const Hull hull = GridHull(kSize, 1.0);
  WorkingMesh a = GridWithTunnel(3), b = GridWithTunnel(3);
  CarveMemory memory_a, memory_b;
  RunContext run;
  EXPECT_EQ(CarveCavities(hull, {}, run, &memory_a, &a),
            CarveCavities(hull, {}, run, &memory_b, &b));
  EXPECT_EQ(a.ToComplex().cells, b.ToComplex().cells);
  EXPECT_TRUE(a.vertices() == b.vertices());
}

TEST(CarveCavities, DoesNothingOnceTheRunIsToStop) {
  const Hull hull = GridHull(kSize, 1.0);
  WorkingMesh mesh = GridWithTunnel(1);
  const size_t open = mesh.OpenFaces().size();
  CarveMemory memory;
  RunContext run;
  run.RequestStop();
  EXPECT_EQ(CarveCavities(hull, {}, run, &memory, &mesh), 0);
  EXPECT_EQ(mesh.OpenFaces().size(), open);
}

TEST(CarveCavities, BeginsNoRoundOnceItsPartsAreUsedUp) {
  const Hull hull = GridHull(kSize, 1.0);
  WorkingMesh unbounded = GridWithTunnel(3);
  CarveMemory all;
  RunContext run;
  ASSERT_GT(CarveCavities(hull, {}, run, &all, &unbounded), 0);
  const int64_t first_round = all.part_count;
  ASSERT_GT(first_round, 0);

  for (const int64_t most : {int64_t{0}, int64_t{1}, first_round}) {
    WorkingMesh mesh = GridWithTunnel(3);
    CarveMemory memory;
    memory.most_parts = most;
    while (CarveCavities(hull, {}, run, &memory, &mesh) > 0) {
    }
    EXPECT_EQ(memory.part_count, most > 0 ? first_round : 0) << most;
    const WorkingMesh expected = most > 0 ? unbounded : GridWithTunnel(3);
    EXPECT_EQ(mesh.ToComplex().cells, expected.ToComplex().cells) << most;
  }
}

TEST(DeclareHullFaces, TakesOpenFacesOnTheHullAndNoOthers) {
  const Hull hull = GridHull({3, 3, 3}, 1.0);
  WorkingMesh mesh(GridComplex({3, 3, 3}));
  mesh.RemoveCell(13);  // the middle
  CellFace bottom;
  for (const CellFace& face : FacesOf(mesh.corners(4))) {
    if (mesh.Across(face) == WorkingMesh::kHull) bottom = face;
  }
  mesh.UnmarkHull(bottom);
  ASSERT_EQ(mesh.OpenFaces().size(), 7u);
  EXPECT_EQ(DeclareHullFaces(hull, &mesh), 1);
  EXPECT_EQ(mesh.Across(bottom), WorkingMesh::kHull);
  EXPECT_EQ(mesh.OpenFaces().size(), 6u);
}

TEST(FollowsHull, IsTrueOfFacesAlongTheHullOnly) {
  const Hull hull = GridHull({2, 2, 2}, 1.0);
  const std::vector<Vec3d> x = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1, 1, 2}};
  EXPECT_TRUE(FollowsHull(hull, {4, {0, 1, 2, 3}}, x));   // looks up, into the box
  EXPECT_FALSE(FollowsHull(hull, {4, {3, 2, 1, 0}}, x));  // looks out of it
  EXPECT_FALSE(FollowsHull(hull, {3, {0, 1, 4, -1}}, x));
}

}  // namespace
}  // namespace amhex
