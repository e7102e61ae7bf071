// Matching and merging of cubes as plain arrays: what crosses the border to the CUDA library that
// is loaded at run time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "amhex/volume_mesh.h"
#include "exec/resident_slot.h"
#include "geometry/face_candidates.h"
#include "input/hull_view.h"

namespace amhex {

// Deviates from the paper's single pass over the queue: good matches first, and after each level
// the cuts it opened are closed, so that certain merges decide the doubtful ones.
inline constexpr std::array<double, 7> kMatchLevels = {0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.8};
// A cut may be this much wider than the level's matches, in mean cell sizes.
inline constexpr double kCutMargin = 0.25;
// First without, then with collapsing edges, at each level.
inline constexpr std::array<Collapse, 2> kMatchPasses = {Collapse::kForbidden,
                                                         Collapse::kEdgesOnly};

// Views are on host arrays that outlive the task.
struct MatchTask {
  CandidateSearch search;
  // Whose faces are to be labelled, and the slot of its copy; without one none are.
  HullView hull;
  ResidentSlot* resident = nullptr;
  // Out, as they were unless it was done: real vertices, numbered by their first virtual vertex,
  // and per cube its vertices and the faces that its own are glued to (FaceMatches).
  std::vector<Vec3d> vertices;
  std::vector<CellCorners> corners;
  std::vector<std::array<int32_t, 6>> matches;
  // Likewise, as in merged_cubes.h: which faces and vertices are on the hull.
  std::vector<uint8_t> hull_faces, on_hull;
  std::function<void()> on_level;     // called after each; may be empty
  std::function<bool()> should_stop;  // may be empty
};

}  // namespace amhex
