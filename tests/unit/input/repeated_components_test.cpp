#include "input/repeated_components.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "fixtures/solids.h"
#include "input/orient_components.h"

namespace amhex {
namespace {

using fixtures::Flipped;
using fixtures::Joined;
using fixtures::Translated;

TriangleMesh Box() { return fixtures::MakeBox({2, 1, 1}, 0.5); }

int64_t DroppedOf(TriangleMesh* mesh) {
  return DropRepeatedComponents(FindComponents(FindEdgeAdjacency(*mesh)), *mesh);
}

TEST(RepeatedComponents, AreUsedOnceHoweverTheyFaceAndAreListed) {
  TriangleMesh turned = Flipped(Box());
  std::reverse(turned.triangles.begin(), turned.triangles.end());
  for (auto& t : turned.triangles) std::rotate(t.begin(), t.begin() + 1, t.end());
  TriangleMesh mesh = Joined(Joined(Box(), turned), Box());
  EXPECT_EQ(DroppedOf(&mesh), 2);
  EXPECT_EQ(mesh.triangles, Box().triangles);  // the first one stays
}

TEST(RepeatedComponents, AreNotThoseOfTheSameBoxAlone) {
  TriangleMesh other = Box();
  for (Vec3d& p : other.vertices) {
    if (p.x > 0 && p.x < 2) p.x += 0.1;
  }
  TriangleMesh mesh = Joined(Box(), other);
  EXPECT_EQ(DroppedOf(&mesh), 0);
  TriangleMesh apart = Joined(Box(), Translated(Box(), {1e-9, 0, 0}));
  EXPECT_EQ(DroppedOf(&apart), 0);
}

struct TurnedSoup {
  TriangleMesh mesh;
  int64_t turned = 0;
};

TurnedSoup Turn(TriangleMesh mesh) {
  const EdgeAdjacency adjacency = FindEdgeAdjacency(mesh);
  const Components components = FindComponents(adjacency);
  const OrientationResult orientation = MakeOrientationConsistent(adjacency, components, mesh);
  const int64_t turned = TurnClosedComponents(orientation, adjacency, components, mesh);
  return {std::move(mesh), turned};
}

TEST(TurnClosedComponents, ShellsAtTheSamePlaceBothLookOutward) {
  const TurnedSoup soup = Turn(Joined(Box(), Translated(Flipped(Box()), {1e-6, 0, 0})));
  EXPECT_EQ(soup.turned, 1);
  const Components components = FindComponents(FindEdgeAdjacency(soup.mesh));
  for (const double volume : ComponentVolumes(soup.mesh, components)) EXPECT_NEAR(volume, 2, 1e-9);
}

TEST(TurnClosedComponents, CavitiesAndOpenSheetsStay) {
  TriangleMesh cavity = Flipped(fixtures::MakeBox({0.5, 0.5, 0.5}, 0.5));
  TriangleMesh given = Joined(Box(), Translated(cavity, {0.7, 0.2, 0.2}));
  const auto first = static_cast<int32_t>(given.vertices.size());
  for (const Vec3d& p : {Vec3d{5, 0, 0}, Vec3d{5, 1, 0}, Vec3d{6, 0, 0}}) {
    given.vertices.push_back(p);
  }
  given.triangles.push_back({first, first + 1, first + 2});
  const TurnedSoup soup = Turn(given);
  EXPECT_EQ(soup.turned, 0);
  EXPECT_EQ(soup.mesh.triangles, given.triangles);
}

}  // namespace
}  // namespace amhex
