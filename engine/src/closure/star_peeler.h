// A star taken apart: cells cut out along its walls, as long as that saves cells.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "amhex/vec3.h"
#include "closure/peel_stars.h"
#include "closure/working_mesh.h"

namespace amhex {

// The cells of a star and what surrounds them.
struct StarSurface {
  std::vector<int> cells;       // ascending
  std::vector<CellFace> walls;  // faces without the apex, looking in
  std::vector<CellFace> hull;   // those of them that are hull, outward
};
StarSurface SurfaceOf(const WorkingMesh& mesh, int32_t apex, const std::vector<int>& star);

class StarPeeler {
 public:
  // `apex`: where one may be that sees all walls.
  StarPeeler(const WorkingMesh& mesh, StarSurface surface, const Vec3d& apex, StarFolds folds);

  // Cuts cells out, those first that save most. False if there is none. What remains, if anything,
  // is a good star.
  bool Run();
  // What the cells lack to the scaled Jacobian 1, summed up.
  double Loss() const;
  // Puts them in the place of the star's.
  void Apply(WorkingMesh* mesh) const;

 private:
  struct Peel;  // one way to shrink the star by a cell

  bool PeelOne();
  double Floor() const;
  std::optional<Peel> Judge(const CellCorners& corners) const;
  bool IsTaken(const CellFace& face) const;
  bool RestIsGood(const std::vector<CellFace>& rest);
  bool Folds(const std::vector<CellFace>& rest, const Vec3d& apex) const;

  const WorkingMesh* mesh_;
  StarSurface surface_;  // its walls are those that remain
  Vec3d apex_;
  StarFolds folds_;
  double floor_ = 1;                // the least quality before
  std::vector<CellCorners> cells_;  // cut out
};

}  // namespace amhex
