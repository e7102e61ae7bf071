#include "fields/size_field.h"

#include <gtest/gtest.h>

#include "fixtures/solids.h"
#include "unit/fields/field_fixtures.h"

namespace amhex::fields {
namespace {

TEST(SizeField, IsOneEverywhereInABox) {
  const SolvedFields fields(fixtures::MakeBox({3, 4, 5}, 1));
  ASSERT_TRUE(fields.ok);
  for (const Vec3d& size : fields.sizes) {
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(size[axis], 1, 1e-3);
  }
}

TEST(SizeField, KeepsTheMeanDensityOfCells) {
  const SolvedFields fields(fixtures::MakeTorus(4, 1.6, 0.4));
  ASSERT_TRUE(fields.ok);
  double density = 0;
  for (const Vec3d& size : fields.sizes) density += 1 / (size.x * size.y * size.z);
  EXPECT_NEAR(density / static_cast<double>(fields.sizes.size()), 1, 1e-6);
}

TEST(SizeField, GrowsWithTheRadiusAroundARing) {
  // Along the ring a layer has the same number of cells at every radius: the extent along the ring
  // must be proportional to the distance from the axis.
  const SolvedFields fields(fixtures::MakeTorus(8, 2, 0.5));
  ASSERT_TRUE(fields.ok);
  double inner = 0, outer = 0;
  int64_t inner_count = 0, outer_count = 0;
  for (int64_t i = 0; i < fields.grid.count(); ++i) {
    const Vec3d p = fields.grid.Position(i);
    const double radius = std::hypot(p.x, p.y);
    const NearestAxis along =
        FindNearestAxis(ToFrame(fields.frames[i]), Vec3d{-p.y, p.x, 0} / radius);
    if (std::abs(p.z) > 0.6 || along.cosine < 0.95) continue;
    const double size = fields.sizes[i][along.axis];
    if (std::abs(radius - 6.75) < 0.3) inner += size, ++inner_count;
    if (std::abs(radius - 9.25) < 0.3) outer += size, ++outer_count;
  }
  ASSERT_GT(inner_count, 50);
  ASSERT_GT(outer_count, 50);
  const double growth =
      (outer / static_cast<double>(outer_count)) / (inner / static_cast<double>(inner_count));
  EXPECT_NEAR(growth, 9.25 / 6.75, 0.15);
}

}  // namespace
}  // namespace amhex::fields
