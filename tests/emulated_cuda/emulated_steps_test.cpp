// What the steps before and after the relaxation take of a device, and how often.
#include <gtest/gtest.h>
#include <oneapi/tbb/task_arena.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "amhex/mesher.h"
#include "base/status_error.h"
#include "cuda/device_use.h"
#include "emulated_cuda/emulated_cuda_fixture.h"
#include "exec/cpu_executor.h"
#include "exec/uploaded_arrays.h"
#include "fixtures/solids.h"
#include "geometry/match_and_merge.h"
#include "input/ask_hull.h"
#include "input/sample_hull.h"
#include "optimize/project_to_hull.h"
#include "optimize/raise_quality.h"
#include "support/grid_complex.h"
#include "support/hull_of_mesh.h"
#include "topology/collect_faces.h"
#include "topology/search_primitives.h"
#include "unit/topology/cube_grid.h"

namespace amhex {
namespace {

class EmulatedSteps : public EmulatedDeviceTest {
 protected:
  // What `step` announces is what it takes, and it gives all back, however it ends.
  void ExpectEstimateAndReturns(const std::function<absl::Status()>& step) {
    controls().capacity = 1;
    const double estimate = Announced(step());
    EXPECT_EQ(controls().uploads, 0);
    device_->Restart();
    ASSERT_TRUE(step().ok());
    EXPECT_NEAR(estimate / static_cast<double>(controls().peak), 1.0, 0.1);
    EXPECT_EQ(controls().used, 0);
    const int64_t calls = controls().calls;
    for (int64_t call = 5; call < calls * 4 / 5; call += calls / 9) {  // the last ones only free
      device_->Restart();
      controls().failing_call = call;
      EXPECT_EQ(step().code(), absl::StatusCode::kInternal) << "call " << call;
      EXPECT_EQ(controls().used, 0);
    }
  }
};

TEST_F(EmulatedSteps, TakesAsMuchMemoryForHullQueriesAsEstimatedAndTheHullOnlyOnce) {
  std::optional<Hull> hull = testing_support::HullOfMesh(fixtures::MakeTorus(3, 1.2, 0.3));
  const std::vector<Vec3d> points = hull->vertices;
  const auto count = static_cast<int64_t>(points.size());
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  RunContext run;
  const auto ask = [&] {
    const HullAsker asker(*hull->queries, &*device, StopPoll(run));
    return asker.Ask(SideOf<PlainPoints>{{{points.data(), count}}}).status();
  };
  controls().capacity = 1;
  const double estimate = Announced(ask());
  EXPECT_EQ(controls().uploads, 0);
  device_->Restart();
  ASSERT_TRUE(ask().ok());
  EXPECT_NEAR(estimate / static_cast<double>(controls().peak), 1.0, 0.1);
  // The hull stays for whoever asks next.
  const int64_t resident = controls().used;
  EXPECT_GE(resident, UploadedArrays<CpuExecutor>::Bytes(hull->queries->view()));
  device_->Restart();
  ASSERT_TRUE(ask().ok());
  EXPECT_EQ(controls().uploads, 1);
  EXPECT_EQ(controls().uploaded_bytes, count * static_cast<int64_t>(sizeof(Vec3d)));
  EXPECT_EQ(controls().downloads, 1);
  EXPECT_EQ(controls().downloaded_bytes, count * static_cast<int64_t>(sizeof(HullSide)));
  EXPECT_EQ(controls().used, resident);
  run.RequestStop();
  EXPECT_EQ(ask().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(controls().used, resident);
  hull.reset();
  EXPECT_EQ(controls().used, 0);
  EXPECT_EQ(controls().stray_frees, 0);
}

TEST_F(EmulatedSteps, TakesAsMuchMemoryForTheHierarchyAsEstimatedAndGivesItBackWhenItFails) {
  const TriangleMesh sphere = fixtures::MakeSphere(2, 0.08);
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  RunContext run;
  const auto build = [&]() -> absl::Status {
    try {
      const HullQueries queries(sphere.vertices, sphere.triangles, StopPoll(run), &*device);
      return absl::OkStatus();
    } catch (const StatusError& error) {
      return error.status();
    }
  };
  ExpectEstimateAndReturns(build);
  device_->Restart();
  run.RequestStop();
  EXPECT_THROW(build().IgnoreError(), RunStopped);
  EXPECT_EQ(controls().used, 0);
  EXPECT_EQ(controls().stray_frees, 0);
}

// Who asks first finds the hull there, and nothing of it is uploaded but vertices and triangles.
TEST_F(EmulatedSteps, AHierarchyThatWasBuiltOnTheDeviceIsThereAlready) {
  const TriangleMesh sphere = fixtures::MakeSphere(2, 0.08);
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  const HullQueries queries(sphere.vertices, sphere.triangles, {}, &*device);
  EXPECT_EQ(controls().uploads, 1);
  const HullAsker asker(queries, &*device, {});
  const HullQueries on_host(sphere.vertices, sphere.triangles);
  const HullAsker host_asker(on_host, nullptr, {});
  const WindingAround<PlainPoints> question{PointsOf(sphere.vertices)};
  const auto there = asker.Ask(question), here = host_asker.Ask(question);
  ASSERT_TRUE(there.ok()) << there.status();
  EXPECT_EQ(*here, *there);
  EXPECT_EQ(controls().uploads, 2);
  EXPECT_TRUE(queries.view().is_closed);
}

// What only the device asks stays there; whoever asks on the host gets what the host would build.
TEST_F(EmulatedSteps, AHierarchyThatTheDeviceAsksIsFetchedWhenTheHostAsks) {
  const TriangleMesh sphere = fixtures::MakeSphere(2, 0.08);
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  const HullQueries there(sphere.vertices, sphere.triangles, {}, &*device, HullAskers::kDevice);
  const HullQueries here(sphere.vertices, sphere.triangles);
  const std::vector<Vec3d> few(sphere.vertices.begin(), sphere.vertices.begin() + 20);
  const WindingAround<PlainPoints> question{PointsOf(few)};
  const auto answers = HullAsker(there, &*device, {}).Ask(question);
  ASSERT_TRUE(answers.ok()) << answers.status();
  EXPECT_EQ(*answers, *HullAsker(here, nullptr, {}).Ask(question));
  EXPECT_FALSE(there.is_here());
  EXPECT_LT(controls().downloaded_bytes, UploadedArrays<CpuExecutor>::Bytes(here.view()) / 50);
  for (const Vec3d& p : few) {
    EXPECT_EQ(there.Closest(p * 0.9).point, here.Closest(p * 0.9).point);
  }
  EXPECT_TRUE(there.is_here());
  EXPECT_TRUE(there.view().is_closed);
  // Triangles and their normals are the host's own.
  const HullView all = here.view();
  const int64_t own =
      UploadedArrays<CpuExecutor>::Bytes(HullView{all.triangles, all.normals, {}, {}, {}, {}});
  EXPECT_LT(controls().downloaded_bytes, UploadedArrays<CpuExecutor>::Bytes(all) - own + 10'000);
}

// Two of one lane, by two threads that are not the one that built them.
TEST_F(EmulatedSteps, HierarchiesAreFetchedByWhateverThreadsAsk) {
  const TriangleMesh sphere = fixtures::MakeSphere(2, 0.08);
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  const HullQueries here(sphere.vertices, sphere.triangles);
  const HullQueries first(sphere.vertices, sphere.triangles, {}, &*device, HullAskers::kDevice);
  const HullQueries second(sphere.vertices, sphere.triangles, {}, &*device, HullAskers::kDevice);
  std::vector<std::thread> threads;
  for (const HullQueries* there : {&first, &second, &first, &second}) {
    threads.emplace_back([&, there] {
      EXPECT_EQ(there->Closest({1, 2, 3}).point, here.Closest({1, 2, 3}).point);
    });
  }
  for (std::thread& thread : threads) thread.join();
}

// Eight levels are split before the host looks.
TEST_F(EmulatedSteps, HierarchiesHardlyKeepTheHostWaiting) {
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  for (const double spacing : {0.16, 0.08, 0.04}) {
    device_->Restart();
    const TriangleMesh sphere = fixtures::MakeSphere(2, spacing);
    const HullQueries there(sphere.vertices, sphere.triangles, {}, &*device, HullAskers::kDevice);
    EXPECT_LE(controls().waits + controls().looks, 10) << sphere.triangles.size();
  }
}

// However often it is asked: the same cube of many more triangles costs little more than one copy
// of these in each form, as the hull and as patches.
TEST_F(EmulatedSteps, JobsUploadTheirHullOnce) {
  struct Uploads {
    int64_t hull_bytes;
    int64_t job_bytes;
  };
  const auto uploads_with = [&](double spacing) {
    device_->Restart();
    const TriangleMesh cube = fixtures::MakeBox({1, 1, 1}, spacing);
    MeshingParams params;
    params.sizing.cell_count = 216;
    params.sizing.trial_count = 1;
    params.run.backend = Backend::kCuda;
    RunContext run;
    const auto result = Mesh(cube, params, run);
    EXPECT_TRUE(result.ok()) << result.status();
    EXPECT_EQ(controls().used, 0);
    const Hull hull = testing_support::HullOfMesh(cube);
    return Uploads{UploadedArrays<CpuExecutor>::Bytes(hull.queries->view()),
                   controls().uploaded_bytes};
  };
  const Uploads coarse = uploads_with(0.25), fine = uploads_with(0.0625);
  EXPECT_LT(fine.job_bytes - coarse.job_bytes, 2.5 * (fine.hull_bytes - coarse.hull_bytes));
}

TEST_F(EmulatedSteps, StagesTellTheirTimeOnTheDevice) {
  const auto on_device = [&](Backend backend) {
    MeshingParams params;
    params.sizing.cell_count = 216;
    params.sizing.trial_count = 1;
    params.run.backend = backend;
    RunContext run;
    const auto result = Mesh(fixtures::MakeBox({1, 1, 1}, 0.0625), params, run);
    EXPECT_TRUE(result.ok()) << result.status();
    std::set<Stage> stages;
    for (const StageReport& report : run.stage_reports()) {
      EXPECT_LE(report.device_seconds, report.wall_seconds);
      if (report.device_seconds > 0) stages.insert(report.stage);
    }
    return stages;
  };
  EXPECT_EQ(
      on_device(Backend::kCuda),
      (std::set{Stage::kCheckInput, Stage::kSampleHull, Stage::kPopulate, Stage::kRelax,
                Stage::kMatchAndMerge, Stage::kClose, Stage::kPlaceVertices, Stage::kValidate}));
  EXPECT_TRUE(on_device(Backend::kCpu).empty());
}

// A shaken grid of cells in a box, and what placing its vertices needs.
struct ShakenBox {
  Hull hull = testing_support::HullOfMesh(fixtures::MakeBox({6, 5, 4}, 0.5));
  HullFeatures features{hull};
  CellComplex complex = testing_support::GridComplex({6, 5, 4});
  Placement placement;
  SweepMemory memory = StartSweeps(static_cast<int64_t>(complex.vertices.size()));

  explicit ShakenBox(DeviceUse* device) : placement(Prepare()) { placement.device = device; }
  Placement Prepare() {
    testing_support::Shake(complex, 0.3);
    return PreparePlacement(complex, features);
  }
  absl::Status Sweep(const RunContext& run) {
    return RunSweeps(placement, {QualityAim::kMinimum, 0.9, 0.5}, 2, memory, run);
  }
  absl::Status Project(const RunContext& run) {
    return ProjectToHull(placement, AllVertices(placement), 0.1, memory, run).status();
  }
};

TEST_F(EmulatedSteps, TakesAsMuchMemoryForPlacingAsEstimatedAndLeavesAllAsItWasWhenItFails) {
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  RunContext run;
  const std::vector<Vec3d> before = ShakenBox(nullptr).complex.vertices;
  for (const auto step : {&ShakenBox::Sweep, &ShakenBox::Project}) {
    double estimate = 0;
    {
      ShakenBox box(&*device);
      controls().capacity = 1;
      estimate = Announced((box.*step)(run));
      EXPECT_EQ(box.complex.vertices, before);
    }
    for (const int64_t call : {20, 60}) {
      device_->Restart();
      ShakenBox box(&*device);
      controls().failing_call = call;
      EXPECT_EQ((box.*step)(run).code(), absl::StatusCode::kInternal) << "call " << call;
      EXPECT_EQ(box.complex.vertices, before);
    }
    EXPECT_EQ(controls().used, 0);
    device_->Restart();
    {
      ShakenBox box(&*device);
      ASSERT_TRUE((box.*step)(run).ok());
      EXPECT_NEAR(estimate / static_cast<double>(controls().peak), 1.0, 0.1);
      EXPECT_NE(box.complex.vertices, before);
    }
    EXPECT_EQ(controls().used, 0);
    EXPECT_EQ(controls().stray_frees, 0);
  }
  {
    ShakenBox box(&*device);
    run.RequestStop();
    EXPECT_EQ(box.Sweep(run).code(), absl::StatusCode::kCancelled);
    EXPECT_EQ(box.Project(run).code(), absl::StatusCode::kCancelled);
  }
  EXPECT_EQ(controls().used, 0);
}

TEST_F(EmulatedSteps, StepsOfPlacingUploadOnlyWhatMayHaveChanged) {
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  const RunContext run;
  ShakenBox box(&*device);
  ASSERT_TRUE(box.Project(run).ok());
  const int64_t resident = controls().used;
  for (const auto step : {&ShakenBox::Sweep, &ShakenBox::Project, &ShakenBox::Sweep}) {
    device_->Restart();
    ASSERT_TRUE((box.*step)(run).ok());
    constexpr int64_t kPerVertex =
        sizeof(Vec3d) + sizeof(VertexConstraint) + sizeof(uint8_t) + sizeof(float);
    constexpr int64_t kPerCell = sizeof(float) + sizeof(uint8_t);
    constexpr int64_t kCounts = 512;  // at most so many bytes, and what lies between arrays
    const int64_t changed = kPerVertex * static_cast<int64_t>(box.complex.vertices.size()) +
                            kPerCell * static_cast<int64_t>(box.complex.cells.size());
    EXPECT_GE(controls().uploaded_bytes, changed);
    EXPECT_LE(controls().uploaded_bytes, changed + kCounts);
    EXPECT_EQ(controls().used, resident);
  }
}

// However many: where they end is decided on the device.
TEST_F(EmulatedSteps, SweepsAreReplayedAndWaitForNothing) {
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  const RunContext run;
  std::vector<int64_t> waits, replays;
  for (const int32_t sweeps : {6, 14}) {
    ShakenBox box(&*device);
    device_->Restart();
    ASSERT_TRUE(
        RunSweeps(box.placement, {QualityAim::kMinimum, 1.1, 0.5}, sweeps, box.memory, run).ok());
    waits.push_back(controls().waits);
    replays.push_back(controls().replays);
  }
  EXPECT_EQ(waits[0], waits[1]);
  EXPECT_EQ(replays[0], 2);
  EXPECT_GT(replays[1], 2);
}

// A sweep of few vertices takes a device as long as one of many.
TEST_F(EmulatedSteps, SweepsGoOnOnTheHostOnceTooFewVerticesMove) {
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  constexpr int kThreads = 2;
  const RunContext run;
  const auto swept = [&](DeviceUse* where, double share_worth_device) {
    ShakenBox box(where);
    device_->Restart();
    const auto colours = static_cast<double>(box.placement.neighbourhoods.colours.size());
    visits_worth_device =
        static_cast<int64_t>(share_worth_device * static_cast<double>(box.complex.vertices.size()) /
                             (colours * kThreads));
    oneapi::tbb::task_arena(kThreads).execute([&] {
      const SweepRules rules{QualityAim::kMinimum, 0.9, 0.5};
      EXPECT_TRUE(RunSweeps(box.placement, rules, 20, box.memory, run).ok());
    });
    visits_worth_device = 0;
    return std::make_tuple(box.complex.vertices, box.placement.survey.min_scaled_jacobian,
                           box.memory.active.flags(), box.memory.step);
  };
  const auto expected = swept(nullptr, 0);
  EXPECT_EQ(controls().launches, 0);
  EXPECT_TRUE(swept(&*device, 0) == expected);
  const int64_t all = controls().launches;
  EXPECT_TRUE(swept(&*device, 0.7) == expected);
  EXPECT_GT(controls().launches, 0);
  EXPECT_LT(controls().launches, all);
  EXPECT_TRUE(swept(&*device, 2) == expected);
  EXPECT_EQ(controls().launches, 0);
}

TEST_F(EmulatedSteps, TakesAsMuchMemoryForSamplingAsEstimatedAndGivesItBackWhenStopped) {
  const Hull hull = testing_support::HullOfMesh(fixtures::MakeTorus(6, 2.5, 0.2));
  RunContext run;
  const auto sample = [&] {
    Hull own = hull;  // whose copy ends with it
    own.queries = std::make_shared<const HullQueries>(hull.vertices, hull.triangles);
    return SampleHull(own, Backend::kCuda, run).status();
  };
  ExpectEstimateAndReturns(sample);
  device_->Restart();
  run.RequestStop();
  EXPECT_THROW(sample().IgnoreError(), RunStopped);
  EXPECT_EQ(controls().used, 0);
}

TEST_F(EmulatedSteps, TakesAsMuchMemoryForMatchingAsEstimatedAndGivesItBackWhenStopped) {
  Sites sites;
  for (int i = 0; i < 1000; ++i) {
    sites.position.push_back({double(i % 10), double(i / 10 % 10), double(i / 100)});
    sites.frame.push_back({});
    sites.size.push_back({1, 1, 1});
    sites.cell_volume.push_back(0);
  }
  const Cubes cubes = MaterializeCubes(sites);
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  RunContext run;
  const auto match = [&] {
    const Hull hull = testing_support::HullOfMesh(fixtures::MakeBox({10, 10, 10}, 2));
    return MergeCubes(cubes, {}, run, &*device, hull.queries.get()).status();
  };
  controls().capacity = 1;
  const double estimate = Announced(match());
  device_->Restart();
  ASSERT_TRUE(match().ok());
  // Lattices that are not as regular have more candidates, so that some room is left here.
  EXPECT_NEAR(estimate / static_cast<double>(controls().peak), 1.0, 0.25);
  EXPECT_EQ(controls().used, 0);
  run.RequestStop();
  EXPECT_EQ(match().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(controls().used, 0);
}

// A copy of what kernels find would keep the host until all of them are done.
TEST_F(EmulatedSteps, AsksWhetherToStopWhileKernelsAreUnderWay) {
  const MergedCubes grid = testing::MakeCubeGrid(2, 2, 2);
  const std::vector<VertexPair> edges = CollectCubeEdges(grid, {});
  std::set<int64_t> launches_seen;
  CollectFacesTask task{{{edges.data(), static_cast<int64_t>(edges.size())},
                         {grid.vertices.data(), static_cast<int64_t>(grid.vertices.size())}},
                        {},
                        [&] {
                          launches_seen.insert(controls().launches);
                          return false;
                        }};
  ASSERT_TRUE(RunOnCuda(&task).ok());
  // As many as the first download waits for.
  for (int64_t launches = 0; launches < 6; ++launches) {
    EXPECT_TRUE(launches_seen.contains(launches)) << launches;
  }
}

TEST_F(EmulatedSteps, TakesAsMuchMemoryForTheTopologyAsEstimatedAndGivesItBackWhenItEnds) {
  const MergedCubes grid = testing::MakeCubeGrid(9, 9, 9);
  const std::vector<VertexPair> edges = CollectCubeEdges(grid, {});
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  RunContext run;
  const auto faces = CollectFaces(grid.vertices, edges, run);
  ASSERT_TRUE(faces.ok());
  const auto complex = FaceComplex::Build(static_cast<int32_t>(grid.vertices.size()), *faces);
  const std::function<absl::Status()> steps[] = {
      [&] { return CollectFaces(grid.vertices, edges, run, &*device).status(); },
      [&] { return SearchPrimitives(complex, grid.vertices, 0, run, &*device).status(); }};
  for (const auto& step : steps) {
    device_->Restart();
    ExpectEstimateAndReturns(step);
  }
  device_->Restart();
  run.RequestStop();
  for (const auto& step : steps) EXPECT_EQ(step().code(), absl::StatusCode::kCancelled);
  EXPECT_EQ(controls().used, 0);
  EXPECT_EQ(controls().stray_frees, 0);
}

}  // namespace
}  // namespace amhex
