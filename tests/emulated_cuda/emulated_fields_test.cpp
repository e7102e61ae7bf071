// What the fields take of a device, and what they copy.
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "amhex/mesher.h"
#include "cuda/cuda_library.h"
#include "cuda/device_use.h"
#include "emulated_cuda/emulated_cuda_fixture.h"
#include "exec/cpu_executor.h"
#include "exec/uploaded_arrays.h"
#include "fields/lattice_task.h"
#include "fields/node_links.h"
#include "fields/phase_field.h"
#include "fixtures/solids.h"
#include "input/hull_queries.h"
#include "unit/fields/field_fixtures.h"

namespace amhex {
namespace {

// A sphere's fields, solved on the host, and a device to solve them again.
class EmulatedFields : public EmulatedDeviceTest {
 protected:
  void SetUp() override {
    EmulatedDeviceTest::SetUp();
    if (IsSkipped() || HasFatalFailure()) return;
    ASSERT_TRUE(solved_.ok);
    auto device = DeviceUse::Choose(Backend::kCuda);
    ASSERT_TRUE(device.ok()) << device.status();
    use_.emplace(*std::move(device));
  }

  // The sites of the solved form, with copies that end with this but for the hull's and the cells'.
  absl::Status FindSites(const fields::PhaseSettings& settings) {
    using namespace fields;  // NOLINT: all that follows is from there
    const SolvedFields& s = solved_;
    const OwnedLinks links(s.grid.fine(), s.codes, s.run);
    const HullQueries queries(s.hull.vertices, s.hull.triangles);
    ResidentSlot links_there, frames_there, sizes_there, closed_there;
    LatticeTask task;
    task.nodes = s.grid.Cells();
    task.links = links.View(), task.links_there = &links_there;
    task.rotations = {kAxisRotations.data(), kRotationCount};
    task.expected = {
        {s.frames.data(), s.grid.count()}, {s.sizes.data(), s.grid.count()}, s.grid.spacing};
    task.form_there = {&frames_there, &sizes_there, &closed_there};
    task.at_hull = s.grid.fine().at_hull.View();
    task.closed = {&s.form.increments.data()->data()->x, kIncrements * s.grid.count()};
    task.course = CourseOf(settings, slice_);
    task.hull = queries.view(), task.resident = &queries.resident();
    task.should_stop = [&s] { return s.run.ShouldStop(); };
    const absl::StatusOr<bool> done = RunOnCuda(&task);
    if (!done.ok()) return done.status();
    if (!*done) return s.run.CheckStop();
    EXPECT_GT(task.sites.size(), 20U);
    return absl::OkStatus();
  }

  // What of the grid stays with it.
  void ForgetGrid() {
    solved_.grid.cells_there.reset();
    solved_.grid.fine().at_hull.there.reset();
  }

  fields::SolvedFields solved_{fixtures::MakeSphere(3, 0.5)};
  fields::ProgressSlice slice_{solved_.run, 0, 1};
  std::optional<DeviceUse> use_;
};

// Each solver of the fields, on a device that is too small and on one that is not.
TEST_F(EmulatedFields, TakesAsMuchMemoryForTheFieldsAsEstimatedAndGivesItBackWhenStopped) {
  using namespace fields;  // NOLINT: all that follows is from there
  OrientationSettings orientation;
  orientation.device = &*use_;
  orientation.coarse_sweeps = 4;
  SizeSettings size;
  LatticeSettings lattice;
  PhaseSettings phase;
  phase.rounds = 1;
  size.device = lattice.device = &*use_;
  const SolvedFields& s = solved_;
  const std::function<absl::Status()> solvers[] = {
      [&] { return SolveOrientationField(s.grid, {}, orientation, slice_).status(); },
      [&] { return SolveSizeField(s.grid, s.frames, s.codes, size, slice_).status(); },
      [&] {
        return SolveLatticeForm(s.grid, s.frames, s.sizes, s.codes, lattice, slice_).status();
      },
      [&] { return FindSites(phase); }};
  int step = 0;
  for (const auto& solve : solvers) {
    SCOPED_TRACE(++step);
    device_->Restart();
    controls().capacity = 1;
    const double estimate = Announced(solve());
    EXPECT_EQ(controls().peak, 0);
    device_->Restart();
    const absl::Status solution = solve();
    ASSERT_TRUE(solution.ok()) << solution;
    // What sums take is not in the estimate, and more than a tenth of so small a field's memory.
    constexpr double kSumBytes = 16384;
    const auto peak = static_cast<double>(controls().peak);
    EXPECT_NEAR(estimate, peak, 0.1 * peak + kSumBytes);
    ForgetGrid();
    EXPECT_EQ(controls().used, 0);
    // Solves end at their goal, long before the most iterations that they may take.
    EXPECT_LT(controls().replays, 200);
  }
  solved_.run.RequestStop();
  for (const auto& solve : solvers) {
    EXPECT_EQ(solve().code(), absl::StatusCode::kCancelled);
    ForgetGrid();
    EXPECT_EQ(controls().used, 0);
  }
}

// Nodes at the hull are found from the grid's cells, and stay there for the trials.
TEST_F(EmulatedFields, TheHullsDemandsAreUploadedOnlyWhereTheyWereFoundOnTheHost) {
  fields::PhaseSettings phase;
  phase.rounds = 1;
  ASSERT_TRUE(FindSites(phase).ok());
  const int64_t of_host = controls().uploaded_bytes;
  const fields::HullNodes demands = solved_.grid.fine().at_hull.View();
  const int64_t bytes = UploadedArrays<CpuExecutor>::Bytes(demands);
  ForgetGrid();
  device_->Restart();
  const StopPoll poll(solved_.run);
  const HullAsker asker(*solved_.hull.queries, &*use_, poll);
  ASSERT_TRUE(fields::FindHullConstraints(asker, &solved_.grid).ok());
  constexpr int64_t kGaps = 128;  // between small arrays that travel together
  EXPECT_NEAR(controls().downloaded_bytes, bytes, kGaps);
  device_->Restart();
  ASSERT_TRUE(FindSites(phase).ok());
  const int64_t of_cells = solved_.grid.count() * static_cast<int64_t>(sizeof(uint64_t));
  EXPECT_NEAR(controls().uploaded_bytes, of_host - bytes - of_cells, kGaps);
  ForgetGrid();
  solved_.hull.queries.reset();
  EXPECT_EQ(controls().used, 0);
}

// Right sides and diagonals are made where the solves are.
TEST_F(EmulatedFields, RoundsOfThePhaseFieldCopyNothingButHowFarTheyAre) {
  using namespace fields;  // NOLINT: all that follows is from there
  PhaseSettings phase;
  struct Copied {
    int64_t up, down;
  };
  const auto copied = [&](int rounds) {
    device_->Restart();
    phase.rounds = rounds;
    EXPECT_TRUE(FindSites(phase).ok());
    ForgetGrid();
    EXPECT_EQ(controls().used, 0);
    return Copied{controls().uploaded_bytes, controls().downloaded_bytes};
  };
  const Copied one = copied(1), three = copied(3);
  constexpr int64_t kCounters = 64;  // at most so many bytes of every solve and iteration
  EXPECT_LE(three.up - one.up, 2 * kCounters);
  EXPECT_LE(three.down - one.down, 2 * phase.round_iterations * 2 * kCounters);
}

}  // namespace
}  // namespace amhex
