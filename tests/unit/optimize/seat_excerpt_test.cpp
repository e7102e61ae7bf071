// Laws of changing a boundary at one place: what is added or goes leaves a closed, valid mesh, and
// nothing else changes.
#include "optimize/seat_excerpt.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "closure/working_mesh.h"
#include "optimize/raise_quality.h"
#include "output/validate.h"
#include "support/grid_complex.h"
#include "support/largest_distance.h"
#include "support/studded_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::HullWith;
using testing_support::kStuddedSize;
using testing_support::LargestDistance;
using testing_support::MeshOf;
using testing_support::Studs;

const Vec3d kOnTop = {4, 4, kStuddedSize.nz};

int32_t VertexAt(const Vec3d& p, const CellComplex& complex) {
  const auto found = std::find(complex.vertices.begin(), complex.vertices.end(), p);
  EXPECT_NE(found, complex.vertices.end());
  return static_cast<int32_t>(found - complex.vertices.begin());
}

// A pyramid on a face of the top.
CellComplex GridWithLump() {
  CellComplex complex = GridComplex(kStuddedSize);
  const auto at =
      std::find_if(complex.hull_faces.begin(), complex.hull_faces.end(), [&](const CellFace& face) {
        Vec3d middle;
        for (int j = 0; j < 4; ++j) middle += complex.vertices[face.v[j]] / 4.0;
        return Norm(middle - Vec3d{4.5, 4.5, kStuddedSize.nz}) < 1e-9;
      });
  EXPECT_NE(at, complex.hull_faces.end());
  const CellFace base = *at;
  complex.hull_faces.erase(at);
  const auto apex = static_cast<int32_t>(complex.vertices.size());
  complex.vertices.push_back({4.5, 4.5, kStuddedSize.nz + 0.8});
  complex.cells.push_back(MakePyramid(Reversed(base).v, apex));
  for (int j = 0; j < 4; ++j) {
    complex.hull_faces.push_back({3, {base.v[j], base.v[(j + 1) % 4], apex, -1}});
  }
  return complex;
}

// The whole with the last seat used that there is for a point; nothing where it has another use.
std::optional<CellComplex> Used(SeatUse use, const CellComplex& complex, const Vec3d& p,
                                const Vec3d& wanted, PlacementEffort effort) {
  const WorkingMesh whole(complex);
  const CellLists cells_at = whole.CellsAtVertices();
  const std::vector<Seat> seats = SeatsAt(p, wanted, complex, whole, cells_at);
  if (seats.empty() || seats.back().use != use) return std::nullopt;
  const Hull hull = HullWith({});
  const RunContext run;
  const SeatExcerpt seat(whole, cells_at, seats.back());
  const HullFeatures features(hull);
  const MeshingParams params;
  const auto part = seat.Changed(wanted, effort, {hull, features, params, run});
  if (!part.has_value()) return std::nullopt;
  return seat.InWhole(whole, *part, {});
}

TEST(SeatsAt, AreTheNearestFaceItsEdgesAndAVertex) {
  const CellComplex complex = GridComplex(kStuddedSize);
  const WorkingMesh whole(complex);
  const Vec3d p = kOnTop + Vec3d{0.5, 0.5, 0};
  const auto seats = SeatsAt(p, p + Vec3d{0, 0, 1}, complex, whole, whole.CellsAtVertices());
  ASSERT_EQ(seats.size(), 6u);
  EXPECT_EQ(seats[0].corners.size(), 4u);
  EXPECT_EQ(seats[0].cells.size(), 1u);
  for (size_t i = 1; i < 5; ++i) {
    EXPECT_TRUE(seats[i].IsEdge());
    EXPECT_EQ(seats[i].cells.size(), 2u);
  }
  EXPECT_EQ(seats[5].use, SeatUse::kRefill);
  EXPECT_EQ(seats[5].corners.size(), 1u);
  EXPECT_EQ(seats[5].cells.size(), 4u);
}

TEST(SeatsAt, OfNothingAreNone) {
  const WorkingMesh whole{CellComplex{}};
  EXPECT_TRUE(SeatsAt({0, 0, 0}, {0, 0, 1}, {}, whole, {}).empty());
}

TEST(SeatExcerpt, FillsAPitAnew) {
  CellComplex complex = GridComplex(kStuddedSize);
  const Vec3d low = kOnTop - Vec3d{0, 0, 0.7};
  complex.vertices[VertexAt(kOnTop, complex)] = low;
  const Hull hull = HullWith({});
  ASSERT_GT(LargestDistance(complex, hull), 0.6);
  const double before = SummarizeQuality(complex).minimum;
  const auto refilled = Used(SeatUse::kRefill, complex, low, kOnTop, PlacementEffort::kValid);
  ASSERT_TRUE(refilled.has_value());
  EXPECT_LT(LargestDistance(*refilled, hull), 0.3);
  EXPECT_GE(SummarizeQuality(*refilled).minimum, std::min(before, kBearable));
  const ValidationReport report = ValidateMesh(MeshOf(*refilled));
  EXPECT_TRUE(report.valid()) << report.Summary();
}

TEST(SeatExcerpt, CutsOffALump) {
  const CellComplex grid = GridComplex(kStuddedSize), complex = GridWithLump();
  const Vec3d& tip = complex.vertices.back();
  for (const PlacementEffort effort : {PlacementEffort::kJoint, PlacementEffort::kValid}) {
    const auto cut = Used(SeatUse::kCutOff, complex, tip, {tip.x, tip.y, kOnTop.z}, effort);
    ASSERT_TRUE(cut.has_value());
    EXPECT_EQ(cut->cells.size(), grid.cells.size());
    EXPECT_EQ(cut->hull_faces.size(), grid.hull_faces.size());
    const ValidationReport report = ValidateMesh(MeshOf(*cut));
    EXPECT_TRUE(report.valid()) << report.Summary();
  }
}

TEST(SeatExcerpt, CutsOffNothingThatHoldsTwoPartsTogether) {
  // A bar, one cell thick, and a vertex in its middle: without the cells there it falls apart.
  const CellComplex bar = GridComplex({6, 1, 1});
  const Vec3d p = {3, 1, 1};
  EXPECT_FALSE(Used(SeatUse::kCutOff, bar, p, {3, 0.5, 0.5}, PlacementEffort::kJoint).has_value());
}

// On the top of a grid, pyramids around one vertex fill the room of `length` cells in a row.
CellComplex GridWithStarOnTop(int length) {
  const CellComplex grid = GridComplex(kStuddedSize);
  WorkingMesh mesh(grid);
  for (int x = 4; x < 4 + length; ++x) {
    for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
      const Vec3d middle = CellCentroid(mesh.corners(cell), grid.vertices);
      if (Norm(middle - Vec3d{x + 0.5, 4.5, kStuddedSize.nz - 0.5}) < 1e-9) mesh.RemoveCell(cell);
    }
  }
  std::vector<CellFace> open;
  for (const CellFace& face : grid.hull_faces) {
    if (mesh.Owner(face) == WorkingMesh::kOpen) open.push_back(face);
  }
  for (const CellFace& face : mesh.OpenFaces()) open.push_back(Reversed(face));
  const int apex = mesh.AddVertex({4 + length / 2.0, 4.5, kStuddedSize.nz - 0.5});
  for (const CellFace& face : open) mesh.AddCell(MakePyramid(face.v, apex));
  for (const CellFace& face : mesh.OpenFaces()) mesh.MarkHull(face);
  return mesh.ToComplex();
}

Hull HullWithPits(int length) {
  Studs pits;
  for (int x = 4; x < 4 + length; ++x) pits.at.push_back({x, 4});
  pits.height = pits.height_of_first = -0.45;
  return HullWith(pits);
}

TEST(SeatsUnder, AreWhereCellsCoverAPit) {
  for (const int length : {1, 2, 3}) {
    const CellComplex complex = GridWithStarOnTop(length);
    const WorkingMesh whole(complex);
    const CellLists cells_at = whole.CellsAtVertices();
    const Vec3d on_top = {4.5, 4.5, kStuddedSize.nz};
    const auto seats_in = [&](const Hull& hull) {
      return SeatsUnder(on_top, complex, whole, cells_at, *hull.queries);
    };
    EXPECT_TRUE(seats_in(HullWith({})).empty());
    const std::vector<Seat> seats = seats_in(HullWithPits(length));
    ASSERT_EQ(seats.size(), 1u);
    EXPECT_EQ(seats[0].use, SeatUse::kCutOff);
    EXPECT_EQ(seats[0].cells.size(), static_cast<size_t>(length));
  }
}

struct Opened {
  std::optional<CellComplex> whole;
  int64_t cells_gone = 0;
  double distance = 0;  // of what is left, from the hull
};

// A grid whose pits stars cover, without what lies over them.
Opened OpenPits(int length, const Vec3d& at, PlacementEffort effort) {
  const Hull hull = HullWithPits(length);
  const HullFeatures features(hull);
  const MeshingParams params;
  const RunContext run;
  const CellComplex complex = GridWithStarOnTop(length);
  const WorkingMesh whole(complex);
  const CellLists cells_at = whole.CellsAtVertices();
  const Vec3d on_top = {4.5, 4.5, kStuddedSize.nz};
  const auto seats = SeatsUnder(on_top, complex, whole, cells_at, *hull.queries);
  if (seats.size() != 1) return {};
  const SeatExcerpt seat(whole, cells_at, seats[0]);
  const auto part = seat.Changed(at, effort, {hull, features, params, run});
  if (!part.has_value()) return {};
  Opened opened{seat.InWhole(whole, *part, {})};
  if (!opened.whole.has_value()) return {};
  opened.cells_gone = static_cast<int64_t>(complex.cells.size() - opened.whole->cells.size());
  opened.distance = LargestDistance(*opened.whole, hull);
  return opened;
}

TEST(SeatExcerpt, OpensAPitThatCellsCover) {
  ASSERT_GT(LargestDistance(GridWithStarOnTop(1), HullWithPits(1)), 0.4);
  const Vec3d tip = {4.5, 4.5, kStuddedSize.nz - 0.45};
  const Opened opened = OpenPits(1, tip, PlacementEffort::kValid);
  ASSERT_TRUE(opened.whole.has_value());
  EXPECT_EQ(opened.cells_gone, 1);
  EXPECT_LT(opened.distance, 0.3);
  const ValidationReport report = ValidateMesh(MeshOf(*opened.whole));
  EXPECT_TRUE(report.valid()) << report.Summary();
}

// However the faces follow each other that come to the boundary.
TEST(SeatExcerpt, CutsOffAStripOfCells) {
  for (const int length : {2, 3}) {
    const Vec3d middle = {4 + length / 2.0, 4.5, kStuddedSize.nz};
    const Opened opened = OpenPits(length, middle, PlacementEffort::kJoint);
    ASSERT_TRUE(opened.whole.has_value());
    EXPECT_EQ(opened.cells_gone, length);
    EXPECT_FALSE(WorkingMesh(*opened.whole).HasOpenFaces());
  }
}

}  // namespace
}  // namespace amhex
