// The CUDA backend against the CPU's, to the bit; skipped where no device is usable.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <ostream>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "amhex/mesher.h"
#include "cuda/cuda_library.h"
#include "cuda/device_use.h"
#include "fields/background_grid.h"
#include "fields/field_sites.h"
#include "fields/orientation_field.h"
#include "fixtures/solids.h"
#include "geometry/match_and_merge.h"
#include "input/ask_hull.h"
#include "input/site_grid.h"
#include "optimize/hull_features.h"
#include "optimize/placement.h"
#include "optimize/project_to_hull.h"
#include "optimize/raise_quality.h"
#include "optimize/worth_device.h"
#include "output/measure_cells.h"
#include "relax/relaxation.h"
#include "support/grid_complex.h"
#include "unit/relax/relax_fixtures.h"

namespace amhex {
namespace {

struct ParityCase {
  const char* name;
  TriangleMesh solid;
  int32_t iteration_count;
  int32_t lattice_points_per_site;
};

void PrintTo(const ParityCase& c, std::ostream* out) { *out << c.name; }

class CudaParity : public testing::TestWithParam<ParityCase> {};

absl::StatusOr<Sites> RelaxWith(Backend backend, const ParityCase& c) {
  MeshingParams params;
  params.run.backend = backend;
  params.relaxation.initialization = Initialization::kJitteredGrid;
  params.relaxation.iteration_count = c.iteration_count;
  params.relaxation.lattice_points_per_site = c.lattice_points_per_site;
  // Splits happen early enough to be part of the comparison.
  params.relaxation.split_limit = 8;
  const Hull hull = testing_support::HullOfMesh(c.solid);
  const HullSamples samples = SamplesOf(hull);
  RunContext run;
  absl::StatusOr<Sites> sites = PopulateGrid(hull, samples, params, run);
  if (!sites.ok()) return sites.status();
  return RelaxSites(hull, samples, *std::move(sites), params, run);
}

TEST_P(CudaParity, GivesTheSameBitsAsTheCpu) {
  const absl::StatusOr<std::string> device = DescribeCuda();
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  const absl::StatusOr<Sites> cpu = RelaxWith(Backend::kCpu, GetParam());
  const absl::StatusOr<Sites> cuda = RelaxWith(Backend::kCuda, GetParam());
  ASSERT_TRUE(cpu.ok()) << cpu.status();
  ASSERT_TRUE(cuda.ok()) << cuda.status();
  ASSERT_EQ(cpu->count(), cuda->count());
  EXPECT_EQ(cpu->cell_volume, cuda->cell_volume);
  EXPECT_EQ(cpu->position, cuda->position);
  for (size_t i = 0; i < cpu->frame.size(); ++i) {
    EXPECT_EQ(cpu->frame[i].axis, cuda->frame[i].axis) << "site " << i;
  }
}

// Points of a grid around and inside the hull, some on its very axis planes.
std::vector<Vec3d> PointsAround(const Hull& hull) {
  constexpr double kStep = 0.3, kMargin = 1.2;
  std::vector<Vec3d> points;
  const Vec3d low = hull.box.low - Vec3d{kMargin, kMargin, kMargin};
  const Vec3d high = hull.box.high + Vec3d{kMargin, kMargin, kMargin};
  for (double z = low.z; z < high.z; z += kStep) {
    for (double y = low.y; y < high.y; y += kStep) {
      for (double x = low.x; x < high.x; x += kStep) points.push_back({x, y, z});
    }
  }
  return points;
}

template <class Answer>
bool IsSameAnswer(const Answer& a, const Answer& b) {
  return a == b;
}

TEST(CudaParityOfHullQueries, GivesTheSameSidesAndDistancesAsTheCpu) {
  absl::StatusOr<DeviceUse> device = DeviceUse::Choose(Backend::kCuda);
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeTwistedBox({3, 2, 4}, 1.0, 0.4));
  const std::vector<Vec3d> points = PointsAround(hull);
  const PlainPoints plain = PointsOf(points);
  std::vector<uint64_t> keys(4096);
  std::iota(keys.begin(), keys.end(), uint64_t{0});
  const fields::CellCentres cells =
      fields::CentresOf(keys, hull.box.low - Vec3d{0.3, 0.2, 0.1}, 0.25);
  RunContext run;
  const StopPoll poll(run);
  const HullAsker on_cpu(*hull.queries, nullptr, poll), on_cuda(*hull.queries, &*device, poll);
  const auto expect_equal = [&](const auto& question, const auto& number_of) {
    const auto cpu = on_cpu.Ask(question), cuda = on_cuda.Ask(question);
    ASSERT_TRUE(cpu.ok()) << cpu.status();
    ASSERT_TRUE(cuda.ok()) << cuda.status();
    ASSERT_EQ(cpu->size(), cuda->size());
    std::set<int> kinds;
    for (size_t i = 0; i < cpu->size(); ++i) {
      ASSERT_TRUE(IsSameAnswer((*cpu)[i], (*cuda)[i])) << "point " << i;
      kinds.insert(number_of((*cpu)[i]));
    }
    EXPECT_GT(kinds.size(), 1U);  // or nothing has been compared
  };
  const auto number = [](auto answer) { return static_cast<int>(answer); };
  expect_equal(SideOf<PlainPoints>{plain}, number);
  expect_equal(SideOf<fields::CellCentres>{cells, 0.4}, number);
  const auto tenth = [](double answer) { return static_cast<int>(10 * answer); };
  expect_equal(DistanceTo<PlainPoints>{plain}, tenth);
  expect_equal(WindingAround<PlainPoints>{plain}, tenth);
  expect_equal(ClosestTo<PlainPoints>{plain}, [&](const Vec3d& answer) { return tenth(answer.x); });
}

TEST(CudaParityOfFields, FindsTheSameNodesAtTheHullAsTheCpu) {
  absl::StatusOr<DeviceUse> device = DeviceUse::Choose(Backend::kCuda);
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeTwistedBox({3, 2, 4}, 1.0, 0.4));
  RunContext run;
  const fields::ProgressSlice slice(run, 0, 1);
  constexpr double kSpacing = 0.25;
  const auto cpu = fields::BuildBackgroundGrid(hull, kSpacing, slice);
  const auto cuda = fields::BuildBackgroundGrid(hull, kSpacing, slice, &*device);
  ASSERT_TRUE(cpu.ok()) << cpu.status();
  ASSERT_TRUE(cuda.ok()) << cuda.status();
  const fields::OwnedHullNodes &here = cpu->fine().at_hull, &there = cuda->fine().at_hull;
  EXPECT_EQ(here.nodes, there.nodes);
  EXPECT_EQ(here.first, there.first);
  EXPECT_TRUE(std::equal(here.constraints.begin(), here.constraints.end(),
                         there.constraints.begin(), there.constraints.end(),
                         [](const fields::HullConstraint& a, const fields::HullConstraint& b) {
                           return a.normal == b.normal && a.point == b.point;
                         }));
  // Some nodes are away from the hull, and others at its edges.
  EXPECT_GT(cpu->count(), static_cast<int64_t>(here.nodes.size()));
  EXPECT_GT(here.constraints.size(), here.nodes.size());
  EXPECT_TRUE(here.there == nullptr);
  EXPECT_TRUE(there.there != nullptr);
}

bool AreEqual(const std::vector<AxisFrame>& a, const std::vector<AxisFrame>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const AxisFrame& x, const AxisFrame& y) { return x.axis == y.axis; });
}

// All solvers of the field stages, one after the other.
TEST(CudaParityOfFields, GivesTheSameSitesAsTheCpu) {
  const absl::StatusOr<std::string> device = DescribeCuda();
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeTorus(2.4, 1.1, 0.5));
  RunContext run;
  MeshingParams params;
  params.run.backend = Backend::kCpu;
  const auto cpu = PopulateFromFields(hull, SamplesOf(hull), {2, 2}, params.run.backend, run);
  params.run.backend = Backend::kCuda;
  const auto cuda = PopulateFromFields(hull, SamplesOf(hull), {2, 2}, params.run.backend, run);
  ASSERT_TRUE(cpu.ok()) << cpu.status();
  ASSERT_TRUE(cuda.ok()) << cuda.status();
  ASSERT_EQ(cpu->size(), cuda->size());
  for (size_t trial = 0; trial < cpu->size(); ++trial) {
    const Sites &here = (*cpu)[trial], &there = (*cuda)[trial];
    ASSERT_GT(here.count(), 0);
    EXPECT_EQ(here.position, there.position);
    EXPECT_EQ(here.size, there.size);
    EXPECT_TRUE(AreEqual(here.frame, there.frame));
    ASSERT_GT(here.links.size(), here.position.size());
    EXPECT_TRUE(std::equal(here.links.begin(), here.links.end(), there.links.begin(),
                           there.links.end(), [](const FaceLink& a, const FaceLink& b) {
                             const auto numbers = [](const FaceLink& l) {
                               return std::tuple(l.site_a, l.site_b, l.direction_a, l.direction_b,
                                                 l.votes);
                             };
                             return numbers(a) == numbers(b);
                           }));
  }
}

TEST(CudaParityOfFields, GivesTheSameFramesAsTheCpuAfterAnOddNumberOfSweeps) {
  absl::StatusOr<DeviceUse> device = DeviceUse::Choose(Backend::kCuda);
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeTorus(3, 1.2, 0.5));
  RunContext run;
  const fields::ProgressSlice slice(run, 0, 1);
  const auto grid = fields::BuildBackgroundGrid(hull, 1.0 / fields::kNodesPerEdge, slice);
  ASSERT_TRUE(grid.ok()) << grid.status();
  fields::OrientationSettings settings;
  settings.fine_sweeps = 5;
  settings.coarse_sweeps = 21;
  const auto cpu = fields::SolveOrientationField(*grid, SamplesOf(hull), settings, slice);
  settings.device = &*device;
  const auto cuda = fields::SolveOrientationField(*grid, SamplesOf(hull), settings, slice);
  ASSERT_TRUE(cpu.ok()) << cpu.status();
  ASSERT_TRUE(cuda.ok()) << cuda.status();
  ASSERT_EQ(cpu->frames.size(), cuda->frames.size());
  for (size_t i = 0; i < cpu->frames.size(); ++i) {
    const Quaternion &a = cpu->frames[i], &b = cuda->frames[i];
    ASSERT_TRUE(a.w == b.w && a.x == b.x && a.y == b.y && a.z == b.z) << "node " << i;
  }
  EXPECT_EQ(cpu->codes, cuda->codes);
  EXPECT_GT(std::set(cpu->codes.begin(), cpu->codes.end()).size(), 3U);
}

// A shaken lattice of turned cubes of all sizes, many of them linked as they lie.
Sites ShakenSites(int side) {
  std::minstd_rand random(7);
  const auto uniform = [&] { return double(random()) / double(std::minstd_rand::max()); };
  Sites sites;
  for (int i = 0; i < side * side * side; ++i) {
    const Vec3d place{double(i % side), double(i / side % side), double(i / side / side)};
    sites.position.push_back(place + Vec3d{uniform(), uniform(), uniform()} * 0.6);
    const double angle = uniform();
    const double c = std::cos(angle), s = std::sin(angle);
    AxisFrame frame;
    frame.axis = {Vec3d{c, s, 0}, Vec3d{-s, c, 0}, Vec3d{0, 0, 1}};
    sites.frame.push_back(frame);
    sites.size.push_back({0.8 + 0.4 * uniform(), 0.8 + 0.4 * uniform(), 1});
    sites.cell_volume.push_back(0);
    if (i % side > 0) sites.links.push_back({i - 1, i, 1, 0, i % 5});
  }
  return sites;
}

TEST(CudaParityOfMatching, MergesTheSameFacesAsTheCpu) {
  absl::StatusOr<DeviceUse> device = DeviceUse::Choose(Backend::kCuda);
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  for (const int side : {1, 2, 9}) {
    const Sites sites = ShakenSites(side);
    const Cubes cubes = MaterializeCubes(sites);
    RunContext run;
    const auto here = MergeCubes(cubes, sites.links, run);
    const auto there = MergeCubes(cubes, sites.links, run, &*device);
    ASSERT_TRUE(here.ok()) << here.status();
    ASSERT_TRUE(there.ok()) << there.status();
    if (side > 1) {
      EXPECT_LT(here->vertices.size(), 6 * sites.position.size());
    }
    EXPECT_EQ(here->vertices, there->vertices);
    EXPECT_EQ(here->corners, there->corners);
    EXPECT_EQ(here->matches, there->matches);
  }
}

// Cubes that fill a box, some of them turned away from its sides.
TEST(CudaParityOfMatching, LabelsTheSameHullFacesAsTheCpu) {
  absl::StatusOr<DeviceUse> device = DeviceUse::Choose(Backend::kCuda);
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  constexpr int kSide = 9;
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeBox({kSide, kSide, kSide}, 0.5));
  Sites sites = ShakenSites(kSide);
  for (Vec3d& p : sites.position) p += hull.box.low + Vec3d{0.3, 0.3, 0.3};
  const Cubes cubes = MaterializeCubes(sites);
  const auto labelled = [&](DeviceUse* where) {
    RunContext run;
    const auto merged = MergeCubes(cubes, sites.links, run, where, hull.queries.get());
    EXPECT_TRUE(merged.ok()) << merged.status();
    return std::make_tuple(merged->hull_faces, merged->on_hull, merged->vertices);
  };
  const auto here = labelled(nullptr);
  const auto& [faces, on_hull, vertices] = here;
  EXPECT_GT(std::set<uint8_t>(faces.begin(), faces.end()).size(), 3U);
  EXPECT_EQ(on_hull.size(), vertices.size());
  EXPECT_GT(std::count(on_hull.begin(), on_hull.end(), 1), 6 * kSide);
  EXPECT_TRUE(here == labelled(&*device));
}

// The same cubes, with a gap between the boxes that they fill.
TEST(CudaParityOfMatching, LeavesTheSameFacesApartAsTheCpu) {
  absl::StatusOr<DeviceUse> device = DeviceUse::Choose(Backend::kCuda);
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  constexpr int kSide = 9;
  const TriangleMesh half = fixtures::MakeBox({4.4, kSide, kSide}, 0.5);
  const Hull hull =
      testing_support::HullOfMesh(fixtures::Joined(half, fixtures::Translated(half, {4.7, 0, 0})));
  Sites sites = ShakenSites(kSide);
  for (Vec3d& p : sites.position) p += Vec3d{0.3, 0.3, 0.3};
  const Cubes cubes = MaterializeCubes(sites);
  const auto matched = [&](const HullQueries* queries, DeviceUse* where) {
    RunContext run;
    const auto merged = MergeCubes(cubes, sites.links, run, where, queries);
    EXPECT_TRUE(merged.ok()) << merged.status();
    return std::make_pair(merged->matches, merged->vertices);
  };
  const auto here = matched(hull.queries.get(), nullptr);
  EXPECT_NE(here.first, matched(nullptr, nullptr).first);
  EXPECT_TRUE(here == matched(hull.queries.get(), &*device));
}

TEST(CudaParityOfMatching, FindsNothingAmongNoCubes) {
  absl::StatusOr<DeviceUse> device = DeviceUse::Choose(Backend::kCuda);
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  RunContext run;
  const auto merged = MergeCubes(Cubes(), {}, run, &*device);
  ASSERT_TRUE(merged.ok()) << merged.status();
  EXPECT_TRUE(merged->vertices.empty());
}

// All sweeps are the device's, however few vertices there are.
class CudaParityOfPlacement : public testing::Test {
 protected:
  void SetUp() override { worth_ = visits_worth_device.exchange(0); }
  void TearDown() override { visits_worth_device = worth_; }

 private:
  int64_t worth_ = 0;
};

// Vertices of all kinds, inside and on faces, edges and corners of a box, raised towards the
// minimum and the average.
TEST_F(CudaParityOfPlacement, MovesTheSameVerticesToTheSamePlacesAsTheCpu) {
  absl::StatusOr<DeviceUse> device = DeviceUse::Choose(Backend::kCuda);
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeBox({5, 4, 3}, 0.5));
  const HullFeatures features(hull);
  const auto swept = [&](QualityAim aim, DeviceUse* where) {
    CellComplex complex = testing_support::GridComplex({5, 4, 3});
    testing_support::Shake(complex, 0.35);
    Placement placement = PreparePlacement(complex, features);
    placement.device = where;
    SweepMemory memory = StartSweeps(static_cast<int64_t>(complex.vertices.size()));
    const RunContext run;
    const absl::StatusOr<int64_t> projected =
        ProjectToHull(placement, AllVertices(placement), 0.1, memory, run);
    EXPECT_GT(projected.value_or(0), 0);
    SweepRules rules{aim, 1.1, 0.4};
    if (aim == QualityAim::kAverage) rules.penalty.kind = EnergyKind::kMinima;
    const std::vector<Vec3d> before = complex.vertices;
    EXPECT_TRUE(RunSweeps(placement, rules, 5, memory, run).ok());
    EXPECT_NE(complex.vertices, before);
    return std::make_tuple(projected.value_or(0), complex.vertices,
                           placement.survey.min_scaled_jacobian, placement.survey.near_folding,
                           memory.active.flags(), memory.step);
  };
  for (const QualityAim aim : {QualityAim::kMinimum, QualityAim::kAverage}) {
    EXPECT_TRUE(swept(aim, nullptr) == swept(aim, &*device));
  }
}

// With patches, creases and corners of their own, and cells of every kind.
TEST_F(CudaParityOfPlacement, GivesTheSameMeshAsTheCpu) {
  const absl::StatusOr<std::string> device = DescribeCuda();
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  MeshingParams params;
  params.sizing.cell_count = 120;
  params.sizing.trial_count = 1;
  const auto mesh_on = [&](Backend backend) {
    params.run.backend = backend;
    RunContext run;
    return Mesh(fixtures::MakeBracket(1, 0.25), params, run);
  };
  const auto cpu = mesh_on(Backend::kCpu), cuda = mesh_on(Backend::kCuda);
  ASSERT_TRUE(cpu.ok()) << cpu.status();
  ASSERT_TRUE(cuda.ok()) << cuda.status();
  EXPECT_EQ(cpu->mesh.corners, cuda->mesh.corners);
  EXPECT_EQ(cpu->mesh.vertices, cuda->mesh.vertices);
}

// Shaken so much that some fold, and some without two of their edges.
TEST(CudaParityOfMeasures, GivesTheSameVolumesAndJacobiansAsTheCpu) {
  absl::StatusOr<DeviceUse> device = DeviceUse::Choose(Backend::kCuda);
  if (!device.ok()) GTEST_SKIP() << std::string(device.status().message());
  CellComplex complex = testing_support::GridComplex({9, 9, 9});
  testing_support::Shake(complex, 0.8);
  for (size_t c = 0; c < complex.cells.size(); c += 5) {
    complex.cells[c][1] = complex.cells[c][2];
    complex.cells[c][5] = complex.cells[c][6];
  }
  const auto measured = [&](DeviceUse* where) {
    return MeasureCells(complex.cells, complex.vertices, {}, where);
  };
  const std::vector<CellMeasures> here = measured(nullptr), there = measured(&*device);
  ASSERT_EQ(here.size(), there.size());
  double least = 1, largest = -1;
  for (size_t c = 0; c < here.size(); ++c) {
    EXPECT_EQ(here[c].volume, there[c].volume);
    EXPECT_EQ(here[c].min_scaled_jacobian, there[c].min_scaled_jacobian);
    EXPECT_EQ(here[c].min_map_jacobian, there[c].min_map_jacobian);
    least = std::min(least, here[c].min_scaled_jacobian);
    largest = std::max(largest, here[c].min_scaled_jacobian);
  }
  EXPECT_LT(least, 0);
  EXPECT_GT(largest, 0.1);
}

INSTANTIATE_TEST_SUITE_P(
    Solids, CudaParity,
    testing::Values(ParityCase{"LabellingAlone", fixtures::MakeTorus(4, 1.5, 0.5), 0, 108},
                    ParityCase{"OneIteration", fixtures::MakeTorus(4, 1.5, 0.5), 1, 108},
                    ParityCase{"CoarseLattice", fixtures::MakeSphere(4, 0.5), 20, 8},
                    ParityCase{"PaperLattice", fixtures::MakeSphere(3, 0.5), 10, 1728},
                    ParityCase{"Twisted", fixtures::MakeTwistedBox({5, 5, 8}, 1.0, 0.6), 20, 108}),
    [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace amhex
