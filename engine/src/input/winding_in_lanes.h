// Winding numbers of eight points at once, with the bits of single ones. On the host only.
#pragma once

#include <array>

#include "amhex/vec3.h"
#include "input/hull_view.h"

namespace amhex {

inline constexpr int kPointsAtOnce = 8;

// Of `count` points; it is worth the most where they are near each other.
std::array<double, kPointsAtOnce> WindingNumbers(const HullView& hull, const Vec3d* points,
                                                 int count);

}  // namespace amhex
