// Graph matching and judgement: every good primitive among the faces. Section 5.2, II.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"
#include "topology/face_complex.h"
#include "topology/primitive_table.h"

namespace amhex {

class DeviceUse;

// Listing 1: all primitives among the faces whose quality exceeds `min_quality`, hexahedra first,
// turned the right way round; half_faces not filled in. On `device`, unless it is null, with the
// same primitives in the same order. Fails only with the run's status and with RunOnCuda's.
absl::StatusOr<std::vector<Primitive>> SearchPrimitives(const FaceComplex& complex,
                                                        const std::vector<Vec3d>& vertices,
                                                        double min_quality, RunContext& context,
                                                        DeviceUse* device = nullptr);

}  // namespace amhex
