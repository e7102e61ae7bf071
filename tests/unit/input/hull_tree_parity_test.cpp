// The hull's hierarchy built on a device against the host's, to the bit; skipped where no device is
// usable.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "cuda/device_use.h"
#include "fixtures/solids.h"
#include "input/build_hull.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

class CudaParityOfTheHierarchy : public testing::Test {
 protected:
  void SetUp() override {
    absl::StatusOr<DeviceUse> device = DeviceUse::Choose(Backend::kCuda);
    if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
    device_.emplace(*std::move(device));
  }

  void ExpectSame(const TriangleMesh& mesh) {
    const HullQueries here(mesh.vertices, mesh.triangles);
    const HullQueries there(mesh.vertices, mesh.triangles, {}, &*device_);
    EXPECT_EQ(here.resident(), nullptr);
    EXPECT_NE(there.resident(), nullptr);  // or it has not been built there
    const HullView &a = here.view(), &b = there.view();
    ASSERT_EQ(a.triangles.size, b.triangles.size);
    ASSERT_EQ(a.nodes.size, b.nodes.size);
    EXPECT_EQ(a.is_closed, b.is_closed);
    for (int64_t i = 0; i < a.triangles.size; ++i) {
      const HullTriangle &s = a.triangles[i], &t = b.triangles[i];
      ASSERT_TRUE(s.a == t.a && s.b == t.b && s.c == t.c) << "triangle " << i;
      ASSERT_EQ(a.original[i], b.original[i]);
      ASSERT_TRUE(a.normals[i] == b.normals[i]) << "triangle " << i;
    }
    for (int64_t i = 0; i < a.nodes.size; ++i) {
      const HullNode &m = a.nodes[i], &n = b.nodes[i];
      ASSERT_TRUE(m.low == n.low && m.high == n.high) << "node " << i;
      ASSERT_TRUE(m.begin == n.begin && m.end == n.end && m.right == n.right) << "node " << i;
      // Bits, not numbers. NOLINTNEXTLINE(bugprone-suspicious-memory-comparison)
      ASSERT_EQ(std::memcmp(&a.dipoles[i], &b.dipoles[i], sizeof(HullDipole)), 0) << "node " << i;
    }
  }

  std::optional<DeviceUse> device_;
};

TEST_F(CudaParityOfTheHierarchy, OfSolidsIsTheSame) {
  ExpectSame(fixtures::MakeSphere(2, 0.1));
  ExpectSame(fixtures::MakeTwistedBox({3, 2, 4}, 1.0, 0.1));
  ExpectSame(fixtures::MakeBox({3, 3, 3}, 0.125));  // zeros, and many centres that are equal
}

// Its default size, which widths decide, and its sharp edges are answers of that hierarchy.
TEST_F(CudaParityOfTheHierarchy, GivesTheSameHull) {
  const InputHull input = fixtures::MakeBracket(1, 0.125);
  MeshingParams params;
  params.run.backend = Backend::kCpu;
  RunContext run;
  const auto here = BuildHull(input, params, run);
  params.run.backend = Backend::kCuda;
  const auto there = BuildHull(input, params, run);
  ASSERT_TRUE(here.ok()) << here.status();
  ASSERT_TRUE(there.ok()) << there.status();
  EXPECT_NE(there->queries->resident(), nullptr);
  EXPECT_EQ(here->frame.scale, there->frame.scale);
  EXPECT_EQ(here->patch, there->patch);
  ASSERT_GT(here->sharp_edges.size(), 0U);
  EXPECT_EQ(here->sharp_degree, there->sharp_degree);
}

TEST_F(CudaParityOfTheHierarchy, LeavesOutTheSameTrianglesWithoutArea) {
  TriangleMesh mesh = fixtures::MakeSphere(2, 0.1);
  for (size_t i = 0; i < mesh.triangles.size(); i += 3) mesh.triangles[i][2] = mesh.triangles[i][1];
  ExpectSame(mesh);
  for (auto& t : mesh.triangles) t[2] = t[1];
  ExpectSame(mesh);
}

// Smaller and smaller towards one corner, each several times: bins part a few at every level, and
// in the end there is nothing to part by.
TEST_F(CudaParityOfTheHierarchy, IsTheSameWhereNodesAreHalvedByCount) {
  TriangleMesh mesh;
  constexpr int kCopies = 7, kSizes = 400;
  for (int k = 0; k < kSizes; ++k) {
    const double x = std::ldexp(1.0, -(k * 331 % kSizes));
    const auto first = static_cast<int32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(), {{x, 0, 0}, {1.5 * x, 0, 0}, {x, 0.5 * x, 0}});
    for (int copy = 0; copy < kCopies; ++copy) {
      mesh.triangles.push_back({first, first + 1, first + 2});
    }
  }
  ExpectSame(mesh);
}

}  // namespace
}  // namespace amhex
