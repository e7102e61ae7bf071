// Filling a cavity by a star: every face is joined to one apex by a pyramid or a tetrahedron.
//
// Faces look into the cavity. A face is good for an apex if the cell between them has positive
// scaled Jacobians.
#pragma once

#include <cstdint>
#include <vector>

#include "closure/working_mesh.h"

namespace amhex {

// Minimum scaled Jacobian of the cell between `face` and `apex`; <= 0 if inverted. Where that is
// not above `enough`, some value that is not.
double StarQuality(const CellFace& face, const Vec3d& apex, const std::vector<Vec3d>& vertices,
                   double enough = -2);
double MinStarQuality(const std::vector<CellFace>& faces, const Vec3d& apex,
                      const std::vector<Vec3d>& vertices);

// FoldMargin (cell_quality.h) of the cell between `face` and `apex`.
double StarFoldMargin(const CellFace& face, const Vec3d& apex, const std::vector<Vec3d>& vertices);

// A half-space that must contain the apex: normal . (p - point) > 0.
struct KernelPlane {
  Vec3d normal;
  Vec3d point;
};
void AppendKernelPlanes(const CellFace& face, const std::vector<Vec3d>& vertices,
                        std::vector<KernelPlane>* planes);

// The point with the greatest distance to all planes (by steepest ascent), and that distance in
// edge lengths; negative if the planes have no common point. Where it is found to be below
// `hopeless`, the search ends with some depth below that.
struct KernelPoint {
  Vec3d point;
  double depth = -1;
};
KernelPoint FindKernel(const std::vector<KernelPlane>& planes, const Vec3d& start,
                       double hopeless = -1e300);

// Moves `apex` to raise the minimum quality, from steps of `first_step` down; returns it.
double ImproveApex(const std::vector<CellFace>& faces, const std::vector<Vec3d>& vertices,
                   double first_step, Vec3d* apex);

// Sum of the solid angles of the faces; 4 pi exactly if the apex sees a closed surface once.
double SolidAngle(const std::vector<CellFace>& faces, const Vec3d& apex,
                  const std::vector<Vec3d>& vertices);
// Such sums are of whole spheres, so that all between one and none tells them apart.
inline constexpr double kSolidAngleTolerance = 0.1;

}  // namespace amhex
