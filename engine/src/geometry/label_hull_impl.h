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

// Of a vertex, the smallest number of a face on the hull that has it, 6 * cube + direction.
inline constexpr int32_t kNoHullFace = 0x7fffffff;

struct NotOnHullBody {
  ArrayView<int32_t> face_of;
  AMHEX_HD void operator()(int64_t v) const { face_of[v] = kNoHullFace; }
};

// One element per cube.
struct MarkHullVerticesBody {
  ArrayView<const CellCorners> corners;
  ArrayView<const uint8_t> faces;
  ArrayView<int32_t> face_of;
  AMHEX_HD void operator()(int64_t cube) const {
    for (int direction = 0; direction < kDirectionCount; ++direction) {
      if ((faces[cube] >> direction & 1) == 0) continue;
      const auto face = static_cast<int32_t>(6 * cube + direction);
      for (int q = 0; q < 4; ++q) Mark(corners[cube][CornerOfFace(direction, q)], face);
    }
  }

 private:
  AMHEX_HD void Mark(int32_t vertex, int32_t face) const {
#if defined(__CUDA_ARCH__)
    atomicMin(&face_of[vertex], face);
#else
    int32_t* const place = &face_of[vertex];
    int32_t known = __atomic_load_n(place, __ATOMIC_RELAXED);
    while (face < known && !__atomic_compare_exchange_n(place, &known, face, true, __ATOMIC_RELAXED,
                                                        __ATOMIC_RELAXED)) {
    }
#endif
  }
};

// Tells which are on the hull.
struct ProjectHullVertexBody {
  HullView hull;
  CubesView cubes;
  ArrayView<const int32_t> face_of;
  ArrayView<uint8_t> on_hull;
  ArrayView<Vec3d> vertices;
  AMHEX_HD void operator()(int64_t v) const {
    on_hull[v] = face_of[v] == kNoHullFace ? 0 : 1;
    if (on_hull[v] == 0) return;
    const int cube = face_of[v] / 6, direction = face_of[v] % 6;
    const Vec3d normal = cubes.FaceNormal(cube, direction);
    const Vec3d place = vertices[v];
    const double extent = 2 * cubes.half_extent[cube][direction / 2];
    const HullPoint nearest = hull.Closest(place);
    HullPoint own;
    if (Dot(nearest.normal, normal) <= OwnSideOfGap::kOtherSide) {
      own = OwnSideOfGap::ClosestTo(hull, place, normal, extent);
    }
    if (own.triangle < 0) {
      own = OwnSideOfGap::OnTheWay(hull, cubes.centre[cube], nearest, extent);
    }
    vertices[v] = own.triangle >= 0 ? own.point : nearest.point;
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
  auto face_of = executor.template Alloc<int32_t>(vertices.size);
  executor.ForEach("no vertex is on the hull", vertices.size, NotOnHullBody{face_of.View()});
  executor.ForEach("mark vertices on the hull", open.count(),
                   MarkHullVerticesBody{open.corners, ReadOnly(labels.faces), face_of.View()});
  executor.ForEach(
      "project vertices to the hull", vertices.size,
      ProjectHullVertexBody{hull, open.cubes, ReadOnly(face_of.View()), labels.on_hull, vertices});
}

}  // namespace amhex
