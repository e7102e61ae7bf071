#include "input/level_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "base/counter_rng.h"
#include "input/surface_topology.h"
#include "support/surface_measures.h"

namespace amhex {
namespace {

// A field given by a formula; its normal is the formula's slope.
class FormulaField : public SurfaceField {
 public:
  explicit FormulaField(std::function<double(const Vec3d&)> formula)
      : formula_(std::move(formula)) {}
  double Value(const Vec3d& p) const override { return formula_(p); }
  Vec3d Normal(const Vec3d& p, double) const override {
    constexpr double kStep = 1e-6;
    const auto slope = [&](const Vec3d& d) { return formula_(p + d) - formula_(p - d); };
    return Normalized(Vec3d{slope({kStep, 0, 0}), slope({0, kStep, 0}), slope({0, 0, kStep})});
  }

 private:
  std::function<double(const Vec3d&)> formula_;
};

TriangleMesh Extract(const SurfaceField& field, const Box3d& box, double spacing,
                     const std::vector<Vec3d>& seeds) {
  RunContext run;
  auto mesh = ExtractLevel(GridAround(box, spacing), field, seeds, run);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : TriangleMesh{};
}

void ExpectTwoManifold(TriangleMesh mesh) {
  EXPECT_TRUE(testing_support::IsClosedAndOriented(mesh));
  const EdgeAdjacency adjacency = FindEdgeAdjacency(mesh);
  EXPECT_TRUE(adjacency.IsClosedManifold());
  EXPECT_EQ(SplitFans(adjacency, mesh), 0) << "vertices with more than one fan";
}

const Box3d kBox{{-1, -1, -1}, {1, 1, 1}};

TEST(ExtractLevel, ASphereHasItsVolumeAndRadius) {
  const FormulaField field([](const Vec3d& p) { return Norm(p) - 0.8; });
  const TriangleMesh mesh = Extract(field, kBox, 0.07, {{0.8, 0, 0}});
  ExpectTwoManifold(mesh);
  EXPECT_EQ(testing_support::EulerNumber(mesh), 2);
  EXPECT_NEAR(testing_support::EnclosedVolume(mesh), 4.0 / 3 * 3.14159 * 0.512, 0.02);
  for (const Vec3d& p : mesh.vertices) EXPECT_NEAR(Norm(p), 0.8, 0.005);
}

TEST(ExtractLevel, OneSeedLeadsAllAroundTheSurface) {
  const FormulaField field([](const Vec3d& p) {
    const double ring = std::hypot(p.x, p.y) - 0.6;
    return std::hypot(ring, p.z) - 0.25;
  });
  const TriangleMesh mesh = Extract(field, kBox, 0.06, {{0.85, 0, 0}});
  ExpectTwoManifold(mesh);
  EXPECT_EQ(testing_support::EulerNumber(mesh), 0);
}

TEST(ExtractLevel, EdgesAndCornersOfABoxComeOutSharp) {
  // Turned, so that no face is parallel to the grid.
  const double c = std::cos(0.5), s = std::sin(0.5);
  const auto local = [=](const Vec3d& p) {
    const Vec3d q{c * p.x - s * p.y, s * p.x + c * p.y, p.z};
    return Vec3d{q.x, c * q.y - s * q.z, s * q.y + c * q.z};
  };
  const FormulaField field([=](const Vec3d& p) {
    const Vec3d q = local(p);
    return std::max({std::abs(q.x), std::abs(q.y), std::abs(q.z)}) - 0.5;
  });
  const TriangleMesh mesh = Extract(field, kBox, 0.08, {{0.5, 0, 0}, {0, 0, 0.5}, {0, 0.5, 0}});
  ExpectTwoManifold(mesh);
  EXPECT_NEAR(testing_support::EnclosedVolume(mesh), 1, 0.004);
  EXPECT_NEAR(testing_support::SurfaceArea(mesh), 6, 0.04);
}

TEST(ExtractLevel, AnyFieldAtAllGivesATwoManifold) {
  // Random signs on the grid itself: every ambiguous case occurs.
  for (uint64_t seed = 0; seed < 8; ++seed) {
    const double share_inside = 0.1 + 0.1 * static_cast<double>(seed);
    const FormulaField field([=](const Vec3d& p) {
      const auto cell = [](double x) { return static_cast<uint64_t>(std::floor((x + 9) * 8)); };
      const uint64_t key = (cell(p.x) * 1024 + cell(p.y)) * 1024 + cell(p.z);
      return RandomUnit(seed, RandomStream::kGridJitter, key) - share_inside;
    });
    std::vector<Vec3d> seeds;
    for (double x = -1; x <= 1; x += 0.25) {
      for (double y = -1; y <= 1; y += 0.25) {
        for (double z = -1; z <= 1; z += 0.25) seeds.push_back({x, y, z});
      }
    }
    ExpectTwoManifold(Extract(field, kBox, 0.125, seeds));
  }
}

TEST(ExtractLevel, WhatReachesTheRimIsClosedThere) {
  const FormulaField everywhere([](const Vec3d&) { return -1.0; });
  RunContext run;
  const LevelGrid grid = GridAround({{0, 0, 0}, {0.2, 0.2, 0.2}}, 0.1);
  std::vector<Vec3d> seeds;
  for (int64_t i = 0; i < grid.node_count[0]; ++i) {
    for (int64_t j = 0; j < grid.node_count[1]; ++j) {
      for (int64_t k = 0; k < grid.node_count[2]; ++k) {
        seeds.push_back(grid.low + Vec3d{i * 0.1, j * 0.1, k * 0.1});
      }
    }
  }
  const auto mesh = ExtractLevel(grid, everywhere, seeds, run);
  ASSERT_TRUE(mesh.ok());
  ExpectTwoManifold(*mesh);
  EXPECT_GT(testing_support::EnclosedVolume(*mesh), 0.008);
}

TEST(ExtractLevel, NothingInsideGivesNoTriangle) {
  const FormulaField nowhere([](const Vec3d&) { return 1.0; });
  EXPECT_TRUE(Extract(nowhere, kBox, 0.2, {{0, 0, 0}}).triangles.empty());
}

TEST(ExtractLevel, AStoppedRunIsCancelled) {
  const FormulaField field([](const Vec3d& p) { return Norm(p) - 0.8; });
  RunContext run;
  run.RequestStop();
  const auto mesh = ExtractLevel(GridAround(kBox, 0.1), field, {{0.8, 0, 0}}, run);
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace amhex
