#include "topology/half_face.h"

#include "topology/cell_face.h"

namespace amhex {

CellFace CanonicalHalfFace(const CellFace& face) { return FromSmallest(face); }

CellFace OppositeHalfFace(const CellFace& face) { return BackwardsFromSmallest(face); }

CellFace StandingHalfFace(const CellFace& face) {
  const CellFace canonical = CanonicalHalfFace(face);
  return StandsForFace(canonical) ? canonical : OppositeHalfFace(canonical);
}

}  // namespace amhex
