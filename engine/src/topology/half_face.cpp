#include "topology/half_face.h"

#include <algorithm>

namespace amhex {

CellFace CanonicalHalfFace(const CellFace& face) {
  CellFace canonical = face;
  const auto begin = canonical.v.begin();
  const auto end = begin + canonical.count;
  std::rotate(begin, std::min_element(begin, end), end);
  return canonical;
}

CellFace OppositeHalfFace(const CellFace& face) {
  CellFace reversed = face;
  std::reverse(reversed.v.begin(), reversed.v.begin() + reversed.count);
  return CanonicalHalfFace(reversed);
}

}  // namespace amhex
