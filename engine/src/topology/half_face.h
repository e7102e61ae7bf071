// Half-faces: a triangle or quad together with the side it is seen from.
//
// A conforming complex uses every half-face at most once, and an interior face is the pair of a
// half-face and its opposite. A half-face's canonical form starts at its smallest vertex id and
// keeps the direction; the form of its opposite is the same ring walked backwards.
#pragma once

#include <cstdint>

#include "topology/primitives.h"

namespace amhex {

// The same half-face, starting at its smallest vertex.
CellFace CanonicalHalfFace(const CellFace& face);

// The same ring seen from the other side, canonical.
CellFace OppositeHalfFace(const CellFace& face);

// True if the canonical half-face is the one that stands for the face as a whole: of the two
// directions, the one whose second vertex is smaller than its last.
inline bool StandsForFace(const CellFace& canonical) {
  return canonical.v[1] < canonical.v[canonical.count - 1];
}

// The direction that stands for the face of a half-face, canonical.
CellFace StandingHalfFace(const CellFace& face);

// Lexicographic by the four ids; a triangle (fourth id -1) comes before the quads it starts.
inline bool operator<(const CellFace& a, const CellFace& b) { return a.v < b.v; }
inline bool operator==(const CellFace& a, const CellFace& b) { return a.v == b.v; }

}  // namespace amhex
