// Graph matching: finds every primitive among the faces. Section 5.2, II, listings 1 and 2.
#pragma once

#include <vector>

#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "amhex/volume_mesh.h"
#include "topology/face_complex.h"
#include "topology/primitive_growth.h"

namespace amhex {

// Listing 1: appends every primitive of the type exactly once, by ascending starting face. Only
// topology is judged: the primitive may be flat, inverted or overlap others.
// Parallel over the faces; the result does not depend on the number of threads.
absl::Status FindPrimitives(const FaceComplex& complex, PrimitiveType type,
                            const RunContext& context, std::vector<FoundPrimitive>* found);

// The same primitive seen from the other side: corners of the mirror image.
CellCorners MirrorCorners(PrimitiveType type, const CellCorners& corners);

}  // namespace amhex
