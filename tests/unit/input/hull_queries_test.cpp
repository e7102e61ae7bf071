#include "input/hull_queries.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "base/status_error.h"
#include "fixtures/solids.h"
#include "input/ask_hull.h"
#include "input/hull_packets.h"
#include "input/triangle_math.h"
#include "input/winding_in_lanes.h"

namespace amhex {
namespace {

// What the far field may be off by: it decides between 0 and 1.
constexpr double kWindingTolerance = 0.08;

HullQueries QueriesOf(const TriangleMesh& mesh) { return {mesh.vertices, mesh.triangles}; }

// Points spread over the mesh's box and half its size around it.
std::vector<Vec3d> ProbesAround(const TriangleMesh& mesh, int count) {
  Box3d box;
  for (const Vec3d& p : mesh.vertices) box.Extend(p);
  const Vec3d low = box.low - box.Extent() * 0.25, extent = box.Extent() * 1.5;
  std::vector<Vec3d> probes;
  for (int i = 1; i <= count; ++i) {
    // The plastic number's Kronecker sequence: even, and never on a lattice.
    const auto part = [i](double step) { return std::fmod(0.5 + i * step, 1.0); };
    probes.push_back(low + Vec3d{part(0.8191725133961645) * extent.x,
                                 part(0.6710436067037893) * extent.y,
                                 part(0.5497004779019703) * extent.z});
  }
  return probes;
}

double BruteForceDistance(const TriangleMesh& mesh, const Vec3d& p) {
  double least = 1e300;
  for (const auto& t : mesh.triangles) {
    const Vec3d q = ClosestPointOnTriangle(p, mesh.vertices[static_cast<size_t>(t[0])],
                                           mesh.vertices[static_cast<size_t>(t[1])],
                                           mesh.vertices[static_cast<size_t>(t[2])]);
    least = std::min(least, Norm(q - p));
  }
  return least;
}

double BruteForceWinding(const TriangleMesh& mesh, const Vec3d& p) {
  double sum = 0;
  for (const auto& t : mesh.triangles) {
    sum += SolidAngle(p, mesh.vertices[static_cast<size_t>(t[0])],
                      mesh.vertices[static_cast<size_t>(t[1])],
                      mesh.vertices[static_cast<size_t>(t[2])]);
  }
  return sum / (4 * std::numbers::pi);
}

std::vector<TriangleMesh> Solids() {
  return {fixtures::MakeBox({3, 2, 1}, 0.4), fixtures::MakeSphere(1.5, 0.3),
          fixtures::MakeBracket(1.0, 0.25), fixtures::MakeTorus(2, 0.6, 0.3)};
}

TEST(ArcTangent, IsTheAngleToTheLastBits) {
  constexpr double kRelativeError = 5e-16;
  const auto expect_right = [](double y, double x) {
    const double angle = std::atan2(y, x);
    ASSERT_NEAR(ArcTangent2(y, x), angle, kRelativeError * std::abs(angle)) << y << " / " << x;
  };
  for (double angle = -3.2; angle < 3.2; angle += 1e-3) {
    for (const double length : {1e-150, 1e-3, 1.0, 1e9}) {
      expect_right(length * std::sin(angle), length * std::cos(angle));
    }
  }
  for (double slope = 1e-12; slope < 1e12; slope *= 1.37) {
    for (const double y : {-slope, slope}) expect_right(y, 1), expect_right(y, -1);
  }
}

TEST(ArcTangent, OfTheNullVectorIsZeroAndOfWhatIsNoNumberIsNone) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  EXPECT_EQ(ArcTangent2(0, 0), 0);
  EXPECT_EQ(ArcTangent2(0, -1), std::numbers::pi);
  for (const double y : {1.0, kNone, kEndless}) {
    EXPECT_TRUE(std::isnan(ArcTangent2(y, kNone)));
    EXPECT_TRUE(std::isnan(ArcTangent2(kNone, y)));
  }
  EXPECT_TRUE(std::isnan(ArcTangent2(kEndless, -kEndless)));
}

TEST(ClosestPointOnTriangle, IsNeverFartherThanAnyPointOfTheTriangle) {
  const Vec3d a{0, 0, 0}, b{2, 0, 0}, c{0.3, 1, 0};
  for (double x = -1; x <= 3; x += 0.37) {
    for (double y = -1; y <= 2; y += 0.29) {
      const Vec3d p{x, y, 0.4};
      const double found = Norm(ClosestPointOnTriangle(p, a, b, c) - p);
      for (int i = 0; i <= 20; ++i) {
        for (int j = 0; i + j <= 20; ++j) {
          const Vec3d q = a + (b - a) * (i / 20.0) + (c - a) * (j / 20.0);
          ASSERT_LE(found, Norm(q - p) + 1e-12);
        }
      }
    }
  }
}

TEST(ClosestPointOnTriangle, CollapsedTrianglesGiveTheirNearestPoint) {
  const Vec3d a{0, 0, 0}, b{1, 0, 0}, c{2, 0, 0};
  EXPECT_NEAR(Norm(ClosestPointOnTriangle({1.5, 1, 0}, a, b, c) - Vec3d{1.5, 0, 0}), 0, 1e-12);
  EXPECT_NEAR(Norm(ClosestPointOnTriangle({5, 1, 0}, a, a, a) - a), 0, 1e-12);
}

TEST(HullQueries, BuiltForDistancesTellsTheSameAndRefusesToTellSides) {
  for (const TriangleMesh& mesh : Solids()) {
    const HullQueries all = QueriesOf(mesh);
    const HullQueries distances(mesh.vertices, mesh.triangles, HullQuestions::kDistances, {});
    for (const Vec3d& p : ProbesAround(mesh, 200)) {
      const HullPoint expected = all.Closest(p), found = distances.Closest(p);
      ASSERT_EQ(found.triangle, expected.triangle);
      ASSERT_EQ(found.point, expected.point);
      ASSERT_EQ(distances.IsWithin(p, 0.1), all.IsWithin(p, 0.1));
    }
    EXPECT_THROW(distances.IsInside({}), StatusError);
    EXPECT_THROW(distances.SignedDistance({}), StatusError);
  }
}

// Eight boxes at a time or one after the other, as on a device: also where several triangles are
// equally near, as before corners and edges, and where none is in reach.
TEST(HullQueries, AnswersAreTheSameWithAndWithoutPackets) {
  for (const TriangleMesh& mesh : Solids()) {
    const HullQueries queries = QueriesOf(mesh);
    HullView plain = queries.view();
    ASSERT_GT(plain.packets.size, 1);
    plain.packets = {};
    std::vector<Vec3d> probes = ProbesAround(mesh, 2000);
    for (const Vec3d& corner : mesh.vertices) {
      for (const double share : {0.5, 1.0, 1.25}) probes.push_back(corner * share);
    }
    for (const Vec3d& p : probes) {
      for (const double reach : {1e300, 0.5, 0.01, 0.0}) {
        const HullPoint packed = queries.Closest(p, reach), found = plain.Closest(p, reach);
        ASSERT_EQ(packed.triangle, found.triangle);
        ASSERT_EQ(packed.point, found.point);
        ASSERT_EQ(packed.normal, found.normal);
        ASSERT_EQ(packed.distance, found.distance);
        ASSERT_EQ(queries.IsWithin(p, reach), plain.IsWithin(p, reach));
      }
    }
  }
}

// Of so many triangles that several threads share them.
TriangleMesh LargeTorus() { return fixtures::MakeTorus(2, 0.6, 0.04); }

TEST(BuildHullTree, IsTheSameAtAnyThreadCount) {
  const TriangleMesh mesh = LargeTorus();
  ASSERT_GT(mesh.triangles.size(), 20'000);
  const auto bytes_of = [&mesh] {
    const HullQueries queries = QueriesOf(mesh);
    const HullView& view = queries.view();
    std::string bytes;
    const auto add = [&bytes](const auto& array) {
      bytes.append(reinterpret_cast<const char*>(array.data),
                   sizeof(*array.data) * static_cast<size_t>(array.size));
    };
    add(view.nodes), add(view.packets), add(view.triangles);
    return bytes;
  };
  std::vector<std::string> results;
  for (const size_t threads : {1, 2, 7}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(bytes_of());
  }
  for (const std::string& other : results) EXPECT_TRUE(results[0] == other);
}

TEST(PackHull, HoldsEveryTriangleOnceInBoxesAroundIt) {
  std::vector<TriangleMesh> meshes = Solids();
  meshes.push_back(LargeTorus());
  for (const TriangleMesh& mesh : meshes) {
    const HullQueries queries = QueriesOf(mesh);
    const HullView& hull = queries.view();
    std::vector<int> times(static_cast<size_t>(hull.triangles.size), 0);
    std::vector<int> packet_times(static_cast<size_t>(hull.packets.size), 0);
    for (int64_t k = 0; k < hull.packets.size; ++k) {
      const HullPacket& packet = hull.packets[k];
      for (int lane = 0; lane < kLanes; ++lane) {
        if (packet.low[0][lane] > packet.high[0][lane]) continue;  // missing
        const int32_t child = packet.child[lane];
        if (child >= 0) {
          ASSERT_GT(child, k);
          ++packet_times[static_cast<size_t>(child)];
          continue;
        }
        ++times[static_cast<size_t>(~child)];
        const HullTriangle& t = hull.triangles[~child];
        for (const Vec3d& corner : {t.a, t.b, t.c}) {
          for (int axis = 0; axis < 3; ++axis) {
            ASSERT_LT(packet.low[axis][lane], corner[axis]);
            ASSERT_GT(packet.high[axis][lane], corner[axis]);
          }
        }
      }
    }
    EXPECT_EQ(std::count(times.begin(), times.end(), 1), hull.triangles.size);
    EXPECT_EQ(std::count(packet_times.begin() + 1, packet_times.end(), 1), hull.packets.size - 1);
  }
}

TEST(HullQueries, ClosestAgreesWithBruteForce) {
  for (const TriangleMesh& mesh : Solids()) {
    const HullQueries queries = QueriesOf(mesh);
    for (const Vec3d& p : ProbesAround(mesh, 500)) {
      const HullPoint found = queries.Closest(p);
      ASSERT_GE(found.triangle, 0);
      EXPECT_NEAR(found.distance, BruteForceDistance(mesh, p), 1e-12);
      EXPECT_NEAR(Norm(found.point - p), found.distance, 1e-12);
      EXPECT_NEAR(Norm(found.normal), 1, 1e-12);
    }
  }
}

TEST(HullQueries, ClosestNamesATriangleThatHoldsThePoint) {
  const TriangleMesh mesh = fixtures::MakeBracket(1.0, 0.25);
  const HullQueries queries = QueriesOf(mesh);
  for (const Vec3d& p : ProbesAround(mesh, 200)) {
    const HullPoint found = queries.Closest(p);
    const auto& t = mesh.triangles[static_cast<size_t>(found.triangle)];
    const Vec3d& a = mesh.vertices[static_cast<size_t>(t[0])];
    const Vec3d& b = mesh.vertices[static_cast<size_t>(t[1])];
    const Vec3d& c = mesh.vertices[static_cast<size_t>(t[2])];
    EXPECT_NEAR(Norm(ClosestPointOnTriangle(found.point, a, b, c) - found.point), 0, 1e-12);
    EXPECT_GT(Dot(found.normal, DoubleAreaVector(a, b, c)), 0);
  }
}

TEST(HullQueries, ClosestFindsNothingBeyondTheMaximumDistance) {
  const HullQueries queries = QueriesOf(fixtures::MakeBox({1, 1, 1}, 0.5));
  EXPECT_EQ(queries.Closest({3, 0.5, 0.5}, 1.9).triangle, -1);
  EXPECT_GE(queries.Closest({3, 0.5, 0.5}, 2.1).triangle, 0);
}

TEST(HullQueries, IsWithinAgreesWithTheClosestPoint) {
  const TriangleMesh bracket = fixtures::MakeBracket(1, 0.3);
  const HullQueries queries = QueriesOf(bracket);
  for (const Vec3d& p : ProbesAround(bracket, 300)) {
    const double distance = queries.Closest(p).distance;
    EXPECT_TRUE(queries.IsWithin(p, distance * 1.000001));
    EXPECT_FALSE(queries.IsWithin(p, distance * 0.999999));
  }
}

// Points that wander, by a little or all over the place, as what is remembered was far off or near.
TEST(HullQueries, AnswersAreTheSameWhereTheLastOneIsRemembered) {
  for (const TriangleMesh& solid : Solids()) {
    const HullQueries queries = QueriesOf(solid);
    const std::vector<Vec3d> probes = ProbesAround(solid, 200);
    int32_t of_closest = -1, of_within = -1;
    for (size_t i = 0; i < probes.size(); ++i) {
      for (const double share : {0.0, 0.02, 0.5}) {
        const Vec3d p = probes[i] + (probes[(i + 1) % probes.size()] - probes[i]) * share;
        const HullPoint plain = queries.Closest(p), sooner = queries.Closest(p, of_closest);
        EXPECT_EQ(sooner.point, plain.point);
        EXPECT_EQ(sooner.triangle, plain.triangle);
        EXPECT_EQ(sooner.distance, plain.distance);
        for (const double reach : {0.05, 0.3, plain.distance}) {
          EXPECT_EQ(queries.IsWithin(p, reach, of_within), queries.IsWithin(p, reach));
        }
      }
    }
    EXPECT_GE(of_within, 0);
  }
}

TEST(HullQueries, BuildingStopsWhenAsked) {
  RunContext run;
  run.RequestStop();
  const TriangleMesh sphere = fixtures::MakeSphere(1, 0.2);
  EXPECT_THROW(HullQueries(sphere.vertices, sphere.triangles, StopPoll(run)), RunStopped);
}

TEST(HullQueries, LargeSurfacesAreBuiltInPartsWithTheSameAnswers) {
  // Enough triangles for several tasks.
  const TriangleMesh sphere = fixtures::MakeSphere(1, 0.02);
  ASSERT_GT(sphere.triangles.size(), 40'000u);
  const HullQueries queries = QueriesOf(sphere);
  for (const Vec3d& p : ProbesAround(sphere, 10)) {
    EXPECT_NEAR(queries.Closest(p).distance, BruteForceDistance(sphere, p), 1e-12);
  }
  EXPECT_NEAR(queries.WindingNumber({0.1, 0.2, 0.3}), 1, kWindingTolerance);
}

TEST(HullQueries, WindingNumberAgreesWithTheSolidAngleSum) {
  for (const TriangleMesh& mesh : Solids()) {
    const HullQueries queries = QueriesOf(mesh);
    for (const Vec3d& p : ProbesAround(mesh, 500)) {
      EXPECT_NEAR(queries.WindingNumber(p), BruteForceWinding(mesh, p), kWindingTolerance);
    }
  }
}

TEST(HullQueries, WindingNumberIsOneInsideAndZeroOutsideOfASphere) {
  const HullQueries queries = QueriesOf(fixtures::MakeSphere(1.0, 0.15));
  for (const double r : {0.0, 0.3, 0.7, 0.9, 0.97}) {
    EXPECT_TRUE(queries.IsInside({0, r, 0})) << r;
    EXPECT_NEAR(queries.WindingNumber({r, 0, 0}), 1, kWindingTolerance) << r;
  }
  for (const double r : {1.01, 1.1, 2.0, 100.0}) {
    EXPECT_FALSE(queries.IsInside({0, r, 0})) << r;
    EXPECT_NEAR(queries.WindingNumber({r, 0, 0}), 0, kWindingTolerance) << r;
  }
}

TriangleMesh WithoutLastTriangle(TriangleMesh mesh) {
  mesh.triangles.pop_back();
  return mesh;
}

// Of closed surfaces and, by solid angles, of others. Whatever lanes give where, from the baseline
// to the widest that this machine has.
TEST(WindingNumbers, HaveTheBitsOfSingleOnes) {
  const VectorWidth limit = vector_width_limit.load();
  for (const VectorWidth width : {VectorWidth::kBaseline, VectorWidth::k256, VectorWidth::k512}) {
    vector_width_limit.store(width);
    for (const TriangleMesh& solid : Solids()) {
      for (const TriangleMesh& mesh : {solid, WithoutLastTriangle(solid)}) {
        const HullQueries queries = QueriesOf(mesh);
        // Corners are points at which a triangle has no solid angle.
        std::vector<Vec3d> points = ProbesAround(mesh, 96);
        points.insert(points.end(), mesh.vertices.begin(), mesh.vertices.begin() + 24);
        for (size_t begin = 0; begin + kPointsAtOnce <= points.size(); begin += kPointsAtOnce) {
          for (int count = 0; count <= kPointsAtOnce; ++count) {
            const auto together = WindingNumbers(queries.view(), &points[begin], count);
            for (int i = 0; i < count; ++i) {
              EXPECT_EQ(together[i], queries.WindingNumber(points[begin + i]));
            }
          }
        }
      }
    }
  }
  vector_width_limit.store(limit);
}

TEST(HullAsker, TellsOfManyPointsWhatTheyAreToldOneByOne) {
  const TriangleMesh mesh = fixtures::MakeTorus(2, 0.6, 0.3);
  const HullQueries queries = QueriesOf(mesh);
  const std::vector<Vec3d> points = ProbesAround(mesh, 1003);
  const HullAsker asker(queries, nullptr, {});
  const WindingAround<PlainPoints> winding{PointsOf(points)};
  const SideOf<PlainPoints> side{PointsOf(points), 0.2}, plain_side{PointsOf(points)};
  const auto windings = asker.AskOrThrow(winding);
  const auto sides = asker.AskOrThrow(side), plain_sides = asker.AskOrThrow(plain_side);
  std::array<int, 3> seen{};
  for (int64_t i = 0; i < PointsOf(points).count(); ++i) {
    EXPECT_EQ(windings[i], winding(queries.view(), i));
    EXPECT_EQ(sides[i], side(queries.view(), i));
    EXPECT_EQ(plain_sides[i], plain_side(queries.view(), i));
    ++seen[static_cast<size_t>(sides[i])];
  }
  for (const int count : seen) EXPECT_GT(count, 10);
}

TEST(HullAsker, FindsWhatIsNearestToManyPointsAsToEachAlone) {
  const TriangleMesh mesh = fixtures::MakeTorus(2, 0.6, 0.3);
  const HullQueries queries = QueriesOf(mesh);
  std::vector<Vec3d> points = ProbesAround(mesh, 1003);
  // Next to one another, where the last answer is a good guess, and on vertices, which several
  // triangles are equally near to.
  for (size_t i = 0; i < 500; ++i) points.push_back(points[i] + Vec3d{0.01, 0, -0.02});
  points.insert(points.end(), mesh.vertices.begin(), mesh.vertices.end());
  const HullAsker asker(queries, nullptr, {});
  const auto distances = asker.AskOrThrow(DistanceTo<PlainPoints>{PointsOf(points)});
  const auto nearest = asker.AskOrThrow(ClosestTo<PlainPoints>{PointsOf(points)});
  constexpr double kEnough = 0.4;
  const auto rough = asker.AskOrThrow(DistanceTo<PlainPoints>{PointsOf(points), kEnough});
  int near_enough = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    const HullPoint alone = queries.Closest(points[i]);
    EXPECT_EQ(distances[i], alone.distance);
    EXPECT_EQ(nearest[i], alone.point);
    if (alone.distance > kEnough) {
      EXPECT_EQ(rough[i], alone.distance);
    } else {
      EXPECT_LE(rough[i], kEnough);
      ++near_enough;
    }
  }
  EXPECT_GT(near_enough, 10);
  EXPECT_LT(near_enough, static_cast<int>(points.size()) - 10);
}

TEST(HullQueries, WindingNumberCountsNestedSurfaces) {
  const TriangleMesh outer = fixtures::MakeSphere(2.0, 0.4);
  const TriangleMesh inner = fixtures::MakeSphere(1.0, 0.3);
  const HullQueries hollow = QueriesOf(fixtures::Joined(outer, fixtures::Flipped(inner)));
  EXPECT_NEAR(hollow.WindingNumber({0, 0, 0}), 0, kWindingTolerance);
  EXPECT_NEAR(hollow.WindingNumber({1.5, 0, 0}), 1, kWindingTolerance);
  const HullQueries twice = QueriesOf(fixtures::Joined(outer, inner));
  EXPECT_NEAR(twice.WindingNumber({0, 0, 0}), 2, 2 * kWindingTolerance);
}

TEST(HullQueries, SignedDistanceOfASphereIsRadiusMinusOne) {
  const HullQueries queries = QueriesOf(fixtures::MakeSphere(1.0, 0.05));
  for (const double r : {0.2, 0.5, 0.9, 1.2, 3.0}) {
    EXPECT_NEAR(queries.SignedDistance({0, 0, r}), r - 1, 0.002) << r;
  }
}

TEST(HullQueries, ExitDistanceIsTheThicknessOfABox) {
  const HullQueries queries = QueriesOf(fixtures::MakeBox({3, 2, 1}, 0.3));
  EXPECT_NEAR(queries.ExitDistance({1.1, 1.2, 1}, {0, 0, -1}, 1e-3), 1, 1e-12);
  EXPECT_NEAR(queries.ExitDistance({0, 1.2, 0.4}, {1, 0, 0}, 1e-3), 3, 1e-12);
  EXPECT_LT(queries.ExitDistance({1.1, 1.2, 1.5}, {0, 0, 1}, 1e-3), 0);
}

TEST(HullQueries, TrianglesWithoutAreaAreLeftOut) {
  TriangleMesh mesh = fixtures::MakeBox({1, 1, 1}, 1);
  const double before = QueriesOf(mesh).WindingNumber({0.5, 0.5, 0.5});
  const auto first = static_cast<int32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), {{0.5, 0.5, 1}, {0.6, 0.5, 1}, {0.7, 0.5, 1}});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first, first});
  const HullQueries queries = QueriesOf(mesh);
  EXPECT_DOUBLE_EQ(queries.WindingNumber({0.5, 0.5, 0.5}), before);
  EXPECT_LT(queries.Closest({0.6, 0.5, 1.2}).triangle, 12);
}

TEST(HullQueries, ManyTrianglesAtOnePlaceEndInAnAnswer) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles.assign(5000, {0, 1, 2});
  EXPECT_NEAR(QueriesOf(mesh).Closest({0.2, 0.2, 1}).distance, 1, 1e-12);
}

TEST(HullQueries, AnEmptySurfaceHasNoClosestPointAndNoInside) {
  const HullQueries queries({}, {});
  EXPECT_EQ(queries.Closest({0, 0, 0}).triangle, -1);
  EXPECT_EQ(queries.WindingNumber({0, 0, 0}), 0);
}

}  // namespace
}  // namespace amhex
