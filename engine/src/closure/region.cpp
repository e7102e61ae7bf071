#include "closure/region.h"

#include <algorithm>

#include "base/sort_unique.h"
#include "closure/hull_patch.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

enum class CellSides {
  kSettled,
  kGrown,    // by a cavity
  kUnknown,  // one was opened since the cavities were collected
};

// Adds the sides of the region's cells to its walls and faces on the hull, and the cavities that
// they are open to to the region.
CellSides AddCellSides(const WorkingMesh& mesh, const Cavities& cavities, Region* region) {
  CellSides result = CellSides::kSettled;
  for (const int cell : region->cells) {
    const CellFaces faces = FacesOf(mesh.corners(cell));
    for (int i = 0; i < faces.count; ++i) {
      const int half = mesh.half_faces(cell)[i];
      const int32_t behind = mesh.owner(half ^ 1);
      if (behind >= 0) {
        if (!IsAmong(region->cells, behind)) region->walls.push_back(Reversed(faces.face[i]));
        continue;
      }
      if (behind == WorkingMesh::kHull) {
        region->hull_faces.push_back(Reversed(faces.face[i]));
        continue;
      }
      const int cavity = cavities.Of(half);
      if (cavity < 0) return CellSides::kUnknown;
      if (IsAmong(region->cavities, cavity)) continue;
      region->cavities.insert(
          std::lower_bound(region->cavities.begin(), region->cavities.end(), cavity), cavity);
      result = CellSides::kGrown;
    }
  }
  return result;
}

}  // namespace

bool UpdateRegion(const WorkingMesh& mesh, const Cavities& cavities, size_t max_walls,
                  Region* region) {
  CellSides sides = CellSides::kSettled;
  do {
    region->walls.clear();
    region->hull_faces.clear();
    sides = AddCellSides(mesh, cavities, region);
    if (sides == CellSides::kUnknown) return false;
    for (const int cavity : region->cavities) {
      for (const CellFace& face : cavities.faces[cavity]) {
        if (!IsAmong(region->cells, mesh.Owner(face))) region->walls.push_back(face);
      }
    }
    if (region->walls.size() > max_walls) return false;
  } while (sides == CellSides::kGrown);
  return true;
}

void UpdateKernel(const WorkingMesh& mesh, const Hull& hull, double hopeless, Region* region) {
  const auto& x = mesh.vertices();
  std::vector<KernelPlane> planes;
  Vec3d start;
  int count = 0;
  for (const CellFace& face : region->walls) {
    AppendKernelPlanes(face, x, &planes);
    for (int j = 0; j < face.count; ++j) start += x[face.v[j]], ++count;
  }
  if (count == 0) {
    region->kernel = {};
    return;
  }
  for (const auto& loop : BoundaryLoops(region->walls)) {
    for (const int32_t v : loop) {
      // Not to be looked at from beyond its tangent plane.
      const HullPoint nearest = hull.queries->Closest(x[v], kOnHullDistance);
      if (nearest.triangle >= 0) planes.push_back({-nearest.normal, x[v]});
    }
  }
  region->kernel = FindKernel(planes, start / count, hopeless);
}

std::vector<int> CellsAround(const WorkingMesh& mesh, const Region& region) {
  std::vector<int> cells;
  for (const CellFace& face : region.walls) {
    const int32_t cell = mesh.Owner(face);
    if (cell >= 0 && !IsAmong(region.cells, cell)) cells.push_back(cell);
  }
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

}  // namespace amhex
