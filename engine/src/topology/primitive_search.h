// Graph matching: finds every primitive among the faces. Section 5.2, II, listings 1 and 2.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "amhex/run_context.h"
#include "amhex/volume_mesh.h"
#include "topology/face_complex.h"

namespace amhex {

// A closed set of faces with the surface of one primitive.
struct FoundPrimitive {
  PrimitiveType type = PrimitiveType::kHexahedron;
  int face_count = 0;
  std::array<int32_t, 6> faces{};  // ascending ids of the face complex
  CellCorners corners{};           // of the primitive or of its mirror image
};

// The search from one starting face gives up beyond this many unfinished primitives; none of the
// networks of section 5.1 comes near it, it bounds time and memory on hostile ones.
inline constexpr int kMostOpenPrimitives = 1 << 14;

// Listing 1: appends every primitive of the type exactly once, by ascending starting face. Only
// topology is judged: the primitive may be flat, inverted or overlap others.
// Parallel over the faces; the result does not depend on the number of threads.
absl::Status FindPrimitives(const FaceComplex& complex, PrimitiveType type,
                            const RunContext& context, std::vector<FoundPrimitive>* found);

// The same primitive seen from the other side: corners of the mirror image.
CellCorners MirrorCorners(PrimitiveType type, const CellCorners& corners);

}  // namespace amhex
