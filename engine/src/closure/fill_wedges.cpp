#include "closure/fill_wedges.h"

#include <vector>

#include "closure/extend_to_ridge.h"
#include "closure/fill_notches.h"
#include "closure/ridges.h"

namespace amhex {

void FillWedges(const Hull& hull, WorkingMesh* mesh, const StopPoll& poll) {
  ExtendToTips(hull, AcuteTips(hull, poll), mesh, poll);
  const std::vector<SegmentQueries> ridges = AcuteRidges(hull);
  if (ridges.empty()) return;
  FillNotches(hull, mesh, poll);
  ExtendToRidges(hull, ridges, mesh, poll);
}

}  // namespace amhex
