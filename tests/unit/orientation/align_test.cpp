#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/array_view_of.h"
#include "exec/cpu_executor.h"
#include "graph/grid_bins.h"
#include "graph/knn_exact_body.h"
#include "orientation/align_body.h"
#include "orientation/propagate_body.h"
#include "unit/graph/random_points.h"

namespace amhex {
namespace {

constexpr int kWidth = 5;
constexpr int64_t kCount = kWidth * kWidth * kWidth;

struct GridFixture {
  std::vector<Vec3f> position = GridPoints(kWidth);
  std::vector<int32_t> neighbours =
      std::vector<int32_t>(static_cast<size_t>(kCount) * kNeighbourCount);
  CpuExecutor executor;

  GridFixture() {
    GridBins<CpuExecutor> bins(executor, {kWidth, kWidth, kWidth}, 1.0f);
    executor.ForEach("knn", kCount,
                     KnnExactBody{bins.Build(ArrayViewOf(position), kCount), ArrayViewOf(position),
                                  WritableViewOf(neighbours)});
  }

  std::vector<Quatf> Aligned(const std::vector<Quatf>& before, int passes) {
    std::vector<Quatf> now = before, next = before;
    for (int pass = 0; pass < passes; ++pass) {
      executor.ForEach("align", kCount,
                       AlignBody{ArrayViewOf(position),
                                 ArrayViewOf(neighbours),
                                 {},
                                 {},
                                 {},
                                 ArrayViewOf(now),
                                 WritableViewOf(next)});
      now.swap(next);
    }
    return now;
  }
};

// Largest angle cosine between frames up to the cube's rotations.
float Agreement(const Quatf& a, const Quatf& b) { return Dot(a, MatchTo(a, b)); }

Quatf SmallTurn(uint64_t index) {
  const auto component = [&](uint64_t i) {
    return static_cast<float>(0.3 * (RandomUnit(5, RandomStream::kKnnStart, 3 * index + i) - 0.5));
  };
  return Normalized(Quatf{1, component(0), component(1), component(2)});
}

TEST(Align, FieldsThatDifferByAxisPermutationsOnlyStayAsTheyAre) {
  GridFixture grid;
  const Quatf tilted = Normalized(Quatf{0.9f, 0.2f, -0.3f, 0.1f});
  const Quatf quarter_turn = {kHalfSquareRoot, kHalfSquareRoot, 0, 0};
  std::vector<Quatf> field;
  for (int64_t i = 0; i < kCount; ++i) field.push_back(i % 3 == 0 ? tilted * quarter_turn : tilted);
  const std::vector<Quatf> after = grid.Aligned(field, 5);
  for (size_t i = 0; i < field.size(); ++i) {
    EXPECT_NEAR(std::abs(Dot(after[i], field[i])), 1, 1e-5);
  }
}

TEST(Align, DisturbedFieldsBecomeConsistent) {
  GridFixture grid;
  std::vector<Quatf> field;
  for (uint64_t i = 0; i < kCount; ++i) field.push_back(SmallTurn(i));
  const auto worst = [](const std::vector<Quatf>& f) {
    float least = 1;
    for (const Quatf& q : f) least = std::fmin(least, Agreement(f[0], q));
    return least;
  };
  const float before = worst(field);
  const float after = worst(grid.Aligned(field, 30));
  EXPECT_LT(before, 0.99f);
  EXPECT_GT(after, 0.9999f);
}

TEST(Align, SitesAtTheHullTurnAnAxisOntoItsNormal) {
  GridFixture grid;
  const Vec3f normal = UnitVector(Vec3f{0.3f, -0.2f, -1.0f});
  const std::vector<Vec3f> sample_position = {grid.position[12]};  // middle of the floor
  const std::vector<Vec3f> sample_normal = {normal};
  GridBins<CpuExecutor> bins(grid.executor, {kWidth, kWidth, kWidth}, 1.0f);
  const BinGrid& sample_bins = bins.Build(ArrayViewOf(sample_position), 1);
  const std::vector<Quatf> before(static_cast<size_t>(kCount));
  std::vector<Quatf> after = before;
  grid.executor.ForEach(
      "align", kCount,
      AlignBody{ArrayViewOf(grid.position), ArrayViewOf(grid.neighbours), sample_bins,
                ArrayViewOf(sample_position), ArrayViewOf(sample_normal), ArrayViewOf(before),
                WritableViewOf(after)});
  EXPECT_GT(std::abs(Dot(AxisOf(after[12], 2), normal)), 0.99f);
  EXPECT_LT(std::abs(Dot(AxisOf(before[12], 2), normal)), 0.96f);
  // The opposite corner is beyond the sample's influence.
  EXPECT_NEAR(Dot(after[kCount - 1], before[kCount - 1]), 1, 1e-6);
}

TEST(Propagate, FramesOfTheNearestSamplesTravelThroughAllWaves) {
  GridFixture grid;
  const Quatf tilted = Normalized(Quatf{0.95f, 0.1f, 0.2f, 0.05f});
  std::vector<int32_t> hops;
  for (int64_t i = 0; i < kCount; ++i) {
    hops.push_back(static_cast<int32_t>(i / (kWidth * kWidth)));  // the floor plays the samples
  }
  std::vector<Quatf> field(static_cast<size_t>(kCount));
  for (int64_t i = 0; i < kWidth * kWidth; ++i) field[static_cast<size_t>(i)] = tilted;
  for (int32_t wave = 1; wave < kWidth; ++wave) {
    grid.executor.ForEach("propagate", kCount,
                          PropagateBody{wave, ArrayViewOf(grid.position), ArrayViewOf(hops),
                                        ArrayViewOf(grid.neighbours), WritableViewOf(field)});
  }
  for (const Quatf& q : field) EXPECT_GT(Agreement(tilted, q), 0.9999f);
}

}  // namespace
}  // namespace amhex
