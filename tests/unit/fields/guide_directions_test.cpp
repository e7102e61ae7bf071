#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

#include "fields/orientation_field.h"
#include "fixtures/solids.h"
#include "input/guidance_checks.h"
#include "unit/fields/field_fixtures.h"

namespace amhex::fields {
namespace {

using ::testing::HasSubstr;

// The frames inside a ball of radius 6, where nothing else asks for a direction in its middle.
std::vector<double> CosinesNear(const Guidance& guidance, const Vec3d& direction,
                                double (*distance)(const Vec3d&)) {
  Hull hull = HullOf(fixtures::MakeSphere(6, 0.7));
  hull.guidance = guidance;
  RunContext run;
  auto grid = BuildBackgroundGrid(hull, 1.0 / kNodesPerEdge, ProgressSlice(run, 0, 0.5));
  EXPECT_TRUE(grid.ok());
  const auto field = SolveOrientationField(*grid, {}, {}, ProgressSlice(run, 0.5, 1));
  EXPECT_TRUE(field.ok());
  std::vector<double> cosines;
  for (int64_t i = 0; i < grid->count(); ++i) {
    const Vec3d p = grid->Position(i);
    if (distance(p) > 0.7 || Norm(p) > 4) continue;
    cosines.push_back(FindNearestAxis(ToFrame(field->frames[i]), direction).cosine);
  }
  return cosines;
}

double Mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

TEST(GuideDirections, FramesFollowAPlane) {
  const Vec3d normal = Normalized(Vec3d{1, 2, 4});
  Guidance guidance;
  guidance.planes.push_back({{}, normal});
  const auto from_plane = [](const Vec3d& p) {
    return std::abs(Dot(Normalized(Vec3d{1, 2, 4}), p));
  };
  const auto guided = CosinesNear(guidance, normal, from_plane);
  ASSERT_FALSE(guided.empty());
  EXPECT_GT(Mean(guided), 0.99);
  EXPECT_LT(Mean(CosinesNear({}, normal, from_plane)), 0.98);
}

TEST(GuideDirections, FramesFollowBothAxesOfASample) {
  const AxisFrame turn = ToFrame(SkewRotation());
  Guidance guidance;
  guidance.samples.push_back({{}, turn.axis[0], turn.axis[1]});
  const auto from_centre = [](const Vec3d& p) { return Norm(p); };
  for (const Vec3d& axis : turn.axis) {
    EXPECT_GT(Mean(CosinesNear(guidance, axis, from_centre)), 0.99);
  }
}

TEST(GuideDirections, NothingIsStoredWithoutGuidance) {
  RunContext run;
  const auto grid = BuildBackgroundGrid(HullOf(fixtures::MakeBox({3, 3, 3}, 1)),
                                        1.0 / kNodesPerEdge, ProgressSlice(run, 0, 1));
  ASSERT_TRUE(grid.ok());
  EXPECT_TRUE(grid->fine().guides.empty());
  EXPECT_EQ(grid->fine().GuidesOf(0), nullptr);
}

TEST(GuidanceChecks, NameTheFirstOffenderAndTheCount) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  Guidance guidance;
  guidance.samples.assign(5, {{}, {0, 0, 1}, {}});
  EXPECT_TRUE(CheckGuidance(guidance, {}).ok());
  guidance.samples[1].axis = guidance.samples[3].axis = {};
  EXPECT_THAT(std::string(CheckGuidance(guidance, {}).message()),
              HasSubstr("guide sample 1 (first of 2) has no direction"));
  guidance.samples[4].position.x = nan;
  EXPECT_THAT(std::string(CheckGuidance(guidance, {}).message()),
              HasSubstr("guide sample 4 is not finite"));
  guidance.samples.clear();
  guidance.planes.push_back({{}, {}});
  EXPECT_THAT(std::string(CheckGuidance(guidance, {}).message()),
              HasSubstr("guide plane 0 has no normal"));
}

TEST(GuidanceChecks, RefuseAStartWithoutOrientationField) {
  Guidance guidance;
  guidance.planes.push_back({{}, {0, 0, 1}});
  MeshingParams params;
  params.relaxation.initialization = Initialization::kGrid;
  EXPECT_THAT(std::string(CheckGuidance(guidance, params).message()), HasSubstr("FIELD"));
}

}  // namespace
}  // namespace amhex::fields
