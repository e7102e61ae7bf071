// Fills cavities, cheapest filling first, in a mesh of its own.
//
// Stars over whole cavities, stars carved out of parts of them, both again with the cells around
// what resists given up, and Delaunay tetrahedra as the last resort.
#pragma once

#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "amhex/run_context.h"
#include "closure/carve.h"
#include "closure/cavities.h"
#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

// How far stars may grow, by round.
struct StarRound {
  int depth;
  int beam_width;
  size_t max_cavity_faces;
};
inline constexpr StarRound kFirstRounds[] = {{6, 4, 60}, {9, 6, 100}};
inline constexpr StarRound kSlitRounds[] = {{4, 4, 40}, {7, 6, 80}};
// Stars and carvings are tried this often, each time with the cells around what resists removed.
inline constexpr int kFillAttempts = 4;

class CavityFiller {
 public:
  CavityFiller(const CellComplex& complex, const Hull& hull, uint64_t seed, const RunContext& run);

  WorkingMesh& mesh() { return mesh_; }
  const WorkingMesh& mesh() const { return mesh_; }
  // Tells `watched`, if any, of progress from here on.
  void Watch(RunContext* watched);

  // Tries every cavity once, smallest first; true if any was filled.
  bool FillWithStars(const StarRound& round);
  // No more than `attempts` once carving has cost what it may: without it, layers around large
  // cavities are given up for nothing. A `round` has seeds of its own.
  void FillByStars(int round, int attempts = 1);
  // What resists is cleared of all cells around and filled anew. Every reach starts from the same
  // mesh, until one leaves less open than there was.
  void ClearAndFill();
  // The last resort. Once the whole mesh is filled by it, hardly a hexahedron is left.
  void FillByTetrahedra(int round);
  void RemoveCellsAtCavities();

  // What the mesh was opened at now may cost as much in carving as it is worth: at least, or at
  // most.
  void CarveAtLeastForOpening();
  void CarveAtMostForOpening();
  // ClearAndFill may cost less where the mesh is opened again later.
  void ClearLess();

  // A mesh, and which of its cavities have been tried.
  using Attempt = std::pair<int, std::vector<int>>;
  struct State {
    WorkingMesh mesh;
    std::set<Attempt> tried;
  };
  State Save() const { return {mesh_, tried_}; }
  void GoBackTo(State state);

 private:
  void TakeFillSteps(uint64_t seed);
  void ClearAround(double reach);
  void CarveNetworks(const CarveLimits& limits);
  void FillLocally(uint64_t seed, int max_cells_per_face);
  int64_t PartsOfOpening() const;
  bool HasOpenFaces() const { return mesh_.HasOpenFaces(); }
  Attempt AttemptAt(const std::vector<CellFace>& faces, const StarRound& round) const;
  void ReportProgress();

  const Hull& hull_;
  const uint64_t seed_;
  const RunContext& run_;
  RunContext* watched_ = nullptr;
  WorkingMesh mesh_;
  std::set<Attempt> tried_;  // a cavity that a star round has failed to fill is not tried again
                             // before it has changed
  int64_t carved_parts_ = 0;
  int64_t most_carved_parts_;
  int64_t parts_to_clear_;  // what carving may still cost where all around is given up first
  size_t first_open_ = 1;
};

// Of all living cells, edge lengths cubed.
double VolumeOf(const WorkingMesh& mesh);

}  // namespace amhex
