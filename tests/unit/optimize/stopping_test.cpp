// What closing and placing prepare for a whole mesh ends when its run is to stop: tables by
// throwing, steps by their status.
#include <gtest/gtest.h>

#include "base/stop_poll.h"
#include "closure/boundary_defects.h"
#include "closure/close_complex.h"
#include "closure/improve_closure.h"
#include "closure/peel_stars.h"
#include "closure/rank_complexes.h"
#include "closure/working_mesh.h"
#include "optimize/hull_deviation.h"
#include "optimize/place_vertices.h"
#include "optimize/placement.h"
#include "optimize/project_to_hull.h"
#include "optimize/raise_quality.h"
#include "support/grid_complex.h"
#include "support/grid_hull.h"

namespace amhex {
namespace {

using testing_support::GridComplex;
using testing_support::GridHull;
using testing_support::GridSize;

constexpr GridSize kStoppingSize{3, 3, 3};

class Stopping : public testing::Test {
 protected:
  Stopping() { run_.RequestStop(); }

  RunContext run_;
  const StopPoll poll_{run_};
  const Hull hull_ = GridHull(kStoppingSize, 1.0);
  const HullFeatures features_{hull_};
  CellComplex complex_ = GridComplex(kStoppingSize);
};

TEST_F(Stopping, EndsTablesOfAWorkingMesh) {
  EXPECT_THROW(WorkingMesh(complex_, poll_), RunStopped);
  const WorkingMesh mesh(complex_);
  EXPECT_THROW(mesh.ToComplex(poll_), RunStopped);
  EXPECT_THROW(mesh.CellsAtVertices(poll_), RunStopped);
  EXPECT_THROW(FindBoundaryDefects(mesh, hull_, poll_), RunStopped);
}

TEST_F(Stopping, EndsTablesOfAPlacement) {
  EXPECT_THROW(FindNeighbourhoods(complex_, poll_), RunStopped);
  const VertexNeighbourhoods neighbourhoods = FindNeighbourhoods(complex_);
  EXPECT_THROW(AssignConstraints(complex_, neighbourhoods, features_, poll_), RunStopped);
  EXPECT_THROW(SummarizeQuality(complex_, poll_), RunStopped);
  Placement placement = PreparePlacement(complex_, features_);
  EXPECT_THROW(SurveyAllCells(placement, poll_), RunStopped);
  EXPECT_THROW(WeakenUnreached(placement, 0.1, poll_), RunStopped);
  EXPECT_THROW(LargestOffset(placement, AllVertices(placement), poll_), RunStopped);
}

TEST_F(Stopping, IsTheStatusOfSteps) {
  const MeshingParams params;
  EXPECT_EQ(PeelStars(complex_, StarFolds::kRefused, run_).status(), run_.CheckStop());
  EXPECT_EQ(JoinStars(complex_, hull_, run_).status(), run_.CheckStop());
  EXPECT_EQ(RepairCells(complex_, hull_, {}, run_).status(), run_.CheckStop());
  EXPECT_EQ(MendBoundary(complex_, hull_, 0, params, run_).status(), run_.CheckStop());
  EXPECT_EQ(CloseUnwatched(complex_, hull_, params, run_).status(), run_.CheckStop());
  EXPECT_EQ(RankComplexes({complex_, complex_}, hull_, run_).status(), run_.CheckStop());
  EXPECT_EQ(PlaceVertices(complex_, features_, run_, PlacementEffort::kValid, nullptr).status(),
            run_.CheckStop());
}

}  // namespace
}  // namespace amhex
