// The best star over part of a cavity, and over cells that it absorbs.
#pragma once

#include <array>
#include <cstdint>
#include <set>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "amhex/vec3.h"
#include "closure/carve.h"
#include "closure/star_geometry.h"
#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

// A star over part of a cavity, not yet applied.
struct Carving {
  double cost_per_face = 1e9;
  Vec3d apex;
  std::vector<int> cells;       // absorbed, ascending
  std::vector<CellFace> faces;  // all that the star stands on, looking in
  std::vector<CellFace> hull;   // those of them that become hull
  std::vector<int> closed;      // half-faces of the part
};

// Finds the best carving around one open face.
class PartSearch {
 public:
  // All three must outlive this.
  PartSearch(const WorkingMesh& mesh, const Hull& hull, const CarveLimits& limits)
      : mesh_(mesh), hull_(hull), limits_(limits) {}

  // `faces`: open faces of one cavity; `part`: indices of those to close.
  void Run(const std::vector<CellFace>& faces, const std::vector<int>& part);

  const Carving& best() const { return best_; }
  // Parts that have been looked at: what it cost.
  int64_t part_count() const { return part_count_; }

 private:
  struct Wall {
    CellFace face;  // looking in
    int owner;      // the cell behind it
  };
  // A set of absorbed cells and the walls of the void that they and the part leave.
  struct Part {
    double bound = 0;  // of its score, whatever its kernel
    std::vector<int> cells;
    std::vector<Wall> walls;
    std::vector<CellFace> kept_open;   // of absorbed cells outside of the part, looking in
    std::vector<CellFace> hull_faces;  // former ones of absorbed cells, looking in
    KernelPoint kernel;
  };

  std::vector<Part> Grow(const std::vector<Part>& beam, std::set<std::vector<int>>* seen);
  std::vector<Part> KeepBest(std::vector<Part> parts);
  bool Update(Part* part);
  void FindKernelOf(Part* part, double hopeless);
  const std::vector<KernelPlane>& PlanesOf(const CellFace& face);
  double AbsorbedCost(const Part& part) const;
  void Evaluate(const Part& part);
  double CostOfFaces(const Part& part, size_t faces) const;
  bool IsHopeless(const Part& part, size_t faces) const;
  bool Close(const Part& part, const std::vector<CellFace>& fixed, Carving* carving) const;

  const WorkingMesh& mesh_;
  const Hull& hull_;
  const CarveLimits& limits_;
  std::vector<Wall> faces_;  // open faces of the part
  std::vector<int> closed_;  // the same as half-faces, ascending
  Carving best_;
  int64_t part_count_ = 0;
  std::vector<KernelPlane> planes_;  // of the part at hand
  absl::flat_hash_map<std::array<int32_t, 4>, std::vector<KernelPlane>> planes_of_;  // by face
};

}  // namespace amhex
