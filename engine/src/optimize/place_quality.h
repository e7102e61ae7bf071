// What the cells of a part of a mesh lack, by which versions of it are compared.
#pragma once

#include <algorithm>

#include "assembly/cell_complex.h"
#include "optimize/cell_quality.h"

namespace amhex {

struct PlaceQuality {
  double minimum = 1;
  double lack = 0;  // squares of what cells lack to kWantedOfPlaces, summed up
  double volume = 0;
};

inline constexpr double kWantedOfPlaces = 0.32;
// A version is better if what its cells lack falls to this share.
inline constexpr double kWorthwhileShare = 0.8;

inline PlaceQuality QualityOfPlace(const CellComplex& complex) {
  PlaceQuality result;
  for (const CellCorners& cell : complex.cells) {
    const double quality = CellQuality(cell, complex.vertices);
    const double lack = std::max(0.0, kWantedOfPlaces - quality);
    result.minimum = std::min(result.minimum, quality);
    result.lack += lack * lack;
    result.volume += CellVolume(cell, complex.vertices);
  }
  return result;
}

inline bool IsBetter(const PlaceQuality& after, const PlaceQuality& before) {
  return after.minimum >= before.minimum && after.lack < kWorthwhileShare * before.lack;
}

}  // namespace amhex
