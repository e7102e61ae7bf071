// The law of giving up early: what is given up could not have been deep enough.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "closure/star_geometry.h"

namespace amhex {
namespace {

TEST(FindKernel, GivesUpOnlyWhatIsShallowerThanWanted) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> number(-1, 1);
  int given_up = 0, deep = 0;
  for (int round = 0; round < 500; ++round) {
    std::vector<KernelPlane> planes;
    for (int i = 0; i < 12; ++i) {
      const Vec3d normal = Normalized(Vec3d{number(random), number(random), number(random)});
      planes.push_back({normal, normal * -0.3 + Vec3d{0.3 * number(random), 0, 0}});
    }
    const Vec3d start{number(random), number(random), number(random)};
    const KernelPoint whole = FindKernel(planes, start);
    for (const double hopeless : {-0.2, 0.0, 0.1, 0.2}) {
      const KernelPoint asked = FindKernel(planes, start, hopeless);
      if (whole.depth >= hopeless) {
        EXPECT_EQ(asked.depth, whole.depth);
        EXPECT_EQ(asked.point, whole.point);
        ++deep;
      } else {
        EXPECT_LT(asked.depth, hopeless);
        given_up += asked.depth != whole.depth ? 1 : 0;
      }
    }
  }
  EXPECT_GT(deep, 0);
  EXPECT_GT(given_up, 0) << "or the test shows nothing";
}

}  // namespace
}  // namespace amhex
