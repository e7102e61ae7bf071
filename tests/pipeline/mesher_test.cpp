// The whole engine on small solids: what holds for every mesh, whatever the stages do inside.
#include "amhex/mesher.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <ostream>
#include <string>
#include <vector>

#include "base/platform.h"
#include "fixtures/solids.h"
#include "fixtures/volumes.h"
#include "support/mesh_invariants.h"
#include "support/surface_measures.h"

namespace amhex {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing_support::BrokenLaws;
using testing_support::EnclosedVolume;
using testing_support::MeasureBoundary;
using testing_support::TotalVolume;

constexpr double kPi = std::numbers::pi;

MeshingParams ParamsFor(int64_t cell_count) {
  MeshingParams params;
  params.sizing.cell_count = cell_count;
  params.run.backend = Backend::kCpu;
  return params;
}

absl::StatusOr<MeshingResult> MeshAlone(const InputHull& hull, const MeshingParams& params) {
  RunContext run;
  return Mesh(hull, params, run);
}

struct SolidCase {
  std::string name;
  TriangleMesh mesh;
  int64_t genus = 0;
  double least_hexahedra_ratio = 0;
};

void PrintTo(const SolidCase& solid, std::ostream* out) { *out << solid.name; }

// The ratios are floors with room below what is reached; they catch a stage that stops working.
std::vector<SolidCase> Solids() {
  return {
      {"box", fixtures::MakeBox({2, 1, 1}, 0.1), 0, 0.95},
      {"twisted box", fixtures::MakeTwistedBox({1, 1, 2}, kPi / 4, 0.1), 0, 0.8},
      {"cylinder", fixtures::MakeCylinder(0.5, 1.5, 0.1), 0, 0.6},
      {"sphere", fixtures::MakeSphere(1, 0.15), 0, 0.3},
      {"torus", fixtures::MakeTorus(1, 0.4, 0.12), 1, 0.15},
      {"bracket", fixtures::MakeBracket(1, 0.15), 1, 0.5},
      {"tetrahedron", fixtures::MakeTetrahedron(1), 0, 0.8},
  };
}

class MesherOnSolids : public ::testing::TestWithParam<SolidCase> {};

TEST_P(MesherOnSolids, GivesAValidMeshOfTheSameShape) {
  const SolidCase& solid = GetParam();
  const absl::StatusOr<MeshingResult> result = MeshAlone(solid.mesh, ParamsFor(800));
  ASSERT_TRUE(result.ok()) << result.status();

  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  const double volume = EnclosedVolume(solid.mesh);
  // Cells of a torus are chords of a tube five cells around: some volume is lost.
  EXPECT_NEAR(TotalVolume(result->mesh), volume, 0.08 * volume);
  EXPECT_EQ(MeasureBoundary(result->mesh).component_count, 1);
  EXPECT_EQ(MeasureBoundary(result->mesh).euler_number, 2 - 2 * solid.genus);
  EXPECT_GE(result->statistics.hexahedra_ratio, solid.least_hexahedra_ratio);
  EXPECT_FALSE(result->statistics.distance_exceeds_cell);
}

TEST_P(MesherOnSolids, ReportsStatisticsThatCountingAnewConfirms) {
  const absl::StatusOr<MeshingResult> result = MeshAlone(GetParam().mesh, ParamsFor(400));
  ASSERT_TRUE(result.ok()) << result.status();
  const AtMostHexaMesh& mesh = result->mesh;
  const MeshStatistics& statistics = result->statistics;

  double least = 1, sum = 0;
  for (size_t cell = 0; cell < mesh.corners.size(); ++cell) {
    const double quality = testing_support::LeastScaledJacobian(mesh.corners[cell], mesh.vertices);
    EXPECT_NEAR(mesh.quality[cell], quality, 1e-5);
    least = std::min(least, quality);
    sum += quality;
  }
  const auto cell_count = static_cast<double>(mesh.corners.size());
  EXPECT_EQ(statistics.cell_count, static_cast<int64_t>(mesh.corners.size()));
  EXPECT_EQ(statistics.vertex_count, static_cast<int64_t>(mesh.vertices.size()));
  EXPECT_EQ(statistics.boundary_face_count, MeasureBoundary(mesh).face_count);
  EXPECT_NEAR(statistics.min_scaled_jacobian, least, 1e-5);
  EXPECT_NEAR(statistics.average_scaled_jacobian, sum / cell_count, 1e-5);
  EXPECT_NEAR(statistics.volume, TotalVolume(mesh), 1e-6 * statistics.volume);
  EXPECT_EQ(statistics.genus, GetParam().genus);
}

INSTANTIATE_TEST_SUITE_P(Mesher, MesherOnSolids, ::testing::ValuesIn(Solids()),
                         [](const auto& test) {
                           std::string name = test.param.name;
                           std::replace(name.begin(), name.end(), ' ', '_');
                           return name;
                         });

TEST(Mesher, AxisAlignedBoxGivesOnlyHexahedra) {
  const absl::StatusOr<MeshingResult> result =
      MeshAlone(fixtures::MakeBox({2, 1, 1}, 0.25), ParamsFor(432));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->statistics.hexahedra_ratio, 1.0);
  EXPECT_GT(result->statistics.min_scaled_jacobian, 0.9);
}

TEST(Mesher, CellCountIsNearTheWantedOne) {
  for (const int64_t wanted : {300, 1000, 3000}) {
    const absl::StatusOr<MeshingResult> result =
        MeshAlone(fixtures::MakeTwistedBox({1, 1, 2}, kPi / 4, 0.1), ParamsFor(wanted));
    ASSERT_TRUE(result.ok()) << result.status();
    const auto count = static_cast<double>(result->statistics.cell_count);
    EXPECT_NEAR(count / static_cast<double>(wanted), 1.0, 0.35);
  }
}

TEST(Mesher, EdgeLengthIsInTheUsersUnits) {
  MeshingParams params = ParamsFor(0);
  params.sizing.edge_length = 0.2;
  const absl::StatusOr<MeshingResult> result =
      MeshAlone(fixtures::MakeBox({2, 1, 1}, 0.25), params);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_NEAR(static_cast<double>(result->statistics.cell_count), 250, 50);
  EXPECT_NEAR(result->statistics.edge_length, 0.2, 1e-12);
}

TEST(Mesher, BitsDoNotDependOnTheThreadCount) {
  const TriangleMesh bracket = fixtures::MakeBracket(1, 0.2);
  MeshingParams params = ParamsFor(600);
  params.run.thread_count = 1;
  const absl::StatusOr<MeshingResult> alone = MeshAlone(bracket, params);
  ASSERT_TRUE(alone.ok()) << alone.status();
  for (const int32_t threads : {2, 7}) {
    params.run.thread_count = threads;
    const absl::StatusOr<MeshingResult> together = MeshAlone(bracket, params);
    ASSERT_TRUE(together.ok()) << together.status();
    EXPECT_EQ(together->mesh.corners, alone->mesh.corners) << threads << " threads";
    EXPECT_EQ(together->mesh.vertices, alone->mesh.vertices) << threads << " threads";
    EXPECT_EQ(together->mesh.quality, alone->mesh.quality) << threads << " threads";
  }
}

TEST(Mesher, BitsDoNotDependOnTheVectorWidth) {
  const TriangleMesh bracket = fixtures::MakeBracket(1, 0.2);
  const absl::StatusOr<MeshingResult> widest = MeshAlone(bracket, ParamsFor(600));
  ASSERT_TRUE(widest.ok()) << widest.status();
  for (const VectorWidth limit : {VectorWidth::kBaseline, VectorWidth::k256}) {
    vector_width_limit = limit;
    const absl::StatusOr<MeshingResult> narrower = MeshAlone(bracket, ParamsFor(600));
    vector_width_limit = VectorWidth::k512;
    ASSERT_TRUE(narrower.ok()) << narrower.status();
    EXPECT_EQ(narrower->mesh.corners, widest->mesh.corners) << static_cast<int>(limit);
    EXPECT_EQ(narrower->mesh.vertices, widest->mesh.vertices) << static_cast<int>(limit);
    EXPECT_EQ(narrower->mesh.quality, widest->mesh.quality) << static_cast<int>(limit);
  }
}

TEST(Mesher, EffectiveParametersGiveTheSameMeshAgain) {
  const TriangleMesh solid = fixtures::MakeCylinder(0.5, 1, 0.1);
  const absl::StatusOr<MeshingResult> first = MeshAlone(solid, ParamsFor(500));
  ASSERT_TRUE(first.ok()) << first.status();
  const absl::StatusOr<MeshingResult> second = MeshAlone(solid, first->effective_params);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(first->mesh.corners, second->mesh.corners);
  EXPECT_EQ(first->mesh.vertices, second->mesh.vertices);
}

TEST(Mesher, PositionAndScaleOfTheInputDoNotMatter) {
  const TriangleMesh solid = fixtures::MakeCylinder(0.5, 1, 0.1);
  TriangleMesh far = solid;
  for (Vec3d& p : far.vertices) p = p * 1000.0 + Vec3d{5e5, -3e6, 1e4};
  const absl::StatusOr<MeshingResult> result = MeshAlone(far, ParamsFor(500));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  const double volume = EnclosedVolume(solid) * 1e9;
  EXPECT_NEAR(result->statistics.volume, volume, 0.05 * volume);
}

TEST(Mesher, CavityStaysEmpty) {
  const TriangleMesh outer = fixtures::MakeBox({3, 3, 3}, 0.25);
  const TriangleMesh inner = fixtures::Translated(fixtures::MakeBox({1, 1, 1}, 0.25), {1, 1, 1});
  const absl::StatusOr<MeshingResult> result =
      MeshAlone(fixtures::Joined(outer, fixtures::Flipped(inner)), ParamsFor(1500));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_NEAR(TotalVolume(result->mesh), 26, 1.3);
  EXPECT_EQ(MeasureBoundary(result->mesh).component_count, 2);
}

TEST(Mesher, SeparateSolidsStaySeparate) {
  const TriangleMesh box = fixtures::MakeBox({1, 1, 1}, 0.2);
  const absl::StatusOr<MeshingResult> result =
      MeshAlone(fixtures::Joined(box, fixtures::Translated(box, {2, 0, 0})), ParamsFor(600));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_EQ(MeasureBoundary(result->mesh).component_count, 2);
}

TEST(Mesher, OrientedPointCloudGivesAValidMesh) {
  const TriangleMesh solid = fixtures::MakeSphere(1, 0.08);
  const absl::StatusOr<MeshingResult> result =
      MeshAlone(fixtures::SampleCentres(solid), ParamsFor(600));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  EXPECT_NEAR(TotalVolume(result->mesh), 4 * kPi / 3, 0.1 * 4 * kPi / 3);
}

TEST(Mesher, TheGridsOfThePaperGiveValidMeshesToo) {
  for (const Initialization start : {Initialization::kGrid, Initialization::kJitteredGrid}) {
    MeshingParams params = ParamsFor(500);
    params.relaxation.initialization = start;
    params.relaxation.iteration_count = 20;
    const absl::StatusOr<MeshingResult> result =
        MeshAlone(fixtures::MakeCylinder(0.5, 1, 0.1), params);
    ASSERT_TRUE(result.ok()) << result.status();
    EXPECT_THAT(BrokenLaws(result->mesh), IsEmpty());
  }
}

TEST(Mesher, EveryStageReportsOnceInOrderAndProgressOnlyGrows) {
  RunContext run;
  std::vector<Stage> done;
  Stage last_stage = Stage::kCheckInput;
  double last_fraction = 0;
  run.on_stage_done = [&](const StageReport& report) { done.push_back(report.stage); };
  run.on_progress = [&](const Progress& progress) {
    EXPECT_GE(progress.stage, last_stage);
    if (progress.stage != last_stage) last_fraction = 0;
    EXPECT_GE(progress.stage_fraction, last_fraction) << StageName(progress.stage);
    EXPECT_LE(progress.stage_fraction, 1.0) << StageName(progress.stage);
    last_stage = progress.stage;
    last_fraction = progress.stage_fraction;
  };
  const absl::StatusOr<MeshingResult> result =
      Mesh(fixtures::MakeBracket(1, 0.2), ParamsFor(500), run);
  ASSERT_TRUE(result.ok()) << result.status();
  ASSERT_EQ(done.size(), static_cast<size_t>(kStageCount));
  for (int i = 0; i < kStageCount; ++i) {
    EXPECT_EQ(done[static_cast<size_t>(i)], static_cast<Stage>(i));
    EXPECT_EQ(result->stages[static_cast<size_t>(i)].stage, static_cast<Stage>(i));
  }
  EXPECT_EQ(last_stage, Stage::kValidate);
}

// What a watcher is told of the cells: nothing before there are any, and in the end what is true.
void ExpectCellsToldFromAssemblyOn(const InputHull& hull, const MeshingParams& params) {
  RunContext run;
  Progress last;
  run.on_progress = [&](const Progress& progress) {
    const auto& counts = progress.cells_by_type;
    EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), int64_t{0}), progress.cell_count)
        << StageName(progress.stage);
    if (progress.stage < Stage::kAssemble) EXPECT_EQ(progress.cell_count, 0);
    if (progress.stage > Stage::kAssemble) {
      EXPECT_GT(progress.cell_count, 0) << StageName(progress.stage);
      EXPECT_GE(progress.average_scaled_jacobian, progress.min_scaled_jacobian);
      EXPECT_NE(progress.average_scaled_jacobian, 0) << StageName(progress.stage);
    }
    last = progress;
  };
  const auto result = Mesh(hull, params, run);
  ASSERT_TRUE(result.ok()) << result.status();
  const MeshStatistics& statistics = result->statistics;
  EXPECT_EQ(last.cell_count, statistics.cell_count);
  EXPECT_EQ(last.cells_by_type, statistics.cells_by_type);
  // Both hold the least of a cell as a float.
  constexpr double kRounding = 1e-5;
  EXPECT_NEAR(last.min_scaled_jacobian, statistics.min_scaled_jacobian, kRounding);
  EXPECT_NEAR(last.average_scaled_jacobian, statistics.average_scaled_jacobian, kRounding);
}

TEST(Mesher, ProgressTellsCellsByTypeAndTheirQualityFromAssemblyOn) {
  ExpectCellsToldFromAssemblyOn(fixtures::MakeSphere(1, 0.15), ParamsFor(200));
}

TEST(Mesher, ProgressTellsTheCellsOfAVolumeMeshToo) {
  ExpectCellsToldFromAssemblyOn(fixtures::MakeTetrahedra(2), MeshingParams());
}

TEST(Mesher, StopRequestedInAnyStageEndsTheRunCancelled) {
  for (int i = 0; i + 1 < kStageCount; ++i) {
    RunContext run;
    const auto stop_after = static_cast<Stage>(i);
    run.on_stage_done = [&](const StageReport& report) {
      EXPECT_LE(report.stage, stop_after);
      if (report.stage == stop_after) run.RequestStop();
    };
    const absl::StatusOr<MeshingResult> result =
        Mesh(fixtures::MakeBox({2, 1, 1}, 0.25), ParamsFor(300), run);
    EXPECT_EQ(result.status().code(), absl::StatusCode::kCancelled) << StageName(stop_after);
  }
}

TEST(Mesher, DeadlineInThePastEndsTheRunAtOnce) {
  RunContext run;
  run.SetDeadline(RunContext::Clock::now() - std::chrono::seconds(1));
  const absl::StatusOr<MeshingResult> result =
      Mesh(fixtures::MakeBox({1, 1, 1}, 0.25), ParamsFor(300), run);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kDeadlineExceeded);
}

TEST(Mesher, InputWithoutVolumeIsRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  TriangleMesh with_nan = fixtures::MakeBox({1, 1, 1}, 0.5);
  with_nan.vertices[7].y = nan;
  TriangleMesh with_bad_index = fixtures::MakeBox({1, 1, 1}, 0.5);
  with_bad_index.triangles[5][1] = 10'000;
  TriangleMesh flat = fixtures::MakeBox({1, 1, 1}, 0.5);
  for (Vec3d& p : flat.vertices) p.z = 0;
  PointCloud line;
  for (int i = 0; i < 100; ++i) line.points.push_back({double(i), 0, 0});

  const std::vector<std::pair<std::string, InputHull>> cases = {{"empty mesh", TriangleMesh{}},
                                                                {"empty cloud", PointCloud{}},
                                                                {"NaN", with_nan},
                                                                {"bad index", with_bad_index},
                                                                {"flat", flat},
                                                                {"line", line}};
  for (const auto& [name, hull] : cases) {
    const absl::StatusOr<MeshingResult> result = MeshAlone(hull, ParamsFor(300));
    EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument)
        << name << ": " << result.status();
    EXPECT_FALSE(result.status().message().empty()) << name;
  }
}

TEST(Mesher, BadParameterIsNamed) {
  MeshingParams params = ParamsFor(300);
  params.sizing.edge_length = 0.1;
  params.assembly.min_quality = 7;
  const absl::StatusOr<MeshingResult> result = MeshAlone(fixtures::MakeBox({1, 1, 1}, 0.5), params);
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(result.status().message()), HasSubstr("min_quality"));
}

}  // namespace
}  // namespace amhex
