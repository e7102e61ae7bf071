// Places spread over a face of the boundary, at which it is held against the hull.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace amhex {

// Parts that the edges of a face's triangles are divided into, by its longest edge. Statistics have
// nine samples per unit of area (output/mesh_statistics), and a hull with grooves is farthest from
// a face between few places: with four parts by .08 edge lengths, with six by .04 on long faces.
inline int FaceDivisions(double longest_edge) {
  constexpr double kPartsPerEdgeLength = 6;
  constexpr int kFewest = 4, kMost = 12;
  return std::clamp(static_cast<int>(std::ceil(kPartsPerEdgeLength * longest_edge)), kFewest,
                    kMost);
}

// Calls visit(weight, side) for places on a face of 3 or 4 corners, each once and without the
// corners: weight[j] is corner j's. `side` is the edge from corner j to the next one that the place
// is on, or -1. A quadrilateral is four triangles around its middle, as distances are measured.
template <class Visit>
void VisitFacePlaces(int count, int divisions, const Visit& visit) {
  const int n = divisions;
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
