// Clouds that scanners make: noise, uneven density, a missing bottom, against the same solid clean.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "amhex/mesher.h"
#include "fixtures/damage.h"
#include "fixtures/solids.h"
#include "support/mesh_invariants.h"

namespace amhex {
namespace {

using ::testing::IsEmpty;
using testing_support::BoundaryPolygons;
using testing_support::BrokenLaws;
using testing_support::LeastScaledJacobian;
using testing_support::Polygon;

constexpr double kMajorRadius = 2, kMinorRadius = 0.9;
constexpr size_t kPoints = 4000;

double DistanceToTorus(const Vec3d& p) {
  const double ring = std::hypot(p.x, p.y) - kMajorRadius;
  return std::abs(std::hypot(ring, p.z) - kMinorRadius);
}

PointCloud CleanCloud() {
  return fixtures::SampleSurface(fixtures::MakeTorus(kMajorRadius, kMinorRadius, 0.06), kPoints, 1);
}

double DiagonalOf(const PointCloud& cloud) {
  Box3d box;
  for (const Vec3d& p : cloud.points) box.Extend(p);
  return box.Diagonal();
}

// Normally distributed in every coordinate; the normals stay as they were measured.
PointCloud WithNoise(PointCloud cloud, double deviation) {
  fixtures::Chance chance(7);
  const auto normal = [&] {
    const double radius = std::sqrt(-2 * std::log(1 - chance.Unit()));
    return radius * std::cos(2 * std::numbers::pi * chance.Unit());
  };
  for (Vec3d& p : cloud.points) p += Vec3d{normal(), normal(), normal()} * deviation;
  return cloud;
}

MeshingResult MeshOf(const InputHull& input) {
  MeshingParams params;
  params.sizing.cell_count = 1200;
  params.run.backend = Backend::kCpu;
  RunContext run;
  absl::StatusOr<MeshingResult> result = Mesh(input, params, run);
  EXPECT_TRUE(result.ok()) << result.status();
  if (!result.ok()) return {};
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  return *std::move(result);
}

// Share of the boundary's faces whose centre is within half a cell of the torus.
double ShareNearTorus(const MeshingResult& result) {
  int64_t near = 0;
  const std::vector<Polygon> faces = BoundaryPolygons(result.mesh);
  for (const Polygon& face : faces) {
    Vec3d centre;
    for (const int32_t v : face) centre += result.mesh.vertices[static_cast<size_t>(v)];
    near += DistanceToTorus(centre / static_cast<double>(face.size())) <=
            result.statistics.edge_length / 2;
  }
  return static_cast<double>(near) / static_cast<double>(faces.size());
}

// Average over the cells that touch the boundary nowhere.
double InteriorQuality(const AtMostHexaMesh& mesh) {
  std::vector<uint8_t> on_boundary(mesh.vertices.size(), 0);
  for (const Polygon& face : BoundaryPolygons(mesh)) {
    for (const int32_t v : face) on_boundary[static_cast<size_t>(v)] = 1;
  }
  double sum = 0;
  int64_t count = 0;
  for (const CellCorners& corners : mesh.corners) {
    const bool is_interior = std::none_of(corners.begin(), corners.end(), [&](int32_t v) {
      return on_boundary[static_cast<size_t>(v)] != 0;
    });
    if (!is_interior) continue;
    sum += LeastScaledJacobian(corners, mesh.vertices);
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

TEST(CleanCloud, HasNearlyAsManyHexahedraAsTheMeshItIsFrom) {
  for (const TriangleMesh& mesh :
       {fixtures::MakeTorus(kMajorRadius, kMinorRadius, 0.06), fixtures::MakeCylinder(1, 3, 0.1)}) {
    const PointCloud cloud = fixtures::SampleSurface(mesh, 2 * kPoints, 1);
    const double share = MeshOf(cloud).statistics.hexahedra_ratio;
    EXPECT_GE(share, MeshOf(mesh).statistics.hexahedra_ratio - 0.03);
  }
}

TEST(NoisyCloud, HalfAPercentOfNoiseChangesLittle) {
  const PointCloud clean = CleanCloud();
  const MeshingResult reference = MeshOf(clean);
  const MeshingResult noisy = MeshOf(WithNoise(clean, 0.005 * DiagonalOf(clean)));
  EXPECT_EQ(noisy.statistics.genus, 1);
  EXPECT_EQ(noisy.statistics.boundary_component_count, 1);
  EXPECT_GE(ShareNearTorus(noisy), 0.97);
  const double quality = InteriorQuality(reference.mesh);
  EXPECT_GT(quality, 0.8);
  EXPECT_NEAR(InteriorQuality(noisy.mesh), quality, 0.02 * quality);
}

TEST(NoisyCloud, HalfAPercentOfNoiseKeepsTheHullWithoutNormalsToo) {
  PointCloud cloud = CleanCloud();
  cloud = WithNoise(cloud, 0.005 * DiagonalOf(cloud));
  cloud.normals.clear();
  const MeshingResult noisy = MeshOf(cloud);
  EXPECT_EQ(noisy.statistics.genus, 1);
  EXPECT_EQ(noisy.statistics.boundary_component_count, 1);
  EXPECT_GE(ShareNearTorus(noisy), 0.97);
}

TEST(NoisyCloud, OnePercentOfNoiseKeepsTheShape) {
  const PointCloud clean = CleanCloud();
  const MeshingResult noisy = MeshOf(WithNoise(clean, 0.01 * DiagonalOf(clean)));
  EXPECT_EQ(noisy.statistics.genus, 1);
  EXPECT_EQ(noisy.statistics.boundary_component_count, 1);
  EXPECT_GE(ShareNearTorus(noisy), 0.97);
}

TEST(NoisyCloud, ThirtyTimesTheDensityOnOneSideChangesNoShape) {
  PointCloud uneven;
  fixtures::Chance chance(3);
  const PointCloud dense = fixtures::SampleSurface(
      fixtures::MakeTorus(kMajorRadius, kMinorRadius, 0.06), 10 * kPoints, 2);
  const double reach = kMajorRadius + kMinorRadius;
  for (size_t i = 0; i < dense.points.size(); ++i) {
    const double along = (dense.points[i].x / reach + 1) / 2;
    if (chance.Unit() > std::pow(30.0, -along)) continue;
    uneven.points.push_back(dense.points[i]);
    uneven.normals.push_back(dense.normals[i]);
  }
  const MeshingResult result = MeshOf(uneven);
  EXPECT_EQ(result.statistics.genus, 1);
  EXPECT_EQ(result.statistics.boundary_component_count, 1);
  EXPECT_GE(ShareNearTorus(result), 0.99);
}

}  // namespace
}  // namespace amhex
