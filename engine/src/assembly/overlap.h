// Do two cells overlap although they share no face? Section 5.2, III: partial overlaps and
// inclusions are conflicts.
#pragma once

#include <array>
#include <vector>

#include "amhex/vec3.h"
#include "amhex/volume_mesh.h"

namespace amhex {

// Where a cell is, and where its samples are.
struct CellExtent {
  CellExtent(const CellCorners& corners, const std::vector<Vec3d>& vertices);

  Vec3d centre;  // average of the distinct vertices
  Box3d box;
  Box3d sample_box;
};

// False if the two cells cannot overlap; cheap, and true for few neighbours.
bool MayOverlap(const CellExtent& a, const CellExtent& b);

// A cell as the overlap test sees it.
class CellBody {
 public:
  CellBody(const CellCorners& corners, const std::vector<Vec3d>& vertices);

  const CellExtent& extent() const { return extent_; }

  // True if a shrunk vertex, edge mid point or face centre, or the centre, of one lies inside the
  // other. Touching cells, and cells that overlap by less than the shrinkage, do not overlap.
  friend bool Overlap(const CellBody& a, const CellBody& b);

 private:
  // On the inner side of every face triangle, with either diagonal of the quads.
  bool Contains(const Vec3d& point) const;
  bool ContainsSampleOf(const CellBody& other) const;

  struct Plane {
    Vec3d normal;  // outward, not normalised
    double offset = 0;
  };
  static constexpr int kMostSamples = 8 + 12 + 6 + 1;
  static constexpr int kMostPlanes = 24;
  CellExtent extent_;
  int sample_count_ = 0;
  std::array<Vec3d, kMostSamples> samples_;
  int plane_count_ = 0;
  std::array<Plane, kMostPlanes> planes_;
};

bool Overlap(const CellBody& a, const CellBody& b);

}  // namespace amhex
