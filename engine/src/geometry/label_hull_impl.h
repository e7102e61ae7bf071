// Which open faces of merged cubes lie on the hull, with arrays where bodies run. Paper:
// section 5.1
// ("labelled as part of the outer hull").
#pragma once

#include <cstdint>

#include "exec/executor.h"
#include "geometry/hull_face_question.h"
#include "input/hull_batch.h"

namespace amhex {

// What is told of the cubes and of their vertices (merged_cubes.h).
struct HullLabels {
  ArrayView<uint8_t> faces;    // [cube_count]
  ArrayView<uint8_t> on_hull;  // [vertex_count]
};

struct NotOnHullBody {
  ArrayView<uint8_t> on_hull;
  AMHEX_HD void operator()(int64_t v) const { on_hull[v] = 0; }
};

// One element per cube. Others may be writing the same of a vertex that they share.
struct MarkHullVerticesBody {
  ArrayView<const CellCorners> corners;
  HullLabels labels;
  AMHEX_HD void operator()(int64_t cube) const {
    for (int direction = 0; direction < kDirectionCount; ++direction) {
      if ((labels.faces[cube] >> direction & 1) == 0) continue;
      for (int q = 0; q < 4; ++q) Mark(corners[cube][CornerOfFace(direction, q)]);
    }
  }

 private:
  AMHEX_HD void Mark(int32_t vertex) const {
#if defined(__CUDA_ARCH__)
    labels.on_hull[vertex] = 1;
#else
    __atomic_store_n(&labels.on_hull[vertex], uint8_t{1}, __ATOMIC_RELAXED);
#endif
  }
};

struct ProjectHullVertexBody {
  HullView hull;
  ArrayView<const uint8_t> on_hull;
  ArrayView<Vec3d> vertices;
  AMHEX_HD void operator()(int64_t v) const {
    if (on_hull[v] != 0) vertices[v] = hull.Closest(vertices[v]).point;
  }
};

// Labels the faces and vertices of `open`, whose vertices are `vertices`, and projects those on the
// hull to it. Strict on purpose: an interior face pulled to the hull costs more cells than a hull
// face that is found later.
template <class E>
void LabelHull(E& executor, const HullView& hull, const OpenCubes& open, const HullLabels& labels,
               ArrayView<Vec3d> vertices) {
  executor.ForEach("find faces on the hull", open.count(),
                   AskBody<HullFacesOf>{hull, {open}, labels.faces});
  executor.ForEach("no vertex is on the hull", vertices.size, NotOnHullBody{labels.on_hull});
  executor.ForEach("mark vertices on the hull", open.count(),
                   MarkHullVerticesBody{open.corners, labels});
  executor.ForEach("project vertices to the hull", vertices.size,
                   ProjectHullVertexBody{hull, ReadOnly(labels.on_hull), vertices});
}

}  // namespace amhex
