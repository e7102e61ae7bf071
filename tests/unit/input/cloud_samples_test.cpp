// What of a cloud is used: outliers are left out of noise that is evened out too.
#include "input/cloud_samples.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "fixtures/damage.h"
#include "fixtures/solids.h"

namespace amhex {
namespace {

constexpr double kPi = 3.14159265358979;
constexpr size_t kPoints = 6000;
constexpr size_t kOutliers = 60;

TEST(CloudSamples, OutliersAreNotDrawnIntoNoiseThatIsEvenedOut) {
  for (const bool with_normals : {true, false}) {
    PointCloud cloud = fixtures::SampleSurface(fixtures::MakeSphere(1, 0.05), kPoints, 1);
    fixtures::Chance chance(5);
    const auto normal = [&] {
      const double radius = std::sqrt(-2 * std::log(1 - chance.Unit()));
      return radius * std::cos(2 * kPi * chance.Unit());
    };
    for (Vec3d& p : cloud.points) p += Vec3d{normal(), normal(), normal()} * 0.06;
    for (size_t i = 0; i < kOutliers; ++i) {
      const Vec3d out = Normalized(chance.Vector());
      cloud.points.push_back(out * (1.8 + chance.Unit()));
      cloud.normals.push_back(Normalized(chance.Vector()));
    }
    if (!with_normals) cloud.normals.clear();
    RunContext run;
    std::vector<std::string> warnings;
    const auto samples = PrepareCloud(cloud, run, warnings);
    ASSERT_TRUE(samples.ok()) << samples.status();
    EXPECT_GT(samples->position.size(), kPoints - kPoints / 50);
    size_t far = 0;
    for (const Vec3d& p : samples->position) far += std::abs(Norm(p) - 1) > 0.3 ? 1 : 0;
    EXPECT_LE(far, 2U) << "of " << kOutliers;
  }
}

}  // namespace
}  // namespace amhex
