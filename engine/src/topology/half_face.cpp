#include "topology/half_face.h"

#include "topology/cell_face.h"

namespace amhex {

CellFace CanonicalHalfFace(const CellFace& face) { return FromSmallest(face); }

CellFace OppositeHalfFace(const CellFace& face) { return BackwardsFromSmallest(face); }

}  // namespace amhex
