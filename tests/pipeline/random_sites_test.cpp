// From random sites to a closed mesh: what no arrangement of sites may break.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "assembly/assemble.h"
#include "closure/close_complex.h"
#include "closure/working_mesh.h"
#include "fixtures/solids.h"
#include "geometry/match_and_merge.h"
#include "support/hull_of_mesh.h"
#include "topology/extract_topology.h"

namespace amhex {
namespace {

constexpr int kSide = 3;  // of the box that the sites fill

Hull CubeHull() { return testing_support::HullOfMesh(fixtures::MakeBox({3, 3, 3}, 1.0)); }

// One site per unit of volume, shaken, turned, and some of them missing; wilder from seed to seed.
Sites RandomSites(unsigned seed, const Box3d& box) {
  std::minstd_rand random(seed);
  const auto uniform = [&] { return double(random()) / double(std::minstd_rand::max()); };
  const double shake = uniform(), turn = 1.5 * uniform(), missing = 0.2 * uniform();
  Sites sites;
  for (int i = 0; i < kSide * kSide * kSide; ++i) {
    const Vec3d cell{double(i % kSide), double(i / kSide % kSide), double(i / kSide / kSide)};
    const Vec3d offset = {uniform() - 0.5, uniform() - 0.5, uniform() - 0.5};
    const double angle = turn * (uniform() - 0.5);
    if (uniform() < missing) continue;
    sites.position.push_back(box.low + cell + Vec3d{0.5, 0.5, 0.5} + offset * shake);
    const double c = std::cos(angle), s = std::sin(angle);
    AxisFrame frame;
    frame.axis = {Vec3d{c, s, 0}, Vec3d{-s, c, 0}, Vec3d{0, 0, 1}};
    sites.frame.push_back(frame);
    sites.size.push_back({1, 1, 1});
    sites.cell_volume.push_back(0);
  }
  return sites;
}

bool IsDiagonal(int a, int b) {
  return std::none_of(kCubeEdges.begin(), kCubeEdges.end(), [&](const auto& edge) {
    return (edge[0] == a && edge[1] == b) || (edge[0] == b && edge[1] == a);
  });
}

TEST(RandomSites, MergingNeverCollapsesADiagonal) {
  const Hull hull = CubeHull();
  int collapsed_edges = 0;
  for (unsigned seed = 1; seed <= 500; ++seed) {
    SCOPED_TRACE(seed);
    RunContext run;
    const auto cubes = MatchAndMerge(RandomSites(seed, hull.box), hull, {}, run);
    ASSERT_TRUE(cubes.ok()) << cubes.status();
    for (const CellCorners& corners : cubes->corners) {
      for (int a = 0; a < 8; ++a) {
        for (int b = 0; b < a; ++b) {
          if (corners[a] != corners[b]) continue;
          ++collapsed_edges;
          EXPECT_FALSE(IsDiagonal(a, b)) << "corners " << b << " and " << a;
        }
      }
    }
  }
  EXPECT_GT(collapsed_edges, 0) << "or the law has not been tried";
}

TEST(RandomSites, CloseWithoutAnOpenFaceOrFail) {
  const Hull hull = CubeHull();
  const MeshingParams params;
  size_t open_before = 0;
  int failures = 0;
  for (unsigned seed = 1; seed <= 500; ++seed) {
    SCOPED_TRACE(seed);
    RunContext run;
    const auto cubes = MatchAndMerge(RandomSites(seed, hull.box), hull, params, run);
    ASSERT_TRUE(cubes.ok()) << cubes.status();
    const auto table = ExtractTopology(*cubes, params, run);
    ASSERT_TRUE(table.ok()) << table.status();
    const auto assembled = AssembleCells(*table, *cubes, params, run);
    ASSERT_TRUE(assembled.ok()) << assembled.status();
    open_before += WorkingMesh(*assembled).OpenFaces().size();
    const auto closed = CloseComplex(*assembled, hull, params, run);
    // The wildest sets may leave nothing to build on, and then the run must fail.
    failures += closed.ok() ? 0 : 1;
    if (!closed.ok()) continue;
    EXPECT_TRUE(WorkingMesh(*closed).OpenFaces().empty());
    EXPECT_FALSE(closed->cells.empty());
  }
  EXPECT_GT(open_before, 2000u) << "or the law has not been tried";
  EXPECT_LT(failures, 10);
}

}  // namespace
}  // namespace amhex
