// The hull's hierarchy over triangles (hull_queries.h), built on the host.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "amhex/vec3.h"
#include "base/stop_poll.h"
#include "input/hull_tree_task.h"

namespace amhex {

// What the hierarchy will be asked.
enum class HullQuestions : uint8_t {
  kAll,
  kDistances,  // no winding numbers: nodes have no dipoles then
};

// Triangles without area are left out. O(n log n); the same input always gives the same arrays.
// Throws RunStopped when `poll` does.
HullArrays BuildHullTree(const std::vector<Vec3d>& vertices,
                         const std::vector<std::array<int32_t, 3>>& triangles,
                         HullQuestions questions, const StopPoll& poll);

// Sets triangles and normals, which follow from their numbers.
void TakeTriangles(const std::vector<Vec3d>& vertices,
                   const std::vector<std::array<int32_t, 3>>& triangles, HullArrays* arrays);

}  // namespace amhex
