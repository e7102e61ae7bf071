#include "input/crossing_ray.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "fixtures/solids.h"
#include "input/edges_balance.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

HullQueries QueriesOver(const TriangleMesh& mesh) { return {mesh.vertices, mesh.triangles}; }

std::vector<TriangleMesh> ClosedSolids() {
  return {fixtures::MakeSphere(1.5, 0.2), fixtures::MakeTorus(2.4, 0.8, 0.3),
          fixtures::MakeBracket(1.7, 0.6), fixtures::MakeTwistedBox({2, 2, 4}, 1.2, 0.5),
          fixtures::Joined(fixtures::MakeSphere(2.0, 0.4),
                           fixtures::Flipped(fixtures::MakeSphere(1.0, 0.3)))};
}

Vec3d CentroidOf(const TriangleMesh& mesh, size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  return (mesh.vertices[static_cast<size_t>(t[0])] + mesh.vertices[static_cast<size_t>(t[1])] +
          mesh.vertices[static_cast<size_t>(t[2])]) /
         3.0;
}

Vec3d NormalOf(const TriangleMesh& mesh, size_t triangle) {
  const auto& t = mesh.triangles[triangle];
  const Vec3d& a = mesh.vertices[static_cast<size_t>(t[0])];
  return Normalized(Cross(mesh.vertices[static_cast<size_t>(t[1])] - a,
                          mesh.vertices[static_cast<size_t>(t[2])] - a));
}

TEST(CrossingRay, TellsTheSideOfEveryPointThatSolidAnglesTell) {
  for (const TriangleMesh& mesh : ClosedSolids()) {
    const HullQueries queries = QueriesOver(mesh);
    ASSERT_TRUE(queries.view().is_closed);
    int told = 0, inside = 0;
    constexpr int kAlongAxis = 9;
    for (int i = 0; i < kAlongAxis * kAlongAxis * kAlongAxis; ++i) {
      const auto part = [&](int n) { return (n % kAlongAxis - kAlongAxis / 2) * 0.618; };
      const Vec3d p = Vec3d{part(i), part(i / kAlongAxis), part(i / kAlongAxis / kAlongAxis)} +
                      Vec3d{0.0171, 0.0293, 0.0411};  // off what the solids are built along
      int32_t number = 0;
      if (!queries.view().CountCrossings(p, number)) continue;
      ++told, inside += number;
      EXPECT_EQ(number, std::lround(queries.view().WindingBySolidAngles(p)));
    }
    EXPECT_GT(told, 720);  // of 729
    EXPECT_GT(inside, 3);
  }
}

TEST(CrossingRay, TellsBothSidesOfATriangleHoweverNear) {
  for (const TriangleMesh& mesh : ClosedSolids()) {
    const HullQueries queries = QueriesOver(mesh);
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (const double offset : {1e-3, 1e-6, 1e-9}) {
        const Vec3d step = NormalOf(mesh, t) * offset;
        EXPECT_EQ(queries.WindingNumber(CentroidOf(mesh, t) + step), 0);
        EXPECT_EQ(queries.WindingNumber(CentroidOf(mesh, t) - step), 1);
      }
    }
  }
}

TEST(CrossingRay, LeavesPointsOnTheSurfaceToSolidAngles) {
  const TriangleMesh box = fixtures::MakeBox({3, 2, 1}, 0.5);
  const HullQueries queries = QueriesOver(box);
  std::vector<Vec3d> points = box.vertices;
  for (size_t t = 0; t < box.triangles.size(); ++t) points.push_back(CentroidOf(box, t));
  for (const Vec3d& p : points) {
    int32_t number = 0;
    EXPECT_FALSE(queries.view().CountCrossings(p, number));
    EXPECT_EQ(queries.WindingNumber(p), queries.view().WindingBySolidAngles(p));
  }
}

TEST(CrossingRay, LeavesWhatManyPlatesStandBeforeToSolidAngles) {
  constexpr int kPlates = 1000;
  TriangleMesh stack;
  for (int i = 0; i < kPlates; ++i) {
    TriangleMesh plate = fixtures::MakeBox({1, 1, 0.4 / kPlates}, 1);
    for (Vec3d& p : plate.vertices) p.z += static_cast<double>(i) / kPlates;
    stack = fixtures::Joined(stack, plate);
  }
  const HullQueries queries = QueriesOver(stack);
  ASSERT_TRUE(queries.view().is_closed);
  int32_t number = 0;
  const Vec3d in_plate{0.47, 0.53, 0.6002}, between{0.47, 0.53, 0.6007}, near_top{0.4, 0.6, 0.9902};
  EXPECT_FALSE(queries.view().CountCrossings(in_plate, number));
  EXPECT_NEAR(queries.WindingNumber(in_plate), 1, 0.1);
  EXPECT_NEAR(queries.WindingNumber(between), 0, 0.1);
  EXPECT_TRUE(queries.view().CountCrossings(near_top, number));
  EXPECT_EQ(number, 1);
}

TEST(CrossingRay, TellsNothingOfPointsThatAreNowhere) {
  const HullQueries queries = QueriesOver(fixtures::MakeBox({1, 1, 1}, 1));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Vec3d& p : {Vec3d{nan, 0, 0}, Vec3d{0.5, nan, 0.5}, Vec3d{0, 0, infinity}}) {
    int32_t number = 0;
    EXPECT_FALSE(queries.view().CountCrossings(p, number));
  }
}

TEST(CrossingRay, IsNotAskedOfSurfacesThatAreNotClosed) {
  const TriangleMesh box = fixtures::MakeBox({1, 1, 1}, 1);
  TriangleMesh open = box, turned = box, flat = box;
  open.triangles.pop_back();
  std::swap(turned.triangles[3][0], turned.triangles[3][1]);
  // Along an edge, a triangle without area, which the hierarchy leaves out.
  const auto middle = static_cast<int32_t>(flat.vertices.size());
  const std::array<int32_t, 3> first = flat.triangles.front();
  flat.vertices.push_back((flat.vertices[static_cast<size_t>(first[0])] +
                           flat.vertices[static_cast<size_t>(first[1])]) /
                          2.0);
  flat.triangles.front() = {first[0], middle, first[2]};
  flat.triangles.push_back({middle, first[1], first[2]});
  flat.triangles.push_back({first[0], first[1], middle});
  EXPECT_TRUE(EdgesBalance(flat.triangles));
  EXPECT_TRUE(QueriesOver(box).view().is_closed);
  for (const TriangleMesh& mesh : {open, turned, flat}) {
    EXPECT_FALSE(QueriesOver(mesh).view().is_closed);
  }
  EXPECT_NEAR(QueriesOver(flat).WindingNumber({0.4, 0.6, 0.3}), 1, 1e-9);
}

TEST(EdgesBalance, WhereEveryEdgeIsUsedAsOftenOneWayAsTheOther) {
  EXPECT_TRUE(EdgesBalance({}));
  EXPECT_TRUE(EdgesBalance({{0, 1, 2}, {2, 1, 0}}));
  EXPECT_TRUE(EdgesBalance({{4, 4, 4}}));
  EXPECT_FALSE(EdgesBalance({{0, 1, 2}}));
  EXPECT_FALSE(EdgesBalance({{0, 1, 2}, {0, 1, 2}}));
  // Enough triangles for several blocks.
  TriangleMesh sphere = fixtures::MakeSphere(1, 0.05);
  ASSERT_GT(sphere.triangles.size(), 4096u);
  EXPECT_TRUE(EdgesBalance(sphere.triangles));
  for (const size_t i : {size_t{0}, size_t{2500}, sphere.triangles.size() - 1}) {
    std::vector<std::array<int32_t, 3>> turned = sphere.triangles;
    std::swap(turned[i][0], turned[i][2]);
    EXPECT_FALSE(EdgesBalance(turned));
  }
}

}  // namespace
}  // namespace amhex
