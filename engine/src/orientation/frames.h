// Between frames as axes (sites, host) and frames as quaternions (bodies).
#pragma once

#include "amhex/vec3.h"
#include "base/quat.h"
#include "relax/sites.h"

namespace amhex {

// `frame` must be orthonormal and right-handed; w of the result is not negative.
Quatf QuatFromFrame(const AxisFrame& frame);

// Orthonormal to double precision for unit `q`.
AxisFrame FrameFromQuat(const Quatf& q);

// The frame (normal, tangent, bitangent) of a hull sample. `tangent` is made perpendicular; if it
// vanishes, the frame is the world's turned onto the normal.
Quatf SampleOrientation(const Vec3d& normal, const Vec3d& tangent);

}  // namespace amhex
