#include "output/finalize_mesh.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

#include "optimize/cell_pattern.h"
#include "topology/primitives.h"

namespace amhex {
namespace {

constexpr CellCorners kFigure2[7] = {
    {0, 1, 2, 3, 4, 5, 6, 7},  // hexahedron
    {0, 1, 1, 2, 3, 4, 5, 6},  // hexprism
    {0, 1, 1, 2, 3, 4, 4, 5},  // prism
    {0, 1, 1, 2, 3, 4, 4, 3},  // slice
    {0, 1, 1, 2, 0, 3, 3, 4},  // pyramid, form a
    {0, 1, 1, 2, 3, 1, 1, 4},  // pyramid, form b
    {0, 1, 1, 2, 0, 3, 3, 2},  // tetrahedron
};

using Turn = std::array<uint8_t, 8>;  // new slot -> old slot

// The 24 rotations of the cube as permutations of VTK_HEXAHEDRON's corner slots: composed from
// quarter turns about two axes.
std::vector<Turn> AllTurns() {
  constexpr Turn kAboutZ = {3, 0, 1, 2, 7, 4, 5, 6};
  constexpr Turn kAboutX = {3, 2, 6, 7, 0, 1, 5, 4};
  std::vector<Turn> turns = {{0, 1, 2, 3, 4, 5, 6, 7}};
  for (size_t i = 0; i < turns.size(); ++i) {
    for (const Turn& quarter : {kAboutZ, kAboutX}) {
      Turn next{};
      for (int slot = 0; slot < 8; ++slot) next[slot] = turns[i][quarter[slot]];
      if (std::find(turns.begin(), turns.end(), next) == turns.end()) turns.push_back(next);
    }
  }
  return turns;
}

// Corners renumbered by first appearance: equal for equal patterns of repetition.
CellCorners Repetition(const CellCorners& corners) {
  CellCorners pattern{};
  int32_t distinct = 0;
  for (int i = 0; i < 8; ++i) {
    int first = 0;
    while (corners[first] != corners[i]) ++first;
    pattern[i] = first == i ? distinct++ : pattern[first];
  }
  return pattern;
}

bool IsListedPattern(const CellCorners& corners) {
  const CellCorners pattern = Repetition(corners);
  return std::find(std::begin(kFigure2), std::end(kFigure2), pattern) != std::end(kFigure2);
}

// Calls body(c) for every cell, from several threads.
template <class Body>
void ForCells(size_t count, const StopPoll& poll, const Body& body) {
  constexpr size_t kCellsPerPoll = 1024;
  tbb::parallel_for(tbb::blocked_range<size_t>(0, count, kCellsPerPoll),
                    [&](const tbb::blocked_range<size_t>& range) {
                      poll.Now();
                      for (size_t c = range.begin(); c < range.end(); ++c) body(c);
                    });
}

struct SortableCell {
  PrimitiveType type;
  CellCorners sorted;
  CellCorners corners;
};

bool ComesBefore(const SortableCell& a, const SortableCell& b) {
  if (a.type != b.type) return a.type > b.type;
  if (a.sorted != b.sorted) return a.sorted < b.sorted;
  return a.corners < b.corners;
}

std::vector<SortableCell> SortedCells(const CellComplex& complex,
                                      const std::vector<int32_t>& new_id, const StopPoll& poll) {
  std::vector<SortableCell> cells(complex.cells.size());
  ForCells(cells.size(), poll, [&](size_t c) {
    const CellCorners& old = complex.cells[c];
    SortableCell& cell = cells[c];
    cell.type = RecognizeCell(old).value();
    for (int i = 0; i < 8; ++i) cell.corners[i] = new_id[old[i]];
    cell.corners = CanonicalCorners(cell.corners);
    cell.sorted = cell.corners;
    std::sort(cell.sorted.begin(), cell.sorted.end());
  });
  tbb::parallel_sort(cells.begin(), cells.end(), ComesBefore);
  poll.Now();
  return cells;
}

}  // namespace

CellCorners CanonicalCorners(const CellCorners& any_corners) {
  const CellCorners corners = AsListedInFigure2(any_corners);
  static const std::vector<Turn> kTurns = AllTurns();
  std::optional<CellCorners> best;
  for (const Turn& turn : kTurns) {
    CellCorners turned;
    for (int slot = 0; slot < 8; ++slot) turned[slot] = corners[turn[slot]];
    if ((!best.has_value() || turned < *best) && IsListedPattern(turned)) best = turned;
  }
  return best.value_or(corners);
}

AtMostHexaMesh FinalizeMesh(const CellComplex& complex, const Frame& frame, const StopPoll& poll) {
  std::vector<int32_t> new_id(complex.vertices.size(), -1);
  for (const CellCorners& corners : complex.cells) {
    for (const int32_t v : corners) new_id[v] = 0;
  }
  AtMostHexaMesh mesh;
  for (size_t v = 0; v < new_id.size(); ++v) {
    if (new_id[v] < 0) continue;
    new_id[v] = static_cast<int32_t>(mesh.vertices.size());
    mesh.vertices.push_back(frame.ToUser(complex.vertices[v]));
  }
  const std::vector<SortableCell> cells = SortedCells(complex, new_id, poll);
  mesh.corners.resize(cells.size());
  mesh.types.resize(cells.size());
  mesh.quality.resize(cells.size());
  ForCells(cells.size(), poll, [&](size_t c) {
    mesh.corners[c] = cells[c].corners;
    mesh.types[c] = cells[c].type;
    mesh.quality[c] = static_cast<float>(ScaledJacobian(cells[c].corners, mesh.vertices));
  });
  return mesh;
}

}  // namespace amhex
