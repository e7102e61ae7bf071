// Turns a surface or cloud into Draco bytes, as precisely as the wanted cells ask for.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"

namespace amhex::client {

// The positions' error is at most this fraction of the edge length of the wanted cells.
inline constexpr double kPositionErrorPerCell = 1.0 / 200.0;

struct DracoEncoding {
  std::string bytes;
  int quantization_bits = 0;  // of the positions; 0 = not quantised
  bool is_double = false;     // positions kept as 64-bit numbers
  double max_error = 0;       // largest distance between a position and its decoded self
  std::string description;    // one sentence for the user
};

// Encodes `hull` so that no position moves by more than `tolerance` (the user's units; 0 = not at
// all). The cheapest sufficient form is taken:
//   1. positions quantised to the fewest bits that do, at most 30,
//   2. 32-bit floating point,
//   3. 64-bit floating point, where the model lies so far from the origin that 32 bits are too
//      coarse; nothing is ever shifted behind the user's back.
// Normals are quantised to 12 bits in form 1 and kept as 32-bit numbers in the others. Draco may
// reorder points and faces and drops vertices that no face uses.
// INVALID_ARGUMENT if the hull is empty or has a coordinate that is not finite.
absl::StatusOr<DracoEncoding> EncodeDraco(const InputHull& hull, double tolerance);

// Edge length that the cells of a mesh of `cell_count` cells would have, from the enclosed volume
// of a mesh, or for clouds and open surfaces from a lower bound that errs on the small side.
double EstimatedEdgeLength(const InputHull& hull, int64_t cell_count);

// Box of all vertices or points.
Box3d BoxOf(const InputHull& hull);

}  // namespace amhex::client
