#include "optimize/vertex_neighbourhoods.h"

#include <numeric>

#include "base/loop_polling.h"

namespace amhex {
namespace {

constexpr size_t kCellsPerTask = 1024;

// `for_each_vertex(item, visit)` calls visit(vertex) for every distinct vertex of an item.
template <class ForEachVertex>
Incidence InvertIncidence(int64_t vertex_count, int64_t item_count, const StopPoll& poll,
                          const ForEachVertex& for_each_vertex) {
  Incidence incidence;
  incidence.begin.assign(static_cast<size_t>(vertex_count) + 1, 0);
  for (int64_t i = 0; i < item_count; ++i) {
    poll.At(i);
    for_each_vertex(i, [&](int32_t v) { ++incidence.begin[v + 1]; });
  }
  std::partial_sum(incidence.begin.begin(), incidence.begin.end(), incidence.begin.begin());
  incidence.item.resize(incidence.begin.back());
  std::vector<int64_t> cursor(incidence.begin.begin(), incidence.begin.end() - 1);
  for (int64_t i = 0; i < item_count; ++i) {
    poll.At(i);
    for_each_vertex(i, [&](int32_t v) { incidence.item[cursor[v]++] = static_cast<int32_t>(i); });
  }
  return incidence;
}

// Greedy colouring in index order: each vertex takes the first colour free among its cells'.
void ColourVertices(const CellComplex& complex, const StopPoll& poll,
                    VertexNeighbourhoods& neighbourhoods) {
  const size_t vertex_count = complex.vertices.size();
  const Incidence& cells = neighbourhoods.cells;
  std::vector<int32_t>& colour = neighbourhoods.colour_of;
  colour.assign(vertex_count, -1);
  std::vector<int32_t> taken_by;  // [colour] the last vertex that found it taken
  std::vector<std::vector<int32_t>>& colours = neighbourhoods.colours;
  for (size_t v = 0; v < vertex_count; ++v) {
    poll.At(static_cast<int64_t>(v));
    const auto row = cells[static_cast<int64_t>(v)];
    if (row.size() == 0) continue;
    for (const int32_t c : row) {
      for (const int32_t other : complex.cells[c]) {
        if (colour[other] >= 0) taken_by[colour[other]] = static_cast<int32_t>(v);
      }
    }
    size_t free = 0;
    while (free < colours.size() && taken_by[free] == static_cast<int32_t>(v)) ++free;
    if (free == colours.size()) {
      colours.emplace_back();
      taken_by.push_back(-1);
    }
    colour[v] = static_cast<int32_t>(free);
    colours[free].push_back(static_cast<int32_t>(v));
  }
}

}  // namespace

VertexNeighbourhoods FindNeighbourhoods(const CellComplex& complex, const StopPoll& poll) {
  VertexNeighbourhoods result;
  result.patterns.resize(complex.cells.size());
  ForAllPolling(complex.cells.size(), kCellsPerTask, poll, [&](size_t c) {
    const auto index = FindCellPattern(complex.cells[c]) - AllCellPatterns().data();
    result.patterns[c] = static_cast<int16_t>(index);
  });
  const int64_t vertex_count = static_cast<int64_t>(complex.vertices.size());
  result.cells = InvertIncidence(
      vertex_count, static_cast<int64_t>(complex.cells.size()), poll, [&](int64_t c, auto visit) {
        const CellPattern& pattern = AllCellPatterns()[result.patterns[c]];
        for (int i = 0; i < pattern.vertex_count; ++i) {
          visit(complex.cells[c][pattern.vertex_slot[i]]);
        }
      });
  result.hull_faces = InvertIncidence(vertex_count, static_cast<int64_t>(complex.hull_faces.size()),
                                      poll, [&](int64_t f, auto visit) {
                                        const CellFace& face = complex.hull_faces[f];
                                        for (int j = 0; j < face.count; ++j) visit(face.v[j]);
                                      });
  ColourVertices(complex, poll, result);
  return result;
}

}  // namespace amhex
