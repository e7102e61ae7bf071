#include "topology/primitive_catalog.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <random>
#include <set>
#include <vector>

#include "topology/half_face.h"

namespace amhex {
namespace {

std::set<CellFace> CanonicalFaces(std::span<const CellFace> faces) {
  std::set<CellFace> canonical;
  for (const CellFace& face : faces) canonical.insert(CanonicalHalfFace(face));
  return canonical;
}

std::set<CellFace> CanonicalFaces(const CellCorners& corners) {
  const CellFaces faces = FacesOf(corners);
  return CanonicalFaces({faces.begin(), faces.end()});
}

std::span<const CellFace> FacesOfShape(const PrimitiveShape& shape) {
  return {shape.faces.data(), static_cast<size_t>(shape.face_count())};
}

// Every cell that collapsing some of a hexahedron's edges gives.
std::vector<CellCorners> AllCollapses() {
  std::vector<CellCorners> cells;
  for (int mask = 0; mask < 1 << 12; ++mask) {
    CellCorners corners;
    std::iota(corners.begin(), corners.end(), 0);
    for (int e = 0; e < 12; ++e) {
      const int32_t kept = corners[kCubeEdges[e][0]], gone = corners[kCubeEdges[e][1]];
      if ((mask >> e & 1) != 0) std::replace(corners.begin(), corners.end(), gone, kept);
    }
    cells.push_back(corners);
  }
  return cells;
}

TEST(PrimitiveCatalog, EveryPatternIsAHexahedronWithCollapsedEdges) {
  // Renumber a collapse's ids in order of appearance to compare it with a pattern.
  std::set<CellCorners> collapses;
  for (const CellCorners& cell : AllCollapses()) {
    std::map<int32_t, int32_t> renumbered;
    CellCorners corners;
    for (int i = 0; i < 8; ++i) {
      corners[i] =
          renumbered.emplace(cell[i], static_cast<int32_t>(renumbered.size())).first->second;
    }
    collapses.insert(corners);
  }
  for (const PrimitiveShape& shape : kPrimitiveCatalog) {
    EXPECT_EQ(collapses.count(shape.pattern), 1u) << shape.name;
  }
}

TEST(PrimitiveCatalog, EveryCollapseThatIsACellHasAShapeOfTheCatalog) {
  std::set<PrimitiveType> seen;
  for (const CellCorners& cell : AllCollapses()) {
    const auto type = RecognizeCell(cell);
    if (!type.has_value()) continue;
    seen.insert(*type);
    const CellFaces faces = FacesOf(cell);
    const auto corners = CornersFromFaces(*type, {faces.begin(), faces.end()});
    ASSERT_TRUE(corners.has_value());
    EXPECT_EQ(CanonicalFaces(*corners), CanonicalFaces(cell));
  }
  EXPECT_EQ(seen.size(), kPrimitiveTypes.size());
}

TEST(PrimitiveCatalog, CountsAndFacesAreThoseOfThePattern) {
  for (const PrimitiveShape& shape : kPrimitiveCatalog) {
    EXPECT_EQ(CanonicalFaces(FacesOfShape(shape)), CanonicalFaces(shape.pattern)) << shape.name;
    EXPECT_EQ(VerticesOf(shape.pattern).count, shape.vertex_count) << shape.name;
    EXPECT_EQ(shape.vertex_count - shape.edge_count + shape.face_count(), 2) << shape.name;
    EXPECT_EQ(4 * shape.quad_count + 3 * shape.triangle_count, 2 * shape.edge_count) << shape.name;
    const auto is_quad = [](const CellFace& face) { return face.count == 4; };
    const auto faces = FacesOfShape(shape);
    EXPECT_EQ(std::count_if(faces.begin(), faces.end(), is_quad), shape.quad_count) << shape.name;
  }
}

TEST(PrimitiveCatalog, CornersDoNotDependOnHowTheFacesAreListed) {
  std::mt19937 random(1);
  for (const PrimitiveShape& shape : kPrimitiveCatalog) {
    for (int trial = 0; trial < 20; ++trial) {
      std::vector<CellFace> faces(FacesOfShape(shape).begin(), FacesOfShape(shape).end());
      std::shuffle(faces.begin(), faces.end(), random);
      for (CellFace& face : faces) {
        std::rotate(face.v.begin(), face.v.begin() + 1, face.v.begin() + face.count);
      }
      const auto corners = CornersFromFaces(shape.type, faces);
      ASSERT_TRUE(corners.has_value()) << shape.name;
      EXPECT_EQ(CanonicalFaces(*corners), CanonicalFaces(shape.pattern)) << shape.name;
    }
  }
}

TEST(PrimitiveCatalog, FacesOfAnotherTypeGiveNoCorners) {
  for (const PrimitiveShape& shape : kPrimitiveCatalog) {
    for (const PrimitiveType type : kPrimitiveTypes) {
      if (type == shape.type) continue;
      EXPECT_FALSE(CornersFromFaces(type, FacesOfShape(shape)).has_value()) << shape.name;
    }
  }
}

}  // namespace
}  // namespace amhex
