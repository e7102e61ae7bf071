// What is near some places.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "amhex/vec3.h"

namespace amhex {

// Of some places; without a radius, everywhere.
struct Surroundings {
  std::vector<Vec3d> places = {};
  double radius = std::numeric_limits<double>::infinity();

  bool IsEverywhere() const { return std::isinf(radius); }
  bool Contain(const Vec3d& p) const {
    const auto is_near = [&](const Vec3d& place) { return Norm(p - place) < radius; };
    return IsEverywhere() || std::any_of(places.begin(), places.end(), is_near);
  }
};

}  // namespace amhex
