// What the fields take of a device, and what they copy.
#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "amhex/mesher.h"
#include "cuda/device_use.h"
#include "emulated_cuda/emulated_cuda_fixture.h"
#include "fields/phase_field.h"
#include "fields/site_clusters.h"
#include "fixtures/solids.h"
#include "input/ask_hull.h"
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

  fields::SolvedFields solved_{fixtures::MakeSphere(2, 0.5)};
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
  size.device = lattice.device = phase.device = &*use_;
  const SolvedFields& s = solved_;
  const auto solved_positions = SolvePhaseField(s.grid, s.codes, s.form, phase, slice_);
  ASSERT_TRUE(solved_positions.ok());
  const std::vector<Vec3d>& positions = *solved_positions;
  const auto forget_cells = [&s] { s.grid.cells_there.reset(); };  // which stay with the grid
  forget_cells();
  const std::function<absl::Status()> solvers[] = {
      [&] { return SolveOrientationField(s.grid, {}, orientation, slice_).status(); },
      [&] { return SolveSizeField(s.grid, s.frames, s.codes, size, slice_).status(); },
      [&] {
        return SolveLatticeForm(s.grid, s.frames, s.sizes, s.codes, lattice, slice_).status();
      },
      [&] { return SolvePhaseField(s.grid, s.codes, s.form, phase, slice_).status(); },
      [&] {
        const HullQueries queries(s.hull.vertices, s.hull.triangles);  // whose copy ends with it
        const HullAsker asker(queries, &*use_, StopPoll(solved_.run));
        return ClusterSites(asker, s.grid, s.form, positions, slice_).status();
      }};
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
    forget_cells();
    EXPECT_EQ(controls().used, 0);
    // Solves end at their goal, long before the most iterations that they may take.
    EXPECT_LT(controls().replays, 200);
  }
  solved_.run.RequestStop();
  for (const auto& solve : solvers) {
    EXPECT_EQ(solve().code(), absl::StatusCode::kCancelled);
    forget_cells();
    EXPECT_EQ(controls().used, 0);
  }
}

// Right sides and diagonals are made where the solves are.
TEST_F(EmulatedFields, RoundsOfThePhaseFieldCopyNothingButHowFarTheyAre) {
  using namespace fields;  // NOLINT: all that follows is from there
  PhaseSettings phase;
  phase.device = &*use_;
  struct Copied {
    int64_t up, down;
  };
  const auto copied = [&](int rounds) {
    device_->Restart();
    phase.rounds = rounds;
    EXPECT_TRUE(SolvePhaseField(solved_.grid, solved_.codes, solved_.form, phase, slice_).ok());
    solved_.grid.cells_there.reset();
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
