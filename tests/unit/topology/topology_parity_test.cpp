// Faces and primitives found on a device against the host's; skipped where no device is usable.
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "cuda/device_use.h"
#include "topology/collect_faces.h"
#include "topology/extract_topology.h"
#include "topology/search_primitives.h"
#include "unit/topology/cube_grid.h"

namespace amhex {
namespace {

class CudaParityOfTopology : public ::testing::Test {
 protected:
  static constexpr int kSide = 8;

  void SetUp() override {
    absl::StatusOr<DeviceUse> device = DeviceUse::Choose(Backend::kCuda);
    if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
    device_.emplace(*std::move(device));
  }

  double Uniform() { return double(random_()) / double(std::minstd_rand::max()); }

  // A shaken grid of cubes of which some edges have collapsed.
  MergedCubes DamagedGrid() {
    MergedCubes grid = testing::MakeCubeGrid(kSide, kSide, kSide);
    for (Vec3d& p : grid.vertices) p += Vec3d{Uniform(), Uniform(), Uniform()} * 0.25;
    std::vector<int32_t> stands_for(grid.vertices.size());
    for (size_t v = 0; v < stands_for.size(); ++v) stands_for[v] = static_cast<int32_t>(v);
    for (size_t cube = 0; cube < grid.corners.size(); cube += 9) {
      stands_for[grid.corners[cube][1]] = grid.corners[cube][0];
    }
    for (CellCorners& corners : grid.corners) {
      for (int32_t& v : corners) v = stands_for[v];
    }
    return grid;
  }

  // Its edges, all from either end, without some and with some across.
  std::vector<VertexPair> DamagedEdges(const MergedCubes& grid) {
    std::vector<VertexPair> edges;
    for (const VertexPair& edge : CollectCubeEdges(grid, {})) {
      if (random_() % 40 != 0) edges.push_back({edge[1], edge[0]}), edges.push_back(edge);
    }
    for (const CellCorners& corners : grid.corners) {
      if (random_() % 3 == 0 && corners[0] != corners[6]) edges.push_back({corners[0], corners[6]});
      if (random_() % 3 == 0 && corners[0] != corners[2]) edges.push_back({corners[2], corners[0]});
    }
    return edges;
  }

  std::minstd_rand random_{11};
  std::optional<DeviceUse> device_;
};

void ExpectSame(const std::vector<Primitive>& here, const std::vector<Primitive>& there) {
  ASSERT_EQ(here.size(), there.size());
  for (size_t i = 0; i < here.size(); ++i) {
    ASSERT_EQ(here[i].type, there[i].type) << "primitive " << i;
    ASSERT_EQ(here[i].corners, there[i].corners) << "primitive " << i;
    ASSERT_EQ(here[i].quality, there[i].quality) << "primitive " << i;
  }
}

TEST_F(CudaParityOfTopology, CollectsTheSameFacesAndFindsTheSamePrimitivesAsTheCpu) {
  const MergedCubes grid = DamagedGrid();
  const std::vector<VertexPair> edges = DamagedEdges(grid);
  RunContext run;
  const auto here = CollectFaces(grid.vertices, edges, run);
  const auto there = CollectFaces(grid.vertices, edges, run, &*device_);
  ASSERT_TRUE(there.ok()) << there.status();
  EXPECT_TRUE(*here == *there);
  const auto is_triangle = [](const CellFace& face) { return face.count == 3; };
  const auto triangles = std::count_if(here->begin(), here->end(), is_triangle);
  EXPECT_GT(triangles, 0);
  EXPECT_GT(static_cast<std::ptrdiff_t>(here->size()), triangles);

  const auto complex = FaceComplex::Build(static_cast<int32_t>(grid.vertices.size()), *here);
  const auto found = SearchPrimitives(complex, grid.vertices, 0, run);
  const auto found_there = SearchPrimitives(complex, grid.vertices, 0, run, &*device_);
  ASSERT_TRUE(found_there.ok()) << found_there.status();
  ExpectSame(*found, *found_there);
  std::set<PrimitiveType> types;
  for (const Primitive& primitive : *found) types.insert(primitive.type);
  EXPECT_GE(types.size(), 3U);  // or little has been compared
}

TEST_F(CudaParityOfTopology, CollectsTheSameFacesWhereNothingIsAddedToTheNetwork) {
  const MergedCubes grid = testing::MakeCubeGrid(kSide, kSide, kSide);
  const std::vector<VertexPair> edges = CollectCubeEdges(grid, {});
  const RunContext run;
  const auto here = CollectFaces(grid.vertices, edges, run);
  const auto there = CollectFaces(grid.vertices, edges, run, &*device_);
  ASSERT_TRUE(there.ok()) << there.status();
  EXPECT_EQ(here->size(), 3U * kSide * kSide * (kSide + 1));
  EXPECT_TRUE(*here == *there);
}

TEST_F(CudaParityOfTopology, ExtractsTheSameTableAsTheCpu) {
  MergedCubes grid = DamagedGrid();
  grid.hull_faces.assign(grid.corners.size(), 0);
  MeshingParams params;
  for (const Extraction extraction : {Extraction::kDirect, Extraction::kPaper}) {
    params.assembly.extraction = extraction;
    RunContext run;
    params.run.backend = Backend::kCpu;
    const auto here = ExtractTopology(grid, params, run);
    params.run.backend = Backend::kCuda;
    const auto there = ExtractTopology(grid, params, run);
    ASSERT_TRUE(there.ok()) << there.status();
    EXPECT_EQ(here->initial_count, there->initial_count);
    ExpectSame(here->primitives, there->primitives);
  }
}

}  // namespace
}  // namespace amhex
