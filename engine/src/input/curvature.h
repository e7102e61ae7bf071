// Second fundamental forms of the hull's triangles. Paper: 4.3, after Rusinkiewicz 2004.
#pragma once

#include <vector>

#include "amhex/vec3.h"
#include "base/stop_poll.h"
#include "input/hull.h"

namespace amhex {

// A symmetric tensor in space: xx, yy, zz, xy, yz, zx.
struct SymmetricTensor {
  double xx = 0, yy = 0, zz = 0, xy = 0, yz = 0, zx = 0;

  void Add(const SymmetricTensor& t, double weight) {
    xx += weight * t.xx, yy += weight * t.yy, zz += weight * t.zz;
    xy += weight * t.xy, yz += weight * t.yz, zx += weight * t.zx;
  }
  double Between(const Vec3d& a, const Vec3d& b) const {
    return a.x * (xx * b.x + xy * b.y + zx * b.z) + a.y * (xy * b.x + yy * b.y + yz * b.z) +
           a.z * (zx * b.x + yz * b.y + zz * b.z);
  }
};

// [triangle_count] how the normal turns along the triangle: Between(d, d) is the curvature in the
// unit direction d, in 1 / edge length, positive where the solid is convex. Corner normals are
// taken over the triangles that are reached without crossing a sharp edge.
std::vector<SymmetricTensor> TriangleCurvatures(const Hull& hull, const StopPoll& poll = {});

struct PrincipalDirections {
  Vec3d largest;             // unit, tangent to `normal`: direction of the largest |curvature|
  double curvature_max = 0;  // signed, along `largest`
  double curvature_min = 0;  // signed, across it
};

// Principal directions of a tensor seen in the plane with the unit normal `normal`.
PrincipalDirections PrincipalDirectionsOf(const SymmetricTensor& tensor, const Vec3d& normal);

// Unit vector orthogonal to the unit vector `normal`; always the same one.
Vec3d AnyTangent(const Vec3d& normal);

}  // namespace amhex
