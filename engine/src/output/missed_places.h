// Where a mesh leaves out some of the input: walls too thin for any cell, tips, small pieces.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"
#include "base/stop_poll.h"
#include "input/hull.h"

namespace amhex {

class DeviceUse;

// A connected part of the input's surface farther than an edge length from the mesh. User's units.
struct MissedPlace {
  Vec3d farthest;           // the input's point that is farthest from the mesh
  double distance = 0;      // from there to the mesh
  Box3d box;                // of the whole part
  bool is_covered = false;  // the farthest point is inside the mesh, not left out by it
};

// All of them, the farthest first; empty where the mesh follows its input. Surface samples as for
// the statistics' distances, measured on `device` unless it is null. O(n log n). Throws RunStopped
// when `poll` does, StatusError when the device fails.
std::vector<MissedPlace> FindMissedPlaces(const AtMostHexaMesh& mesh, const Hull& hull,
                                          const StopPoll& poll = {}, DeviceUse* device = nullptr);

// One line that names the first few with their places, those that are left out and then those that
// are covered; empty for none.
std::string DescribeMissedPlaces(const std::vector<MissedPlace>& places);

}  // namespace amhex
