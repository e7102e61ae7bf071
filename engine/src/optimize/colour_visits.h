// The visits of one colour's vertices, which do not see each other.
#pragma once

#include <cstdint>

#include "exec/executor.h"
#include "optimize/project_vertex.h"
#include "optimize/vertex_search.h"

namespace amhex {

// The vertices of one colour; every one has its own room in a common array.
struct ColourRoom {
  ArrayView<const int32_t> vertices;
  ArrayView<const int64_t> room_of;  // [index in the colour]
  ArrayView<LocalCell> room;
  AMHEX_HD LocalCell* At(int64_t i) const { return room.data + room_of[i]; }
};

// Vertex `i` of the colour with Cells as for MoveJudge.
struct VisitBody {
  SweepVisits sweep;
  ColourRoom colour;
  template <class Cells>
  AMHEX_HD void Visit(int64_t i) const {
    const int32_t v = colour.vertices[i];
    if (sweep.Wants(v)) sweep.Visit<Cells>(v, colour.At(i));
  }
};

struct ProjectBody {
  PlacementView placement;
  double quality_floor = 0;
  ColourRoom colour;
  ArrayView<uint8_t> moved;  // [vertex]
  template <class Cells>
  AMHEX_HD void Visit(int64_t i) const {
    const int32_t v = colour.vertices[i];
    if (!IsOnHull(placement, v)) return;
    moved[v] = ProjectVertex<Cells>(placement, v, quality_floor, colour.At(i)) ? 1 : 0;
  }
};

template <class Body>
struct VisitAloneBody {
  Body body;
  AMHEX_HD void operator()(int64_t i) const { body.template Visit<LocalCells>(i); }
};

// The CUDA executor has one of its own (colour_visits.cuh).
template <class E>
struct ColourVisits {
  // As ForEachOf.
  template <class Body>
  static void Run(E& executor, const char* description, int64_t count,
                  ArrayView<const int64_t> actual_count, const Body& body) {
    executor.ForEachOf(description, count, actual_count, VisitAloneBody<Body>{body});
  }
};

}  // namespace amhex
