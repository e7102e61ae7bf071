#include "fields/field_sites.h"

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "fields/face_links.h"
#include "fields/phase_field.h"
#include "fields/site_clusters.h"
#include "fields/whole_lattice.h"
#include "fixtures/solids.h"
#include "input/sample_hull.h"
#include "support/hull_of_mesh.h"
#include "unit/fields/field_fixtures.h"

namespace amhex::fields {
namespace {

Sites SitesOf(const Hull& hull) {
  RunContext run;
  auto sites = PopulateFromFields(hull, HullSamples{}, {1, 1}, Backend::kCpu, run);
  EXPECT_TRUE(sites.ok()) << sites.status().message();
  return sites.ok() ? std::move(sites->front()) : Sites{};
}

// The cells (x, y, z) of the unit grid, in the box's own axes, that have exactly one site near
// their centre.
std::set<std::array<int, 3>> FilledCells(const Sites& sites, const AxisFrame& turn) {
  std::set<std::array<int, 3>> filled;
  for (const Vec3d& p : sites.position) {
    const Vec3d q{Dot(turn.axis[0], p), Dot(turn.axis[1], p), Dot(turn.axis[2], p)};
    const std::array<int, 3> cell{static_cast<int>(std::floor(q.x)),
                                  static_cast<int>(std::floor(q.y)),
                                  static_cast<int>(std::floor(q.z))};
    EXPECT_LT(Norm(q - Vec3d{cell[0] + 0.5, cell[1] + 0.5, cell[2] + 0.5}), 0.05);
    EXPECT_TRUE(filled.insert(cell).second) << "two sites in one cell";
  }
  return filled;
}

TEST(FieldSites, OfABoxOfWholeCellsAreItsGrid) {
  const Sites sites = SitesOf(HullOf(fixtures::MakeBox({3, 4, 5}, 1)));
  EXPECT_EQ(FilledCells(sites, AxisFrame{}).size(), 60U);
  for (const Vec3d& size : sites.size) {
    for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(size[axis], 1, 0.05);
  }
}

TEST(FieldSites, TurnWithTheBox) {
  const AxisFrame turn = ToFrame(SkewRotation());
  const Sites sites = SitesOf(HullOf(Turned(turn, fixtures::MakeBox({4, 5, 6}, 1))));
  EXPECT_EQ(FilledCells(sites, turn).size(), 120U);
  for (const AxisFrame& frame : sites.frame) {
    for (const Vec3d& axis : turn.axis) EXPECT_GT(FindNearestAxis(frame, axis).cosine, 0.999);
  }
}

TEST(FieldSites, LinkEveryPairOfNeighboursInABoxAcrossFacingFaces) {
  const Sites sites = SitesOf(HullOf(fixtures::MakeBox({3, 4, 5}, 1)));
  ASSERT_EQ(sites.count(), 60);
  EXPECT_EQ(sites.links.size(), 2U * 4 * 5 + 3 * 3 * 5 + 3 * 4 * 4);
  for (const FaceLink& link : sites.links) {
    EXPECT_LT(link.site_a, link.site_b);
    EXPECT_GE(link.votes, 2);
    const Vec3d way = sites.position[link.site_b] - sites.position[link.site_a];
    EXPECT_NEAR(Norm(way), 1, 0.1);
    const Vec3d& axis_a = sites.frame[link.site_a].axis[link.direction_a / 2];
    const Vec3d& axis_b = sites.frame[link.site_b].axis[link.direction_b / 2];
    EXPECT_GT(Dot(axis_a, way) * (link.direction_a % 2 != 0 ? 1 : -1), 0.9);
    EXPECT_LT(Dot(axis_b, way) * (link.direction_b % 2 != 0 ? 1 : -1), -0.9);
  }
}

TEST(FieldSites, LieInsideApartAndNearlyAsManyAsAskedFor) {
  for (const TriangleMesh& mesh :
       {fixtures::MakeCylinder(4, 8, 0.5), fixtures::MakeTorus(6, 3, 0.5),
        fixtures::MakeTwistedBox({6, 6, 6}, 1.0, 0.5), fixtures::MakeBracket(3, 0.5)}) {
    const Hull hull = HullOf(mesh);
    const Sites sites = SitesOf(hull);
    // Solids this small hold a whole number of layers, whatever density is asked for.
    EXPECT_NEAR(static_cast<double>(sites.count()) / hull.volume, 0.97, 0.2);
    for (int64_t i = 0; i < sites.count(); ++i) {
      EXPECT_TRUE(hull.queries->IsInside(sites.position[i]));
      const std::array<Vec3d, 3>& axis = sites.frame[i].axis;
      EXPECT_NEAR(Determinant(axis[0], axis[1], axis[2]), 1, 1e-9);
      for (int64_t j = 0; j < i; ++j) {
        EXPECT_GT(Norm(sites.position[i] - sites.position[j]), 0.3);
      }
    }
  }
}

TEST(FieldSites, AreTheSameBitsOnOneAndOnFourThreads) {
  const Hull hull = HullOf(fixtures::MakeCylinder(4, 6, 0.5));
  std::array<Sites, 2> results;
  for (int run = 0; run < 2; ++run) {
    const oneapi::tbb::global_control limit(oneapi::tbb::global_control::max_allowed_parallelism,
                                            run == 0 ? 1 : 4);
    results[run] = SitesOf(hull);
  }
  EXPECT_EQ(results[0].position, results[1].position);
  EXPECT_EQ(results[0].size, results[1].size);
  ASSERT_EQ(results[0].links.size(), results[1].links.size());
  for (size_t k = 0; k < results[0].links.size(); ++k) {
    EXPECT_EQ(results[0].links[k].site_a, results[1].links[k].site_a);
    EXPECT_EQ(results[0].links[k].site_b, results[1].links[k].site_b);
    EXPECT_EQ(results[0].links[k].votes, results[1].links[k].votes);
  }
}

TEST(FieldSites, OfSeveralTrialsDifferALittleInNumber) {
  const Hull hull = HullOf(fixtures::MakeSphere(4, 0.5));
  RunContext run;
  const auto trials =
      PopulateFromFields(hull, HullSamples{}, {kMaxTrials, kMaxTrials}, Backend::kCpu, run);
  ASSERT_TRUE(trials.ok()) << trials.status().message();
  ASSERT_EQ(trials->size(), static_cast<size_t>(kMaxTrials));
  std::set<int64_t> counts;
  for (const Sites& sites : *trials) {
    EXPECT_GT(static_cast<double>(sites.count()), 0.75 * hull.volume);
    EXPECT_LT(static_cast<double>(sites.count()), 1.2 * hull.volume);
    counts.insert(sites.count());
  }
  EXPECT_GT(counts.size(), 3U);
}

TEST(FieldSites, OfTheFirstTrialAreThoseOfASingleOne) {
  const Hull hull = HullOf(fixtures::MakeSphere(2, 0.5));
  RunContext run;
  const auto one = PopulateFromFields(hull, HullSamples{}, {1, 1}, Backend::kCpu, run);
  const auto many = PopulateFromFields(hull, HullSamples{}, {4, 4}, Backend::kCpu, run);
  ASSERT_TRUE(one.ok() && many.ok());
  ASSERT_EQ(one->front().count(), many->front().count());
  for (int64_t i = 0; i < one->front().count(); ++i) {
    EXPECT_EQ(one->front().position[i], many->front().position[i]);
  }
}

TEST(FieldSites, OfOneTrialAloneAreThoseItHasAmongOthers) {
  const Hull hull = HullOf(fixtures::MakeSphere(2, 0.5));
  RunContext run;
  const auto all = PopulateFromFields(hull, HullSamples{}, {5, 5}, Backend::kCpu, run);
  ASSERT_TRUE(all.ok());
  for (const int trial : {0, 1, 4}) {
    const auto alone = PopulateTrial(hull, HullSamples{}, trial, Backend::kCpu, run);
    ASSERT_TRUE(alone.ok());
    EXPECT_TRUE(alone->position == (*all)[trial].position) << trial;
    EXPECT_TRUE(alone->size == (*all)[trial].size) << trial;
  }
}

TEST(FieldSites, OfALatticeThatFitsNeedNoOtherTrial) {
  const Hull box = testing_support::HullOfMesh(fixtures::MakeBox({6, 4, 3}, 0.5));
  const Hull sphere = testing_support::HullOfMesh(fixtures::MakeSphere(2, 0.5));
  for (const Hull* hull : {&box, &sphere}) {
    RunContext run;
    const auto samples = SampleHull(*hull, Backend::kCpu, run);
    ASSERT_TRUE(samples.ok());
    const auto trials = PopulateFromFields(*hull, *samples, {3, 3}, Backend::kCpu, run);
    ASSERT_TRUE(trials.ok());
    EXPECT_EQ(trials->size(), hull == &box ? 1 : 3);
  }
}

TEST(FieldSites, OfALatticeThatIsNotTornNeedNoFewTrialsMore) {
  const Hull box = HullOf(fixtures::MakeBox({6, 4, 3}, 0.5));
  // Without samples nobody can tell that it reaches the hull.
  for (const int count : {2, kFewTrials, kFewTrials + 1}) {
    RunContext run;
    const auto trials = PopulateFromFields(box, HullSamples{}, {count, count}, Backend::kCpu, run);
    ASSERT_TRUE(trials.ok());
    EXPECT_EQ(trials->size(), count <= kFewTrials ? 1 : count);
  }
}

TEST(FieldSites, OfTheThirdOfFewTrialsAreMadeWhereBothOthersAreTorn) {
  std::set<size_t> counts;
  for (const TriangleMesh& mesh : {fixtures::MakeCylinder(8, 16, 0.5), fixtures::MakeSphere(4, 0.5),
                                   fixtures::MakeTorus(6, 3, 0.5), fixtures::MakeBracket(3, 0.5)}) {
    const Hull hull = HullOf(mesh);
    RunContext run;
    const auto two = PopulateFromFields(hull, HullSamples{}, {2, 2}, Backend::kCpu, run);
    const auto few = PopulateFromFields(hull, HullSamples{}, {2, kFewTrials}, Backend::kCpu, run);
    ASSERT_TRUE(two.ok() && few.ok());
    if (two->size() < 2) continue;
    const double least = std::min(ShareOfTornSites(two->front()), ShareOfTornSites(two->back()));
    EXPECT_EQ(few->size(), least > 0.028 ? 3 : 2) << least;
    counts.insert(few->size());
  }
  EXPECT_EQ(counts.size(), 2U) << "each is to be seen once at least";
}

TEST(FieldSites, OfTheSecondTrialOfALargeSolidAreMadeWhereTheFirstIsTorn) {
  std::set<size_t> counts;
  for (const TriangleMesh& mesh :
       {fixtures::MakeCylinder(8, 16, 0.5), fixtures::MakeTorus(5, 2.3, 0.5)}) {
    Hull large = HullOf(mesh);
    large.volume = 2 * kLargeSolid;  // all that is asked
    RunContext run;
    const auto trials = PopulateFromFields(large, HullSamples{}, {1, 2}, Backend::kCpu, run);
    ASSERT_TRUE(trials.ok());
    const double torn = ShareOfTornSites(trials->front());
    EXPECT_EQ(trials->size(), torn > 0.035 ? 2 : 1) << torn;
    counts.insert(trials->size());
  }
  EXPECT_EQ(counts.size(), 2U) << "each is to be seen once at least";
}

TEST(FieldSites, OfALargeSolidsFirstTrialHaveOtherFramesThanOfOthers) {
  const Hull small = HullOf(fixtures::MakeSphere(4, 0.5));
  Hull large = small;
  large.volume = 2 * kLargeSolid;  // all that is asked
  RunContext run;
  const auto usual = PopulateFromFields(small, HullSamples{}, {2, 2}, Backend::kCpu, run);
  const auto other = PopulateFromFields(large, HullSamples{}, {2, 2}, Backend::kCpu, run);
  ASSERT_TRUE(usual.ok() && other.ok());
  ASSERT_EQ(other->size(), 2U);
  EXPECT_TRUE(usual->front().position == other->back().position);
  EXPECT_FALSE(usual->front().position == other->front().position);
  EXPECT_FALSE(usual->back().position == other->front().position);
}

TEST(FieldSites, NeedNoMoreThanOneSiteInATinyBox) {
  EXPECT_EQ(SitesOf(HullOf(fixtures::MakeBox({1, 1, 1}, 1))).count(), 1);
}

TEST(FieldSites, ReportRisingProgressAndStopWhenAsked) {
  const Hull hull = HullOf(fixtures::MakeBox({3, 3, 3}, 1));
  RunContext run;
  double last = 0;
  run.on_progress = [&](const Progress& progress) {
    EXPECT_GE(progress.stage_fraction, last);
    EXPECT_LE(progress.stage_fraction, 1);
    last = progress.stage_fraction;
  };
  ASSERT_TRUE(PopulateFromFields(hull, HullSamples{}, {2, 2}, Backend::kCpu, run).ok());
  EXPECT_EQ(last, 1);

  RunContext stopped;
  stopped.on_progress = [&](const Progress& progress) {
    if (progress.stage_fraction > 0.3) stopped.RequestStop();
  };
  const auto sites = PopulateFromFields(hull, HullSamples{}, {2, 2}, Backend::kCpu, stopped);
  EXPECT_EQ(sites.status().code(), absl::StatusCode::kCancelled);
}

TEST(FieldDefects, AreAbsentFromABox) {
  SolvedFields fields(fixtures::MakeBox({3, 4, 5}, 1));
  ASSERT_TRUE(fields.ok);
  const auto positions =
      SolvePhaseField(fields.grid, fields.codes, fields.form, {}, ProgressSlice(fields.run, 0, 1));
  ASSERT_TRUE(positions.ok());
  const FieldDefects defects = CountDefects(fields.grid, fields.form, *positions, fields.run);
  EXPECT_EQ(defects.square_count, 5 * 7 * 10 + 6 * 7 * 9 + 5 * 8 * 9);
  EXPECT_EQ(defects.singular, 0);
  EXPECT_EQ(defects.dislocated, 0);
}

}  // namespace
}  // namespace amhex::fields
