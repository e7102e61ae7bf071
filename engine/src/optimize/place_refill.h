// One place of poor cells: tries to make it better, each on an excerpt of the mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "amhex/params.h"
#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "closure/excerpt.h"
#include "closure/improve_closure.h"
#include "closure/working_mesh.h"
#include "input/hull.h"
#include "optimize/hull_features.h"

namespace amhex {

// Cells below this are poor: their places are opened.
inline constexpr double kPoor = 0.30;
// Larger openings are not refilled: in 23 meshes no filling of more than 41 cells was taken, and
// one of 90 takes one to two seconds of a core.
inline constexpr size_t kMostCellsRefilled = 60;

struct Place {
  double quality = 1;      // of its poorest cell
  std::vector<int> cells;  // poor ones and, mostly, the stars that they belong to, ascending
};

// What every place is refilled with; all outlive that.
struct RefillWith {
  const Hull& hull;
  const HullFeatures& features;
  const MeshingParams& params;
  const RunContext& run;
};

// One after the other until one is good enough, or side by side, where those behind that one are in
// vain. What comes of it is the same.
enum class TryOrder : uint8_t { kInTurn, kAhead };

// One place, everything around it that its refilling may look at, and its better version.
class PlaceRefill {
 public:
  PlaceRefill(const WorkingMesh& whole, const CellLists& cells_at, const Place& place);

  const Excerpt& excerpt() const { return excerpt_; }
  const std::optional<CellComplex>& better() const { return better_; }
  void Discard() { better_.reset(); }

  // Finds the better version, if there is one.
  void Run(const RefillWith& with, TryOrder order);

 private:
  Excerpt excerpt_;
  std::vector<std::vector<int32_t>> openings_;  // by layers, in numbers of the excerpt
  RepairEffort repair_;
  std::vector<uint8_t> fixed_;  // [vertex of the excerpt]
  std::optional<CellComplex> better_;
};

}  // namespace amhex
