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

TEST(VertexConstraints, TieNoBluntEndToTheRidgeBeforeWhichItStops) {
  constexpr GridSize kWedgeSize = {4, 5, 2};
  const Hull hull = HullOfMesh(fixtures::MakeWedge(20, 5.2, kWedgeSize.ny));
  WorkingMesh mesh(WedgeComplex(20, 1.2, kWedgeSize));
  ASSERT_EQ(ExtendToRidges(hull, AcuteRidges(hull), &mesh), 1);
  const CellComplex complex = mesh.ToComplex();
  const HullFeatures features(hull);
  const VertexConstraints constraints =
      AssignConstraints(complex, FindNeighbourhoods(complex), features);
  int at_end = 0, corners = 0;
  for (size_t v = 0; v < complex.vertices.size(); ++v) {
    const Vec3d& x = complex.vertices[v];
    const Constraint kind = constraints.vertex[v].kind;
    corners += kind == Constraint::kCorner ? 1 : 0;
    if (std::hypot(x.x, x.z) > 0.3) continue;
    ++at_end;
    const bool is_beside = x.y < 0.01 || x.y > kWedgeSize.ny - 0.01;
    const double height = std::atan2(x.z, x.x) * 180 / std::numbers::pi;
    if (height > 1 && height < 19) {  // between two rows
      EXPECT_EQ(kind, is_beside ? Constraint::kPatch : Constraint::kFixed) << v;
    } else {
      EXPECT_EQ(kind, is_beside ? Constraint::kCrease : Constraint::kPatch) << v;
    }
  }
  EXPECT_EQ(at_end, 3 * (kWedgeSize.ny + 1));
  EXPECT_EQ(corners, 4);  // those of the ridge are left out
}

}  // namespace
}  // namespace amhex
