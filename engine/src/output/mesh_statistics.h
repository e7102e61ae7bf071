// The columns of the paper's Table 1 and the distances between mesh and input.
#pragma once

#include "amhex/volume_mesh.h"
#include "base/stop_poll.h"
#include "input/hull.h"

namespace amhex {

class DeviceUse;

// Measures a valid mesh in the user's units against the hull it was made for.
//
// Distances are between the mesh boundary and the hull, sampled about a third of an edge length
// apart on either side, the input's own points included on its side (a million of them at most).
// Linear in cells and samples, each sample a query of O(log n), on `device` unless it is null.
// Throws RunStopped when `poll` does, StatusError when the device fails.
MeshStatistics MeasureMesh(const AtMostHexaMesh& mesh, const Hull& hull, const StopPoll& poll = {},
                           DeviceUse* device = nullptr);

// What tells faults of a mesh's boundary.
struct BoundaryMeasures {
  int64_t component_count = 0;
  int64_t genus = 0;  // summed over components
  // The larger of the two distances between boundary and hull, edge lengths; where that is `enough`
  // or less, something not above it.
  double farthest = 0;
};
// The same as MeasureMesh, without the rest and sooner.
BoundaryMeasures MeasureBoundary(const AtMostHexaMesh& mesh, const Hull& hull, double enough,
                                 const StopPoll& poll = {}, DeviceUse* device = nullptr);

}  // namespace amhex
