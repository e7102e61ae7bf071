// Laws of the energy around one vertex, on every cell that a cube can collapse to.
#include "optimize/local_cells.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "optimize/hull_features.h"
#include "optimize/lane_cells.h"
#include "optimize/placement.h"
#include "optimize/survey_cell.h"
#include "optimize/vertex_search.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"
#include "topology/primitives.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;
using testing_support::Shake;

// Every way to collapse edges of a cube that leaves a cell of Figure 2, each a cell by itself, its
// vertices moved at random.
CellComplex EveryCollapsedCube() {
  CellComplex all;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> shift(-0.12, 0.12);
  const CellComplex cube = GridComplex({1, 1, 1});
  for (unsigned edges = 0; edges < 4096; ++edges) {
    std::array<int, 8> joined;
    std::iota(joined.begin(), joined.end(), 0);
    for (int round = 0; round < 8; ++round) {
      for (size_t e = 0; e < kCubeEdges.size(); ++e) {
        if ((edges >> e & 1) == 0) continue;
        int &a = joined[kCubeEdges[e][0]], &b = joined[kCubeEdges[e][1]];
        a = b = std::min(a, b);
      }
    }
    const auto first = static_cast<int32_t>(all.vertices.size());
    CellCorners corners;
    for (int slot = 0; slot < 8; ++slot) corners[slot] = first + joined[slot];
    if (FindCellPattern(corners) == nullptr || AsListedInFigure2(corners) != corners) continue;
    for (int slot = 0; slot < 8; ++slot) {
      Vec3d sum;
      int count = 0;
      for (int other = 0; other < 8; ++other) {
        if (joined[other] != joined[slot]) continue;
        sum += cube.vertices[cube.cells[0][other]];
        ++count;
      }
      all.vertices.push_back(sum / count + Vec3d{shift(random), shift(random), shift(random)});
    }
    all.cells.push_back(corners);
  }
  return all;
}

CellComplex ShakenGrid() {
  CellComplex complex = GridComplex({3, 3, 3});
  Shake(complex, 0.15);
  complex.hull_faces.clear();  // all vertices are free
  return complex;
}

constexpr CornerPenalty kPenalties[] = {{},
                                        {.knee = 0.6, .steepness = 60},
                                        {.kind = EnergyKind::kMinima},
                                        {.kind = EnergyKind::kMinima, .sharpness = 5}};

// Calls check(placement, vertex) for every vertex of a cell.
template <class Check>
void ForVertices(CellComplex complex, const Check& check) {
  const Hull hull = GridHull({3, 3, 3}, 0.5);
  const HullFeatures features(hull);
  RunContext run;
  Placement placement = PreparePlacement(complex, features, StopPoll(run));
  const PlacementView view = ViewOf(placement);
  for (int32_t v = 0; v < static_cast<int32_t>(complex.vertices.size()); ++v) {
    if (view.cells_at[v].size > 0) check(view, v);
  }
}

template <class Check>
void ForVerticesOfAll(const Check& check) {
  ForVertices(EveryCollapsedCube(), check);
  ForVertices(ShakenGrid(), check);
}

LocalRoom RoomAt(const PlacementView& placement, int32_t vertex) {
  return LocalRoom(static_cast<size_t>(placement.cells_at[vertex].size));
}

// Every fourth hexahedron of a finer grid collapses an edge: all kinds of cells side by side, more
// around a vertex than there are lanes where an edge of the inside is gone.
CellComplex MixedGrid() {
  CellComplex complex = GridComplex({4, 4, 4});
  Shake(complex, 0.15);
  complex.hull_faces.clear();
  std::vector<int32_t> joined(complex.vertices.size());
  std::iota(joined.begin(), joined.end(), 0);
  for (const size_t c : {21u, 42u}) joined[complex.cells[c][0]] = complex.cells[c][1];
  for (CellCorners& corners : complex.cells) {
    for (int32_t& v : corners) v = joined[v];
  }
  std::erase_if(complex.cells, [](const CellCorners& corners) {
    return FindCellPattern(corners) == nullptr || AsListedInFigure2(corners) != corners;
  });
  return complex;
}

std::vector<double> NumbersOf(const EnergyModel& model) {
  std::vector<double> numbers;
  for (int a = 0; a < 3; ++a) {
    numbers.push_back(model.gradient[a]);
    for (int b = 0; b < 3; ++b) numbers.push_back(model.hessian[a][b]);
  }
  return numbers;
}
// To the bit, but that what is not a number may be so in any way.
bool AreSame(const std::vector<double>& a, const std::vector<double>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](double x, double y) {
    return (std::isnan(x) && std::isnan(y)) ||
           std::bit_cast<uint64_t>(x) == std::bit_cast<uint64_t>(y);
  });
}

TEST(LocalCells, HaveRoomForTheEdgesOfEveryCell) {
  for (const CellPattern& pattern : AllCellPatterns()) {
    for (const uint16_t edges : pattern.edges_at) {
      EXPECT_LE(std::popcount(edges), LocalCell::kMostEdges);
    }
  }
  EXPECT_GT(EveryCollapsedCube().cells.size(), 20u) << "the other tests look at too little";
}

TEST(LocalCells, FindTheLeastJacobianOfTheCellsWhereverTheVertexIs) {
  ForVerticesOfAll([](const PlacementView& placement, int32_t v) {
    LocalRoom room = RoomAt(placement, v);
    LocalCells cells(placement, v, {}, FoldWatch::kNone, room.data());
    const Vec3d start = placement.vertices[v];
    for (const Vec3d& shift : {Vec3d{}, Vec3d{0.1, -0.2, 0.15}, Vec3d{-0.6, 0.1, 0.3}}) {
      cells.MoveTo(start + shift);
      placement.vertices[v] = start + shift;
      double least = 1;
      const ArrayView<const int32_t> around = placement.cells_at[v];
      for (int64_t k = 0; k < around.size; ++k) {
        SurveyCell(placement, around[k]);
        least = std::min<double>(least, placement.min_scaled_jacobian[around[k]]);
      }
      EXPECT_NEAR(cells.Score().minimum, least, 1e-6);
      placement.vertices[v] = start;
    }
  });
}

TEST(LocalCells, BoundTheDeficitsOfTheMinimaTheCloserTheSharper) {
  ForVerticesOfAll([](const PlacementView& placement, int32_t v) {
    double deficits = 0;
    const ArrayView<const int32_t> around = placement.cells_at[v];
    for (int64_t k = 0; k < around.size; ++k) {
      SurveyCell(placement, around[k]);
      deficits += 1 - placement.min_scaled_jacobian[around[k]];
    }
    double looser = 1e300;
    for (const int sharpness : {3, 4, 5}) {
      LocalRoom room = RoomAt(placement, v);
      const CornerPenalty penalty{.kind = EnergyKind::kMinima, .sharpness = sharpness};
      LocalCells cells(placement, v, penalty, FoldWatch::kNone, room.data());
      const double bound = cells.Score().energy;
      EXPECT_GE(bound, deficits - 1e-5);
      EXPECT_LE(bound, looser + 1e-12);
      // Eight equal deficits.
      EXPECT_LE(bound, deficits * std::pow(8.0, 1.0 / (1 << sharpness)) + 1e-5);
      looser = bound;
    }
  });
}

TEST(LocalCells, KnowHowTheEnergyChanges) {
  constexpr double kStep = 1e-6;
  for (const CornerPenalty& penalty : kPenalties) {
    ForVerticesOfAll([&](const PlacementView& placement, int32_t v) {
      LocalRoom room = RoomAt(placement, v);
      LocalCells cells(placement, v, penalty, FoldWatch::kNone, room.data());
      const double energy = cells.Score().energy;
      const EnergyModel model = cells.Model();
      const Vec3d start = placement.vertices[v];
      for (int a = 0; a < 3; ++a) {
        Vec3d ahead = start, behind = start;
        ahead[a] += kStep, behind[a] -= kStep;
        cells.MoveTo(ahead);
        const double after = cells.Score().energy;
        cells.MoveTo(behind);
        const double slope = (after - cells.Score().energy) / (2 * kStep);
        EXPECT_NEAR(model.gradient[a], slope, 1e-4 * (1 + std::abs(slope) + energy)) << v;
      }
    });
  }
}

TEST(LocalCells, NewtonStepLeadsDownhill) {
  for (const CornerPenalty& penalty : kPenalties) {
    ForVerticesOfAll([&](const PlacementView& placement, int32_t v) {
      LocalRoom room = RoomAt(placement, v);
      LocalCells cells(placement, v, penalty, FoldWatch::kNone, room.data());
      const double energy = cells.Score().energy;
      const EnergyModel model = cells.Model();
      if (Norm(model.gradient) < 1e-3) return;
      const Vec3d move = LowestPoint(model, {3, {Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}}});
      ASSERT_LT(Dot(move, model.gradient), 0);
      cells.MoveTo(placement.vertices[v] + move * (1e-4 / Norm(move)));
      EXPECT_LT(cells.Score().energy, energy);
    });
  }
}

TEST(LocalCells, CellsThatNearlyFoldPushTheVertexAway) {
  // One corner of a cube nearly in the plane of its neighbours: the cell is watched.
  CellComplex complex = GridComplex({1, 1, 1});
  complex.hull_faces.clear();
  complex.vertices[0] = Vec3d{0.55, 0.55, 0.55};
  ForVertices(complex, [](const PlacementView& placement, int32_t v) {
    if (v != 0) return;
    placement.near_folding[0] = 1;
    LocalRoom room = RoomAt(placement, v);
    LocalCells watched(placement, v, {}, FoldWatch::kSurvey, room.data());
    watched.Score();
    const Vec3d gradient = watched.Model().gradient;
    LocalRoom other_room = RoomAt(placement, v);
    LocalCells not_watched(placement, v, {}, FoldWatch::kNone, other_room.data());
    not_watched.Score();
    EXPECT_GT(Dot(gradient - not_watched.Model().gradient, Vec3d{1, 1, 1}), 0);
  });
}

// Whatever lanes give where, from the baseline to the widest that this machine has.
TEST(LaneCells, GiveTheBitsOfSingleCells) {
  const VectorWidth limit = vector_width_limit.load();
  int64_t with_lanes = 0;
  CellComplex mixed = MixedGrid();
  for (const VectorWidth width : {VectorWidth::kBaseline, VectorWidth::k256, VectorWidth::k512}) {
    vector_width_limit.store(width);
    for (const CellComplex& complex : {ShakenGrid(), EveryCollapsedCube(), mixed}) {
      ForVertices(complex, [&](const PlacementView& placement, int32_t v) {
        // Some cells are watched, and what that adds depends on all edges at the vertex.
        for (int64_t c = 0; c < placement.cells.size; c += 5) placement.near_folding[c] = 1;
        with_lanes += placement.cells_at[v].size >= 6 ? 1 : 0;
        for (const CornerPenalty& penalty : kPenalties) {
          for (const FoldWatch watch : {FoldWatch::kNone, FoldWatch::kSurvey}) {
            LocalRoom room = RoomAt(placement, v), other_room = RoomAt(placement, v);
            LocalCells single(placement, v, penalty, watch, room.data());
            LaneCells lanes(placement, v, penalty, watch, other_room.data());
            const Vec3d start = placement.vertices[v];
            const double nowhere = std::numeric_limits<double>::quiet_NaN();
            for (const Vec3d& shift :
                 {Vec3d{}, Vec3d{0.1, -0.2, 0.15}, Vec3d{-0.6, 0.1, 0.3}, Vec3d{nowhere, 0, 0}}) {
              single.MoveTo(start + shift), lanes.MoveTo(start + shift);
              const LocalScore a = single.Score(), b = lanes.Score();
              EXPECT_TRUE(AreSame({a.minimum, a.energy}, {b.minimum, b.energy}));
              EXPECT_TRUE(AreSame({single.WorstFoldMargin()}, {lanes.WorstFoldMargin()}));
              EXPECT_TRUE(AreSame(NumbersOf(single.Model()), NumbersOf(lanes.Model())));
            }
          }
        }
      });
    }
  }
  vector_width_limit.store(limit);
  EXPECT_GT(with_lanes, 50) << "hardly any vertex had hexahedra enough";
}

}  // namespace
}  // namespace amhex
