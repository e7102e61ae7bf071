// Laws of short edges: they come to be long enough wherever they are, by moving what constrains
// least, and neither a good cell nor anything else is given up for it.
#include "optimize/lengthen_edges.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include "closure/working_mesh.h"
#include "input/hull_queries.h"
#include "optimize/raise_quality.h"
#include "output/validate.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::GridVertex;

constexpr GridSize kLengthenedSize{5, 4, 4};
constexpr double kTiny = 1e-5;

double ShortestEdge(const CellComplex& complex) {
  double shortest = 1e300;
  for (const CellCorners& corners : complex.cells) {
    for (const auto& [a, b] : EdgesOf(corners)) {
      shortest = std::min(shortest, Norm(complex.vertices[a] - complex.vertices[b]));
    }
  }
  return shortest;
}

CellComplex Lengthened(const CellComplex& complex, const GridSize& size = kLengthenedSize) {
  const Hull hull = GridHull(size, 0.5);
  const RunContext run;
  auto lengthened = LengthenEdges(complex, hull, HullFeatures(hull), run);
  EXPECT_TRUE(lengthened.ok()) << lengthened.status().ToString();
  return *lengthened;
}

struct Meeting {
  std::string where;
  std::array<int, 3> stays;  // a vertex of the grid
  std::array<int, 3> moves;  // the one that has come next to it

  friend std::ostream& operator<<(std::ostream& out, const Meeting& meeting) {
    return out << meeting.where;
  }
};

class MeetingVertices : public testing::TestWithParam<Meeting> {
 protected:
  static int32_t Vertex(const std::array<int, 3>& at) {
    return GridVertex(kLengthenedSize, at[0], at[1], at[2]);
  }
  // The layer of cells between the two is thin around them.
  CellComplex Met() const {
    CellComplex complex = GridComplex(kLengthenedSize);
    const Vec3d to = complex.vertices[Vertex(GetParam().stays)];
    const Vec3d from = complex.vertices[Vertex(GetParam().moves)];
    for (Vec3d& vertex : complex.vertices) {
      if (Dot(vertex - from, from - to) != 0) continue;
      const double thickness = std::clamp(0.6 * Norm(vertex - from), kTiny, 1.0);
      vertex += (to - from) * (1 - thickness);
    }
    return complex;
  }
};

TEST_P(MeetingVertices, ComeApart) {
  const CellComplex met = Met();
  ASSERT_LT(ShortestEdge(met), 2 * kTiny);
  ASSERT_GT(SummarizeQuality(met).minimum, 0.31) << "scaled Jacobians do not tell";
  const CellComplex apart = Lengthened(met);
  EXPECT_GE(ShortestEdge(apart), kWantedEdge);
  EXPECT_GE(SummarizeQuality(apart).minimum, 0.31);
  EXPECT_EQ(apart.cells, met.cells);
  const ValidationReport report = ValidateMesh(testing_support::MeshOf(apart));
  EXPECT_TRUE(report.valid()) << report.Summary();
}

TEST_P(MeetingVertices, MoveNoFartherThanTheyMust) {
  const CellComplex met = Met();
  const CellComplex apart = Lengthened(met);
  const double way =
      Norm(apart.vertices[Vertex(GetParam().moves)] - met.vertices[Vertex(GetParam().moves)]) +
      Norm(apart.vertices[Vertex(GetParam().stays)] - met.vertices[Vertex(GetParam().stays)]);
  EXPECT_GT(way, kWantedEdge - 2 * kTiny);
  EXPECT_LT(way, 1.1 * kWantedEdge);
}

TEST_P(MeetingVertices, StayOnTheHull) {
  const Hull hull = GridHull(kLengthenedSize, 0.5);
  const CellComplex apart = Lengthened(Met());
  for (const CellFace& face : apart.hull_faces) {
    for (int j = 0; j < face.count; ++j) {
      EXPECT_LT(hull.queries->Closest(apart.vertices[face.v[j]]).distance, 1e-6);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, MeetingVertices,
                         testing::Values(Meeting{"Inside", {1, 2, 2}, {2, 2, 2}},
                                         Meeting{"OnAFace", {1, 2, 4}, {2, 2, 4}},
                                         Meeting{"OnACrease", {1, 0, 4}, {2, 0, 4}},
                                         Meeting{"AtACorner", {0, 0, 0}, {1, 0, 0}},
                                         Meeting{"InsideAndOnAFace", {2, 2, 4}, {2, 2, 3}}),
                         [](const testing::TestParamInfo<Meeting>& meeting) {
                           return meeting.param.where;
                         });

TEST(LengthenEdges, MovesTheVertexInsideAndNotTheCorner) {
  CellComplex complex = GridComplex(kLengthenedSize);
  const int32_t corner = GridVertex(kLengthenedSize, 0, 0, 0),
                next = GridVertex(kLengthenedSize, 1, 0, 0);
  complex.vertices[next] = complex.vertices[corner] + Vec3d{kTiny, 0, 0};
  const CellComplex apart = Lengthened(complex);
  EXPECT_EQ(apart.vertices[corner], complex.vertices[corner]);
  EXPECT_GE(apart.vertices[next].x, kWantedEdge);
}

TEST(LengthenEdges, LeavesAMeshWithoutShortEdgesAsItIs) {
  CellComplex complex = GridComplex(kLengthenedSize);
  complex.vertices[GridVertex(kLengthenedSize, 2, 2, 2)].x = 1 + 1.1 * kWantedEdge;
  EXPECT_EQ(Lengthened(complex).vertices, complex.vertices);
}

TEST(LengthenEdges, LeavesVerticesThatAreOneAndHaveNoDirectionToGo) {
  CellComplex complex = GridComplex(kLengthenedSize);
  complex.vertices[GridVertex(kLengthenedSize, 2, 2, 2)] =
      complex.vertices[GridVertex(kLengthenedSize, 1, 2, 2)];
  EXPECT_EQ(Lengthened(complex).vertices, complex.vertices);
}

int EdgesBelow(double length, const CellComplex& complex) {
  int count = 0;
  for (const CellCorners& corners : complex.cells) {
    for (const auto& [a, b] : EdgesOf(corners)) {
      if (Norm(complex.vertices[a] - complex.vertices[b]) < length) ++count;
    }
  }
  return count;
}

// Vertices inside anywhere near their places, some of them near one of their neighbours.
CellComplex WithShortEdges(uint32_t seed, const GridSize& size = kLengthenedSize) {
  std::mt19937 random(seed);
  const auto uniform = [&random](double from, double to) {
    return from + (to - from) * static_cast<double>(random()) / 4294967296.0;
  };
  CellComplex complex = GridComplex(size);
  for (int x = 1; x < size.nx; ++x) {
    for (int y = 1; y < size.ny; ++y) {
      for (int z = 1; z < size.nz; ++z) {
        Vec3d& at = complex.vertices[GridVertex(size, x, y, z)];
        at += Vec3d{uniform(-0.1, 0.1), uniform(-0.1, 0.1), uniform(-0.1, 0.1)};
        if (uniform(0, 1) > 0.2) continue;
        const Vec3d next = complex.vertices[GridVertex(size, x - 1, y, z)];
        at = next + (at - next) * uniform(2 * kShortestEdge, 0.5);
      }
    }
  }
  return complex;
}

TEST(LengthenEdges, GivesLittleQualityUpForEdgesThatSolversCanUse) {
  int lengthened = 0;
  for (uint32_t seed = 1; seed <= 40; ++seed) {
    const CellComplex before = WithShortEdges(seed);
    ASSERT_EQ(EdgesBelow(kShortestEdge, before), 0);
    const CellComplex after = Lengthened(before);
    constexpr double kRounding = 1e-6;  // surveys are of floats
    EXPECT_GE(SummarizeQuality(after).minimum, SummarizeQuality(before).minimum - kRounding)
        << seed;
    EXPECT_GE(ShortestEdge(after), ShortestEdge(before)) << seed;
    const int count = EdgesBelow(kWantedEdge, before);
    EXPECT_LE(EdgesBelow(kWantedEdge, after), count) << seed;
    lengthened += count - EdgesBelow(kWantedEdge, after);
  }
  EXPECT_GT(lengthened, 100);
}

// Long enough for edges that are looked at side by side and do not see each other.
TEST(LengthenEdges, IsTheSameAtAnyThreadCount) {
  constexpr GridSize kLong{40, 5, 5};
  for (uint32_t seed = 1; seed <= 3; ++seed) {
    const CellComplex complex = WithShortEdges(seed, kLong);
    std::vector<CellComplex> results;
    for (const size_t threads : {1, 2, 7}) {
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      results.push_back(Lengthened(complex, kLong));
    }
    EXPECT_LT(EdgesBelow(kWantedEdge, results[0]), EdgesBelow(kWantedEdge, complex));
    for (const CellComplex& other : results) EXPECT_EQ(results[0].vertices, other.vertices);
  }
}

TEST(LengthenEdges, IsCancelled) {
  const Hull hull = GridHull(kLengthenedSize, 1.0);
  RunContext run;
  run.RequestStop();
  EXPECT_EQ(
      LengthenEdges(GridComplex(kLengthenedSize), hull, HullFeatures(hull), run).status().code(),
      absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
