// Lips and grooves that a rebuilt surface has in openings of a scan, where nothing was measured,
// are evened out; what samples support stays.
#include "input/fair_openings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "fixtures/damage.h"
#include "fixtures/solids.h"

namespace amhex {
namespace {

constexpr double kGrid = 0.05;
constexpr double kEdgeLength = 0.15;
constexpr double kRim = 0.8;  // the opening is what of the unit sphere is above

CloudSamples SamplesOf(const TriangleMesh& mesh, size_t count, double area) {
  PointCloud cloud = fixtures::SampleSurface(mesh, count, 1);
  CloudSamples samples;
  samples.spacing.assign(count, std::sqrt(area / static_cast<double>(count)));
  samples.position = std::move(cloud.points);
  samples.normal = std::move(cloud.normals);
  return samples;
}

CloudSamples SamplesOfSphere() {
  return SamplesOf(fixtures::MakeSphere(1, kGrid), 6000, 4 * std::numbers::pi);
}

// The same without those above the rim.
CloudSamples WithOpening(const CloudSamples& all) {
  CloudSamples kept;
  for (size_t i = 0; i < all.position.size(); ++i) {
    if (all.position[i].z > kRim) continue;
    kept.position.push_back(all.position[i]);
    kept.normal.push_back(all.normal[i]);
    kept.spacing.push_back(all.spacing[i]);
  }
  return kept;
}

// The unit sphere with a ridge across the opening, two grid cells wide and as high.
TriangleMesh SphereWithRidge() {
  TriangleMesh mesh = fixtures::MakeSphere(1, kGrid);
  for (Vec3d& p : mesh.vertices) {
    if (p.z > kRim + kGrid && std::abs(p.x) < kGrid) p = p * (1 + 2 * kGrid);
  }
  return mesh;
}

double FarthestFromSphere(const TriangleMesh& mesh) {
  double farthest = 0;
  for (const Vec3d& p : mesh.vertices) farthest = std::max(farthest, std::abs(Norm(p) - 1));
  return farthest;
}

TriangleMesh Faired(TriangleMesh mesh, const CloudSamples& samples,
                    double edge_length = kEdgeLength) {
  FairOpenings(samples, PointTree(samples.position), edge_length, kGrid, mesh, {});
  return mesh;
}

TEST(FairOpenings, ARidgeAcrossAnOpeningIsEvenedOut) {
  const TriangleMesh mesh = SphereWithRidge();
  const double before = FarthestFromSphere(mesh);
  ASSERT_GT(before, 1.9 * kGrid);
  const TriangleMesh faired = Faired(mesh, WithOpening(SamplesOfSphere()));
  EXPECT_LT(FarthestFromSphere(faired), 0.4 * before);
  EXPECT_EQ(faired.triangles, mesh.triangles);
}

TEST(FairOpenings, VerticesWithASampleNearbyStay) {
  const CloudSamples samples = WithOpening(SamplesOfSphere());
  const TriangleMesh mesh = SphereWithRidge();
  const TriangleMesh faired = Faired(mesh, samples);
  const PointTree tree(samples.position);
  size_t moved = 0;
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (mesh.vertices[v] == faired.vertices[v]) continue;
    ++moved;
    const PointTree::Neighbour nearest = tree.Nearest(mesh.vertices[v]);
    EXPECT_GT(std::sqrt(nearest.squared_distance),
              samples.spacing[static_cast<size_t>(nearest.index)])
        << "vertex " << v;
  }
  EXPECT_GT(moved, 0u);
}

TEST(FairOpenings, ASurfaceWithSamplesEverywhereStaysAsItIs) {
  const TriangleMesh ridge = SphereWithRidge();
  EXPECT_TRUE(Faired(ridge, SamplesOf(ridge, 6000, 4 * std::numbers::pi)).vertices ==
              ridge.vertices);
  const TriangleMesh box = fixtures::MakeBox({1, 1, 1}, kGrid);
  EXPECT_TRUE(Faired(box, SamplesOf(box, 3000, 6)).vertices == box.vertices);
}

TEST(FairOpenings, AnOpeningIsLeftWhereItWouldPassThroughAnotherPart) {
  // Large cells flatten the opening: it would come to lie in a cavity that is near behind it.
  constexpr double kLargeEdges = 0.6;
  const CloudSamples samples = WithOpening(SamplesOfSphere());
  const auto stays = [&](double radius) {
    const TriangleMesh cavity = fixtures::Flipped(fixtures::MakeSphere(radius, kGrid));
    const CloudSamples inner = SamplesOf(cavity, 6000, 4 * std::numbers::pi * radius * radius);
    CloudSamples both = samples;
    both.position.insert(both.position.end(), inner.position.begin(), inner.position.end());
    both.normal.insert(both.normal.end(), inner.normal.begin(), inner.normal.end());
    both.spacing.insert(both.spacing.end(), inner.spacing.begin(), inner.spacing.end());
    const TriangleMesh mesh = fixtures::Joined(fixtures::MakeSphere(1, kGrid), cavity);
    return Faired(mesh, both, kLargeEdges).vertices == mesh.vertices;
  };
  EXPECT_FALSE(stays(0.6));
  EXPECT_TRUE(stays(0.88));
}

}  // namespace
}  // namespace amhex
