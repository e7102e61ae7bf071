#include "closure/polygon_cuts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <numeric>
#include <set>
#include <vector>

namespace amhex {
namespace {

std::vector<int32_t> Polygon(int32_t size) {
  std::vector<int32_t> polygon(static_cast<size_t>(size));
  std::iota(polygon.begin(), polygon.end(), 10);
  return polygon;
}

int64_t Factorial(int64_t n) { return n < 2 ? 1 : n * Factorial(n - 1); }

// Dissections of a polygon of `size` vertices into so many quadrilaterals and triangles
// (Cayley 1890): (size - 2 + faces)! / ((size - 1)! quads! triangles!).
int64_t CountOfCuts(int64_t size, int64_t most_triangles) {
  int64_t count = 0;
  for (int64_t triangles = 0; triangles <= std::min(most_triangles, size - 2); ++triangles) {
    if ((size - 2 - triangles) % 2 != 0) continue;
    const int64_t quads = (size - 2 - triangles) / 2;
    count += Factorial(size - 2 + quads + triangles) /
             (Factorial(size - 1) * Factorial(quads) * Factorial(triangles));
  }
  return count;
}

TEST(CutPolygon, OfFewerThanThreeVerticesIsNoWay) {
  EXPECT_TRUE(CutPolygon({}, 5).empty());
  EXPECT_TRUE(CutPolygon(Polygon(2), 5).empty());
}

TEST(CutPolygon, ListsEveryWayOnce) {
  for (int32_t size = 3; size <= 9; ++size) {
    for (size_t most_triangles = 0; most_triangles <= 7; ++most_triangles) {
      std::set<std::vector<std::array<int32_t, 4>>> different;
      for (const std::vector<CellFace>& cut : CutPolygon(Polygon(size), most_triangles)) {
        std::vector<std::array<int32_t, 4>> faces;
        for (const CellFace& face : cut) faces.push_back(face.v);
        std::sort(faces.begin(), faces.end());
        EXPECT_TRUE(different.insert(faces).second);
      }
      EXPECT_EQ(static_cast<int64_t>(different.size()),
                CountOfCuts(size, static_cast<int64_t>(most_triangles)))
          << size << " vertices, " << most_triangles << " triangles";
    }
  }
}

TEST(CutPolygon, CoversThePolygonOnceWithFacesThatLookItsWay) {
  const std::vector<int32_t> polygon = Polygon(7);
  for (const std::vector<CellFace>& cut : CutPolygon(polygon, 3)) {
    std::map<std::array<int32_t, 2>, int> edges;
    for (const CellFace& face : cut) {
      for (int i = 0; i < face.count; ++i) ++edges[{face.v[i], face.v[(i + 1) % face.count]}];
    }
    for (size_t i = 0; i < polygon.size(); ++i) {
      const int32_t a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      EXPECT_EQ((edges[{a, b}]), 1);
      EXPECT_EQ((edges[{b, a}]), 0);
      edges.erase({a, b});
      edges.erase({b, a});
    }
    for (const auto& [edge, count] : edges) {
      EXPECT_EQ(count, 1);
      EXPECT_EQ((edges.count({edge[1], edge[0]})), 1U);
    }
  }
}

}  // namespace
}  // namespace amhex
