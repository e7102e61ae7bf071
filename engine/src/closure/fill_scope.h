// The part of the mesh that a Delaunay filling looks at, and the metric it sees it in.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "closure/cavities.h"
#include "closure/working_mesh.h"

namespace amhex {

struct FillScope {
  std::vector<int> cells;     // living cells to consider, ascending
  std::vector<int> cavities;  // cavities to fill, ascending
  // Rows of the linear map under which the scope's cells are about cubes of one size: flat cells
  // are no unions of Delaunay tetrahedra, cubes are.
  std::array<Vec3d, 3> metric{Vec3d{1, 0, 0}, Vec3d{0, 1, 0}, Vec3d{0, 0, 1}};
  // A scope that ends inside the mesh: fillings that reach its border are void.
  bool is_local = false;
  Box3d safe_box;  // where a local filling may place tetrahedra
  // A filling that adds more cells than this is void.
  int64_t max_added_cells = std::numeric_limits<int64_t>::max();

  Vec3d ToMetric(const Vec3d& p) const {
    return {Dot(metric[0], p), Dot(metric[1], p), Dot(metric[2], p)};
  }
};

// The living cells by where their centres are. Vertices must not move meanwhile; cells that die may
// still be found.
class CellBins {
 public:
  explicit CellBins(const WorkingMesh& mesh) { AddNewCells(mesh); }

  // Those added since the last call. O(their number).
  void AddNewCells(const WorkingMesh& mesh);
  // At least all cells whose centres are within `reach` of the box along each axis, ascending.
  std::vector<int> Around(const Box3d& box, double reach) const;

 private:
  using Bin = std::array<int32_t, 3>;
  static Bin BinOf(const Vec3d& p);

  absl::flat_hash_map<Bin, std::vector<int>> cells_;  // only looked up
  int next_cell_ = 0;
};

FillScope ScopeOfWholeMesh(const WorkingMesh& mesh, const Cavities& cavities);

// The cells around one cavity, in the mean metric of its hexahedra; `bins` of this mesh.
FillScope ScopeAroundCavity(const WorkingMesh& mesh, const CellBins& bins, const Cavities& cavities,
                            int cavity);

}  // namespace amhex
