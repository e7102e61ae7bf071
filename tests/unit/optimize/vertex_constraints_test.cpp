#include "optimize/vertex_constraints.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "closure/extend_to_ridge.h"
#include "closure/ridges.h"
#include "fixtures/wedges.h"
#include "support/hull_of_mesh.h"
#include "support/wedge_complex.h"

namespace amhex {
namespace {

using testing_support::GridSize;
using testing_support::HullOfMesh;
using testing_support::WedgeComplex;

constexpr GridSize kWedgeSize = {4, 5, 2};

// Cells that go on to just before the edge of a wedge of so many degrees.
CellComplex ExtendedWedge(double degrees, const Hull& hull) {
  WorkingMesh mesh(WedgeComplex(degrees, 1.2, kWedgeSize));
  EXPECT_EQ(ExtendToRidges(hull, AcuteRidges(hull), &mesh), 1);
  return mesh.ToComplex();
}

bool IsAtEnd(const Vec3d& x) { return std::hypot(x.x, x.z) <= 0.3; }

// Of the end's two rows; `x` is at the end.
bool IsBetweenRows(const Vec3d& x, double degrees) {
  const double height = std::atan2(x.z, x.x) * 180 / std::numbers::pi;
  return height > 1 && height < degrees - 1;
}

// Vertices of the end keep to the sides of the wedge, or where they are between its two rows.
void ExpectNoTieToTheRidge(const CellComplex& complex, const Hull& hull, double degrees) {
  const HullFeatures features(hull);
  const VertexConstraints constraints =
      AssignConstraints(complex, FindNeighbourhoods(complex), features);
  int at_end = 0, corners = 0;
  for (size_t v = 0; v < complex.vertices.size(); ++v) {
    const Vec3d& x = complex.vertices[v];
    const Constraint kind = constraints.vertex[v].kind;
    corners += kind == Constraint::kCorner ? 1 : 0;
    if (!IsAtEnd(x)) continue;
    ++at_end;
    const bool is_beside = x.y < 0.01 || x.y > kWedgeSize.ny - 0.01;
    if (IsBetweenRows(x, degrees)) {
      EXPECT_EQ(kind, is_beside ? Constraint::kPatch : Constraint::kFixed) << v;
    } else {
      EXPECT_EQ(kind, is_beside ? Constraint::kCrease : Constraint::kPatch) << v;
    }
  }
  EXPECT_EQ(at_end, 3 * (kWedgeSize.ny + 1));
  EXPECT_EQ(corners, 4);  // those of the ridge are left out
}

TEST(VertexConstraints, TieNoBluntEndToTheRidgeBeforeWhichItStops) {
  const Hull hull = HullOfMesh(fixtures::MakeWedge(20, 5.2, kWedgeSize.ny));
  ExpectNoTieToTheRidge(ExtendedWedge(20, hull), hull, 20);
}

// Rows that end there are so thin that the least move of a vertex turns the end.
TEST(VertexConstraints, TieNoBluntEndThatIsTurnedToTheRidge) {
  constexpr double kDegrees = 36;
  const Hull hull = HullOfMesh(fixtures::MakeWedge(kDegrees, 5.2, kWedgeSize.ny));
  for (const double turn : {-20.0, 20.0}) {
    CellComplex complex = ExtendedWedge(kDegrees, hull);
    for (Vec3d& x : complex.vertices) {
      if (!IsAtEnd(x) || !IsBetweenRows(x, kDegrees)) continue;
      const double row = std::hypot(x.x, x.z) * std::sin(kDegrees / 2 * std::numbers::pi / 180);
      x = x + Normalized(Vec3d{x.x, 0, x.z}) * (row * std::tan(turn * std::numbers::pi / 180));
    }
    ExpectNoTieToTheRidge(complex, hull, kDegrees);
  }
}

}  // namespace
}  // namespace amhex
