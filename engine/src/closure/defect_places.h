// Where the defects of a boundary are near each other.
#pragma once

#include <cstdint>
#include <vector>

#include "closure/working_mesh.h"

namespace amhex {

// Groups of vertices that are within three edge lengths of each other, by way of others; each
// ascending. O(n) but for crowds.
std::vector<std::vector<int32_t>> PlacesOf(const std::vector<int32_t>& vertices,
                                           const WorkingMesh& mesh);

}  // namespace amhex
