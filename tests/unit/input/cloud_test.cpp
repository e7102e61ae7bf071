// Point clouds become closed surfaces through their points.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "fixtures/damage.h"
#include "fixtures/solids.h"
#include "input/build_hull.h"
#include "input/cloud_field.h"
#include "input/hull_queries.h"
#include "support/hull_measures.h"
#include "support/surface_measures.h"

namespace amhex {
namespace {

using testing_support::SurfaceOf;
using testing_support::UserVolume;

absl::StatusOr<Hull> Build(const PointCloud& cloud) {
  MeshingParams params;
  params.sizing.cell_count = 600;
  RunContext run;
  return BuildHull(cloud, params, run);
}

double LargestDistance(const Hull& hull) {
  double largest = 0;
  for (const Vec3d& p : hull.input_points) {
    largest = std::max(largest, hull.queries->Closest(p).distance);
  }
  return largest;
}

TEST(CloudHull, ASphereIsRecovered) {
  const auto hull = Build(fixtures::SampleCentres(fixtures::MakeSphere(1, 0.08)));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_TRUE(testing_support::IsClosedAndOriented(SurfaceOf(*hull)));
  EXPECT_EQ(testing_support::EulerNumber(SurfaceOf(*hull)), 2);
  EXPECT_NEAR(UserVolume(*hull), 4.0 / 3 * 3.14159265, 0.06);
  EXPECT_LT(LargestDistance(*hull), 0.1);
  EXPECT_TRUE(hull->sharp_edges.empty());
}

TEST(CloudHull, ATorusKeepsItsHole) {
  const auto hull = Build(fixtures::SampleCentres(fixtures::MakeTorus(2, 0.7, 0.12)));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->genus, 1);
  EXPECT_LT(LargestDistance(*hull), 0.1);
}

TEST(CloudHull, SharpEdgesOfACylinderAreRecovered) {
  const auto hull = Build(fixtures::SampleCentres(fixtures::MakeCylinder(1, 2, 0.08)));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->genus, 0);
  EXPECT_LT(LargestDistance(*hull), 0.15);
  ASSERT_FALSE(hull->sharp_edges.empty());
  double length = 0;
  for (const SharpEdge& edge : hull->sharp_edges) {
    const Vec3d a = hull->frame.ToUser(hull->vertices[static_cast<size_t>(edge.vertex_a)]);
    const Vec3d b = hull->frame.ToUser(hull->vertices[static_cast<size_t>(edge.vertex_b)]);
    length += Norm(a - b);
    EXPECT_NEAR(std::hypot(a.x, a.y), 1, 0.03);
    EXPECT_LT(std::min(std::abs(a.z), std::abs(a.z - 2)), 0.03);
  }
  EXPECT_NEAR(length, 2 * 2 * 3.14159265, 0.4);
}

TEST(CloudHull, AnOpenBottomIsClosed) {
  PointCloud cloud = fixtures::SampleCentres(fixtures::MakeSphere(1, 0.08));
  PointCloud open;
  for (size_t i = 0; i < cloud.points.size(); ++i) {
    if (cloud.points[i].z < -0.7) continue;
    open.points.push_back(cloud.points[i]);
    open.normals.push_back(cloud.normals[i]);
  }
  const auto hull = Build(open);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_TRUE(testing_support::IsClosedAndOriented(SurfaceOf(*hull)));
  EXPECT_EQ(hull->component_count, 1);
  EXPECT_EQ(hull->genus, 0);
  const double cap = 3.14159265 * 0.3 * 0.3 * (3 - 0.3) / 3;
  EXPECT_NEAR(UserVolume(*hull), 4.0 / 3 * 3.14159265 - cap / 2, cap);
}

TEST(CloudHull, SeveralBodiesStayApart) {
  const TriangleMesh sphere = fixtures::MakeSphere(1, 0.12);
  const auto hull = Build(
      fixtures::SampleCentres(fixtures::Joined(sphere, fixtures::Translated(sphere, {3, 0, 0}))));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 2);
}

TEST(CloudHull, SeveralBodiesStayApartWithoutNormalsToo) {
  const TriangleMesh torus = fixtures::MakeTorus(2, 0.7, 0.15);
  PointCloud cloud = fixtures::SampleCentres(
      fixtures::Joined(torus, fixtures::Translated(fixtures::MakeSphere(1, 0.15), {5, 0, 0})));
  cloud.normals.clear();
  const auto hull = Build(cloud);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 2);
  EXPECT_EQ(hull->genus, 1);
}

TEST(CloudHull, HollowPartsStayHollow) {
  const TriangleMesh outer = fixtures::MakeSphere(2, 0.15), inner = fixtures::MakeSphere(1, 0.15);
  const auto hull =
      Build(fixtures::SampleCentres(fixtures::Joined(outer, fixtures::Flipped(inner))));
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 2);
  EXPECT_FALSE(hull->queries->IsInside(hull->frame.ToNormalized({0, 0, 0})));
  EXPECT_NEAR(UserVolume(*hull), 4.0 / 3 * 3.14159265 * (8 - 1), 0.6);
}

TEST(CloudHull, RepeatedPointsAndOutliersAreLeftOut) {
  PointCloud cloud = fixtures::SampleCentres(fixtures::MakeSphere(1, 0.08));
  const auto clean = Build(cloud);
  for (size_t i = 0; i < 50; ++i) {
    cloud.points.push_back(cloud.points[7 * i]);
    cloud.normals.push_back(cloud.normals[7 * i]);
  }
  cloud.points.push_back({1.2, 1.4, 1.1});
  cloud.normals.push_back({0, 0, 1});
  const auto hull = Build(cloud);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 1);
  EXPECT_EQ(hull->input_points.size(), clean->input_points.size());
}

TEST(CloudHull, LengthsOfNormalsDoNotMatter) {
  PointCloud cloud = fixtures::SampleCentres(fixtures::MakeSphere(1, 0.1));
  const auto unit = Build(cloud);
  for (size_t i = 0; i < cloud.normals.size(); ++i) cloud.normals[i] *= 0.25 + 0.25 * (i % 4);
  const auto scaled = Build(cloud);
  ASSERT_TRUE(unit.ok() && scaled.ok());
  EXPECT_NEAR(UserVolume(*unit), UserVolume(*scaled), 1e-3);
}

TEST(CloudHull, NormalsMayBeAsShortOrLongAsTheyLike) {
  PointCloud cloud = fixtures::SampleCentres(fixtures::MakeSphere(1, 0.2));
  const auto unit = Build(cloud);
  for (const double length : {1e-60, 1e60}) {
    PointCloud scaled = cloud;
    for (Vec3d& n : scaled.normals) n *= length;
    const auto hull = Build(scaled);
    ASSERT_TRUE(unit.ok() && hull.ok()) << hull.status();
    EXPECT_NEAR(UserVolume(*hull), UserVolume(*unit), 1e-3);
  }
}

TEST(CloudHull, PointsWhoseNormalsCancelAreLeftOut) {
  PointCloud cloud = fixtures::SampleCentres(fixtures::MakeSphere(1, 0.1));
  for (const size_t i : {3u, 70u}) {
    cloud.points.push_back(cloud.points[i]);
    cloud.normals.push_back(-cloud.normals[i]);
  }
  const auto hull = Build(cloud);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(std::count(hull->warnings.begin(), hull->warnings.end(),
                       "points without a direction, left out: 2"),
            1);
}

TEST(CloudHull, NormalsThatAreAllZeroAreNone) {
  PointCloud cloud = fixtures::SampleCentres(fixtures::MakeSphere(1, 0.1));
  cloud.normals.assign(cloud.points.size(), Vec3d{});
  const auto hull = Build(cloud);
  ASSERT_TRUE(hull.ok()) << hull.status();
  cloud.normals.clear();
  EXPECT_EQ(hull->vertices, Build(cloud)->vertices);
  EXPECT_THAT(hull->warnings, testing::Contains(testing::HasSubstr("has no normals")));
}

TEST(CloudHull, NormalsThatLookIntoTheCloudAreTurned) {
  for (const TriangleMesh& solid :
       {fixtures::MakeTorus(2, 0.7, 0.12), fixtures::MakeBox({2, 1, 1}, 0.1),
        fixtures::Joined(fixtures::MakeSphere(2, 0.2),
                         fixtures::Flipped(fixtures::MakeSphere(1, 0.2)))}) {
    const PointCloud cloud = fixtures::SampleCentres(solid);
    PointCloud turned = cloud;
    for (Vec3d& n : turned.normals) n = -n;
    const auto hull = Build(turned);
    ASSERT_TRUE(hull.ok()) << hull.status();
    EXPECT_EQ(hull->vertices, Build(cloud)->vertices);
    EXPECT_THAT(hull->warnings, testing::Contains(testing::HasSubstr("all turned")));
  }
}

TEST(CloudHull, TwelvePointsWithoutNormalsBoundASolid) {
  const double t = (1 + std::sqrt(5.0)) / 2;
  PointCloud icosahedron;
  for (const double a : {-1.0, 1.0}) {
    for (const double b : {-t, t}) {
      icosahedron.points.insert(icosahedron.points.end(), {{a, b, 0}, {0, a, b}, {b, 0, a}});
    }
  }
  const auto hull = Build(icosahedron);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->component_count, 1);
  EXPECT_EQ(hull->genus, 0);
}

TEST(CloudHull, NormalsAreEstimatedWhereThereAreNone) {
  PointCloud cloud = fixtures::SampleCentres(fixtures::MakeTorus(2, 0.7, 0.12));
  cloud.normals.clear();
  const auto hull = Build(cloud);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_EQ(hull->genus, 1);
  EXPECT_LT(LargestDistance(*hull), 0.2);
}

TEST(CloudHull, CloudsFarDenserThanTheCellsAreThinned) {
  const TriangleMesh sphere = fixtures::MakeSphere(1, 0.0075);
  const PointCloud cloud = fixtures::SampleCentres(sphere);
  ASSERT_GT(cloud.points.size(), 200'000u);
  const auto hull = Build(cloud);
  ASSERT_TRUE(hull.ok()) << hull.status();
  EXPECT_LT(hull->input_points.size(), 50'000u);
  EXPECT_EQ(testing_support::EulerNumber(SurfaceOf(*hull)), 2);
  EXPECT_NEAR(UserVolume(*hull), 4.0 / 3 * 3.14159265, 0.03);
  EXPECT_TRUE(std::any_of(hull->warnings.begin(), hull->warnings.end(), [](const auto& warning) {
    return warning.find("denser than the cells can use") != std::string::npos;
  }));
}

TEST(CloudField, ItsPartsAnswerAsTheWhole) {
  const PointCloud cloud = fixtures::SampleSurface(fixtures::MakeBox({2, 1, 1}, 0.1), 600, 5);
  RunContext run;
  std::vector<std::string> warnings;
  absl::StatusOr<CloudSamples> samples = PrepareCloud(cloud, run, warnings);
  ASSERT_TRUE(samples.ok()) << samples.status();
  const CloudField field(*std::move(samples));
  for (const double reach : {0.02, 0.3}) {
    for (size_t i = 0; i < 40; ++i) {
      const Vec3d centre = cloud.points[7 * i] * 1.05;
      const std::unique_ptr<SurfaceField> part = field.Around(centre, reach);
      // The last one is out of reach.
      for (const Vec3d& step : {Vec3d{}, Vec3d{0.9, 0, 0}, Vec3d{-0.5, 0.5, 0.5}, Vec3d{3, 2, 0}}) {
        const Vec3d p = centre + step * reach;
        EXPECT_EQ(part->Value(p), field.Value(p));
        EXPECT_EQ(part->Normal(p, reach / 10), field.Normal(p, reach / 10));
      }
      EightPoints corners;
      for (size_t k = 0; k < corners.size(); ++k) {
        const Vec3d step{static_cast<double>(k % 2), static_cast<double>(k / 2 % 2),
                         static_cast<double>(k / 4)};
        corners[k] = centre + step * (2 * reach);
      }
      const EightValues values = part->Values(corners);
      for (size_t k = 0; k < corners.size(); ++k) EXPECT_EQ(values[k], field.Value(corners[k]));
    }
  }
}

TEST(CloudHull, TheSameCloudGivesTheSameHull) {
  const PointCloud cloud = fixtures::SampleCentres(fixtures::MakeBracket(1, 0.1));
  const auto first = Build(cloud), second = Build(cloud);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_EQ(first->vertices, second->vertices);
  EXPECT_EQ(first->triangles, second->triangles);
}

}  // namespace
}  // namespace amhex
