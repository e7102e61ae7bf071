// Measures of all cells of a mesh, where the run computes.
#pragma once

#include <vector>

#include "base/stop_poll.h"
#include "output/cell_law.h"

namespace amhex {

class DeviceUse;

// By cell, on `device` unless it is null; the same bits wherever. Corners are vertices'. Throws
// RunStopped when `poll` does, StatusError when the device fails.
std::vector<CellMeasures> MeasureCells(const std::vector<CellCorners>& corners,
                                       const std::vector<Vec3d>& vertices, const StopPoll& poll,
                                       DeviceUse* device);

}  // namespace amhex
