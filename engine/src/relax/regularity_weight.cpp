#include "relax/regularity_weight.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace amhex {

double RegularityWeight(double progress) {
  // eq. 4
  return 0.5 - 0.5 * std::cos(4 * std::numbers::pi * (std::max(0.5, progress) - 0.5));
}

}  // namespace amhex
