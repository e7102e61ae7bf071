// The last word on every mesh.
#pragma once

#include "absl/status/statusor.h"
#include "amhex/mesher.h"
#include "base/stop_poll.h"
#include "input/hull.h"
#include "output/boundary_overlap.h"

namespace amhex {

class DeviceUse;

// Mesh, statistics and warnings of a result; INTERNAL, naming the place, if the mesh breaks the
// law, which is checked by code that knows nothing of how the mesh was made; INVALID_ARGUMENT if
// the solid held no cell at all. The hull is asked on `device` unless that is null. Throws
// RunStopped when `poll` does, StatusError when the device fails.
absl::StatusOr<MeshingResult> Judge(AtMostHexaMesh mesh, const Hull& hull, const StopPoll& poll,
                                    DeviceUse* device);

// The same for a mesh of cells that were given. Where those cover a place twice themselves, so may
// the mesh; a warning tells how many of its samples do.
absl::StatusOr<MeshingResult> JudgeReassembled(AtMostHexaMesh mesh, const Hull& hull,
                                               const OverlapReport& given, const StopPoll& poll,
                                               DeviceUse* device = nullptr);

}  // namespace amhex
