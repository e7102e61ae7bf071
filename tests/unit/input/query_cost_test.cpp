#include "input/query_cost.h"

#include <gtest/gtest.h>

#include "fixtures/damage.h"
#include "fixtures/solids.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

double StepsOf(const TriangleMesh& mesh) {
  return MeanWindingSteps(HullQueries(mesh.vertices, mesh.triangles).view());
}

TriangleMesh AcrossTheBox(int count) {
  TriangleMesh mesh;
  fixtures::Chance chance(1);
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(chance.Vector());
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

TEST(MeanWindingSteps, AreNoneWithoutTriangles) { EXPECT_EQ(StepsOf({}), 0); }

TEST(MeanWindingSteps, GrowMuchMoreSlowlyThanTheTrianglesOfASolid) {
  const TriangleMesh coarse = fixtures::MakeSphere(1, 0.1), fine = fixtures::MakeSphere(1, 0.02);
  const double growth = StepsOf(fine) / StepsOf(coarse);
  EXPECT_GT(growth, 1);
  EXPECT_LT(growth, 3);
  EXPECT_GT(fine.triangles.size(), 15 * coarse.triangles.size());
}

TEST(MeanWindingSteps, AreAsManyAsTheTrianglesWhereAllReachAcrossTheBox) {
  for (const int count : {100, 10'000}) {
    EXPECT_GT(StepsOf(AcrossTheBox(count)), count) << count;
    EXPECT_LT(StepsOf(AcrossTheBox(count)), 2 * count) << count;
  }
}

}  // namespace
}  // namespace amhex
