// Places spread over a face of the boundary, at which it is held against the hull.
#pragma once

#include <array>

namespace amhex {

// Parts that an edge of the triangles of a face is divided into. Statistics have nine samples per
// unit of area (output/mesh_statistics); a face that spans a groove was .08 edge lengths farther
// from the hull there than in its middle, halfway to its corners and in the middles of its edges.
inline constexpr int kFaceDivisions = 6;

// Calls visit(weight, side) for places on a face of 3 or 4 corners, each once and without the
// corners: weight[j] is corner j's. `side` is the edge from corner j to the next one that the place
// is on, or -1. A quadrilateral is four triangles around its middle, as distances are measured.
template <class Visit>
void VisitFacePlaces(int count, const Visit& visit) {
  constexpr int n = kFaceDivisions;
  const auto add = [&](const std::array<int, 4>& parts, int middle, int side) {
    std::array<double, 4> weight{};
    for (int j = 0; j < count; ++j) weight[j] = (parts[j] + middle / 4.0) / n;
    visit(weight, side);
  };
  if (count == 3) {
    for (int a = 0; a < n; ++a) {
      for (int b = 0; a + b <= n; ++b) {
        const int c = n - a - b;
        if (b == n || c == n) continue;
        add({a, b, c, 0}, 0, c == 0 ? 0 : a == 0 ? 1 : b == 0 ? 2 : -1);
      }
    }
    return;
  }
  add({}, n, -1);
  for (int j = 0; j < 4; ++j) {
    // What the next triangle shares is its own.
    for (int a = 1; a < n; ++a) {
      for (int b = 0; a + b <= n; ++b) {
        std::array<int, 4> parts{};
        parts[j] = a, parts[(j + 1) % 4] = b;
        add(parts, n - a - b, a + b == n ? j : -1);
      }
    }
  }
}

}  // namespace amhex
