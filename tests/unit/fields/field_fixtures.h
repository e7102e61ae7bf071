// Hulls and fields of small solids, as the tests of the field stages need them.
#pragma once

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "amhex/input_hull.h"
#include "amhex/run_context.h"
#include "fields/background_grid.h"
#include "fields/field_loops.h"
#include "fields/lattice_form.h"
#include "fields/orientation_field.h"
#include "fields/size_field.h"
#include "input/hull.h"
#include "input/hull_queries.h"

namespace amhex::fields {

// A closed, outward oriented mesh whose unit is already one edge length.
inline Hull HullOf(TriangleMesh mesh) {
  Hull hull;
  hull.vertices = std::move(mesh.vertices);
  hull.triangles = std::move(mesh.triangles);
  for (const Vec3d& p : hull.vertices) hull.box.Extend(p);
  hull.input_diagonal = hull.box.Diagonal();
  for (const auto& t : hull.triangles) {
    const Vec3d &a = hull.vertices[t[0]], &b = hull.vertices[t[1]], &c = hull.vertices[t[2]];
    hull.triangle_normals.push_back(Normalized(Cross(b - a, c - a)));
    hull.volume += Determinant(a, b, c) / 6;
  }
  hull.queries = std::make_shared<HullQueries>(hull.vertices, hull.triangles);
  return hull;
}

inline Vec3d Turned(const AxisFrame& frame, const Vec3d& p) {
  return frame.axis[0] * p.x + frame.axis[1] * p.y + frame.axis[2] * p.z;
}

inline TriangleMesh Turned(const AxisFrame& frame, TriangleMesh mesh) {
  for (Vec3d& p : mesh.vertices) p = Turned(frame, p);
  return mesh;
}

// A rotation that is far from every rotation of the axes to themselves.
inline Quaternion SkewRotation() { return Normalized(Quaternion{0.9, 0.2, -0.25, 0.15}); }

// All fields up to the lattice form; check `ok` before use.
struct SolvedFields {
  RunContext run;
  Hull hull;
  BackgroundGrid grid;
  std::vector<Quaternion> frames;
  ForwardCodes codes;
  std::vector<Vec3d> sizes;
  LatticeForm form;
  bool ok = false;

  explicit SolvedFields(TriangleMesh mesh) : hull(HullOf(std::move(mesh))) {
    const ProgressSlice slice(run, 0, 1);
    auto built = BuildBackgroundGrid(hull, 1.0 / kNodesPerEdge, slice);
    if (!built.ok()) return;
    grid = *std::move(built);
    auto oriented = SolveOrientationField(grid, {}, {}, slice);
    if (!oriented.ok()) return;
    frames = std::move(oriented->frames);
    codes = std::move(oriented->codes);
    auto sized = SolveSizeField(grid, frames, codes, {}, slice);
    if (!sized.ok()) return;
    sizes = *std::move(sized);
    auto closed = SolveLatticeForm(grid, frames, sizes, codes, {}, slice);
    if (!closed.ok()) return;
    form = *std::move(closed);
    ok = true;
  }
};

}  // namespace amhex::fields
