#include "assembly/new_cells.h"

#include <algorithm>
#include <bit>

#include "topology/primitives.h"

namespace amhex {
namespace {

// FNV-1a, of 64 bits at a time.
constexpr uint64_t kDigestStart = 0xcbf29ce484222325u;
constexpr uint64_t kDigestFactor = 0x100000001b3u;

uint64_t DigestOf(const Vec3d& place) {
  uint64_t digest = kDigestStart;
  for (const double coordinate : {place.x, place.y, place.z}) {
    digest = (digest ^ std::bit_cast<uint64_t>(coordinate)) * kDigestFactor;
    digest ^= digest >> 32;  // the low bits of a product know nothing of the high ones
  }
  return digest;
}

// Of the places of its vertices, in whatever order. Where two cells had one digest, some
// vertices would not be looked at anew, no more.
uint64_t DigestOf(const CellCorners& corners, const std::vector<Vec3d>& vertices) {
  uint64_t digest = 0;
  for (const int32_t v : VerticesOf(corners)) digest += DigestOf(vertices[v]);
  return digest;
}

std::vector<uint64_t> SortedDigests(const CellComplex& complex, const StopPoll& poll) {
  std::vector<uint64_t> digests;
  digests.reserve(complex.cells.size());
  for (const CellCorners& corners : complex.cells) {
    poll.At(static_cast<int64_t>(digests.size()));
    digests.push_back(DigestOf(corners, complex.vertices));
  }
  std::sort(digests.begin(), digests.end());
  return digests;
}

}  // namespace

std::vector<uint8_t> VerticesOfNewCells(const CellComplex& complex, const CellComplex& before,
                                        const StopPoll& poll) {
  const std::vector<uint64_t> known = SortedDigests(before, poll);
  std::vector<uint8_t> is_new(complex.vertices.size(), 0);
  for (size_t c = 0; c < complex.cells.size(); ++c) {
    poll.At(static_cast<int64_t>(c));
    const CellCorners& corners = complex.cells[c];
    const uint64_t digest = DigestOf(corners, complex.vertices);
    if (std::binary_search(known.begin(), known.end(), digest)) continue;
    for (const int32_t v : corners) is_new[v] = 1;
  }
  return is_new;
}

}  // namespace amhex
