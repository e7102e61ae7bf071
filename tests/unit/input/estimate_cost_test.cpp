#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <variant>

#include "amhex/mesher.h"
#include "fixtures/solids.h"

namespace amhex {
namespace {

TEST(EstimateCost, CellsFollowFromVolumeAndEdgeLength) {
  MeshingParams params;
  params.sizing.edge_length = 0.1;
  const auto estimate = EstimateCost(fixtures::MakeBox({3, 2, 1}, 0.5), params);
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_NEAR(static_cast<double>(estimate->cell_count), 6000, 1);
}

TEST(EstimateCost, AWantedCellCountIsTaken) {
  MeshingParams params;
  params.sizing.cell_count = 1234;
  const auto estimate = EstimateCost(fixtures::MakeSphere(1, 0.3), params);
  ASSERT_TRUE(estimate.ok());
  EXPECT_EQ(estimate->cell_count, 1234);
}

TEST(EstimateCost, MoreCellsCostMore) {
  MeshingParams few, many;
  few.sizing.cell_count = 1000;
  many.sizing.cell_count = 100000;
  const InputHull hull = fixtures::MakeSphere(1, 0.3);
  const auto small = EstimateCost(hull, few), large = EstimateCost(hull, many);
  ASSERT_TRUE(small.ok() && large.ok());
  EXPECT_GT(large->memory_bytes, small->memory_bytes);
  EXPECT_GT(large->seconds, small->seconds);
}

TEST(EstimateCost, CloudsAreEstimatedByTheirBox) {
  MeshingParams params;
  params.sizing.edge_length = 0.1;
  const auto estimate = EstimateCost(fixtures::SampleCentres(fixtures::MakeSphere(1, 0.2)), params);
  ASSERT_TRUE(estimate.ok());
  EXPECT_GT(estimate->cell_count, 2000);
  EXPECT_LT(estimate->cell_count, 8000);
}

TEST(PredictCost, WithoutTheGeometryAWantedCellCountCostsTheSame) {
  MeshingParams params;
  params.sizing.cell_count = 1234;
  const InputHull hull = fixtures::MakeSphere(1, 0.3);
  const auto estimate = EstimateCost(hull, params);
  ASSERT_TRUE(estimate.ok());
  const auto triangles = static_cast<int64_t>(std::get<TriangleMesh>(hull).triangles.size());
  const CostEstimate predicted = PredictCost(params, triangles);
  EXPECT_EQ(predicted.cell_count, estimate->cell_count);
  EXPECT_EQ(predicted.memory_bytes, estimate->memory_bytes);
  EXPECT_EQ(predicted.seconds, estimate->seconds);
}

TEST(PredictCost, AnEdgeLengthTellsNoMemoryButTheTimeOfTheDefault) {
  MeshingParams params;
  const CostEstimate by_default = PredictCost(params, 100);
  EXPECT_GT(by_default.memory_bytes, 0);
  EXPECT_GT(by_default.seconds, 0);
  params.sizing.edge_length = 0.1;
  const CostEstimate predicted = PredictCost(params, 100);
  EXPECT_EQ(predicted.cell_count, 0);
  EXPECT_EQ(predicted.memory_bytes, 0);
  EXPECT_EQ(predicted.seconds, by_default.seconds);
}

TEST(EstimateCost, ADeviceIsAskedForMemoryUnlessTheCpuIsWanted) {
  MeshingParams params;
  params.sizing.cell_count = 20'000'000;
  const InputHull hull = fixtures::MakeSphere(1, 0.3);
  const auto estimate = EstimateCost(hull, params);
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_GT(estimate->device_memory_bytes, 1'000'000'000);
  EXPECT_LT(estimate->device_memory_bytes, 80'000'000'000);  // of a large device
  params.run.backend = Backend::kCpu;
  EXPECT_EQ(EstimateCost(hull, params)->device_memory_bytes, 0);
}

TEST(EstimateCost, AbsurdSizesAreOutOfRangeAtOnce) {
  MeshingParams params;
  params.sizing.edge_length = 1e-6;
  const auto estimate = EstimateCost(fixtures::MakeSphere(1, 0.3), params);
  EXPECT_EQ(estimate.status().code(), absl::StatusCode::kOutOfRange);
}

TEST(EstimateCost, AMemoryLimitBelowTheNeedIsToldWithBothNumbers) {
  MeshingParams params;
  params.sizing.cell_count = 1'000'000;
  params.run.memory_limit_bytes = 100'000'000;
  const auto estimate = EstimateCost(fixtures::MakeSphere(1, 0.3), params);
  EXPECT_EQ(estimate.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(estimate.status().message()), ::testing::HasSubstr("100000000"));
}

TEST(EstimateCost, BadInputIsRefused) {
  EXPECT_EQ(EstimateCost(TriangleMesh{}, MeshingParams{}).status().code(),
            absl::StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace amhex
