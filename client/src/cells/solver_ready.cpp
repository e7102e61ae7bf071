#include "cells/solver_ready.h"

#include <algorithm>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "cells/boundary.h"
#include "cells/cell_division.h"
#include "cells/cells.h"

namespace amhex::client {
namespace {

// Below this least scaled Jacobian a division counts as the worse the lower it is. About half of
// the 0.41 that a cube divided around its middle has.
constexpr double kWantedQuality = 0.2;
// How many more divided cells half the wanted quality is worth avoiding.
constexpr double kQualityWeight = 8;
// What a division without positive quality costs, in divided cells.
constexpr double kInvalidCost = 1e6;
// Sweeps over the cells to divide; the search ends when one changes nothing.
constexpr int kMostSweeps = 20;
constexpr int kFaces = 6;
constexpr int kDiagonals = 3;  // values of Diagonal

struct Quad {
  std::array<int32_t, 2> cell{-1, -1};
  Diagonal diagonal = Diagonal::kNone;
};

class SolverReadyMaker {
 public:
  explicit SolverReadyMaker(const AtMostHexaMesh& mesh) : mesh_(mesh) {}

  absl::StatusOr<AtMostHexaMesh> Make() {
    if (const auto boundary = BoundaryOf(mesh_, {}); !boundary.ok()) return boundary.status();
    CollectQuads();
    for (size_t cell = 0; cell < mesh_.corners.size(); ++cell) {
      const PrimitiveType type = mesh_.types[cell];
      if (type == PrimitiveType::kSlice || type == PrimitiveType::kHexprism) {
        to_divide_.push_back(static_cast<int32_t>(cell));
      }
    }
    Search();
    return Build();
  }

 private:
  void CollectQuads() {
    absl::flat_hash_map<std::array<int32_t, 4>, int32_t> numbers;
    quads_of_cell_.assign(mesh_.corners.size(), {-1, -1, -1, -1, -1, -1});
    for (size_t cell = 0; cell < mesh_.corners.size(); ++cell) {
      const FaceList faces = FacesOfCell(mesh_.corners[cell]);
      for (int f = 0; f < faces.count; ++f) {
        if (faces.face[f].count != 4) continue;
        std::array<int32_t, 4> key = faces.face[f].vertex;
        std::sort(key.begin(), key.end());
        const auto [entry, is_new] = numbers.try_emplace(key, static_cast<int32_t>(quads_.size()));
        if (is_new) quads_.emplace_back();
        quads_[entry->second].cell[is_new ? 0 : 1] = static_cast<int32_t>(cell);
        quads_of_cell_[cell][f] = entry->second;
      }
    }
  }

  FaceDiagonals DiagonalsOf(int32_t cell) const {
    FaceDiagonals diagonals{};
    for (int f = 0; f < kFaces; ++f) {
      const int32_t quad = quads_of_cell_[cell][f];
      if (quad >= 0) diagonals[f] = quads_[quad].diagonal;
    }
    return diagonals;
  }

  void SetDiagonals(int32_t cell, const FaceDiagonals& diagonals) {
    for (int f = 0; f < kFaces; ++f) {
      const int32_t quad = quads_of_cell_[cell][f];
      if (quad >= 0) quads_[quad].diagonal = diagonals[f];
    }
  }

  // What the cell costs as its quadrilaterals are now: 0 undivided, else about 1.
  double Cost(int32_t cell) {
    const FaceDiagonals diagonals = DiagonalsOf(cell);
    const PrimitiveType type = mesh_.types[cell];
    if (diagonals == FaceDiagonals{} && type != PrimitiveType::kSlice &&
        type != PrimitiveType::kHexprism) {
      return 0;
    }
    uint64_t key = static_cast<uint64_t>(cell);
    for (Diagonal diagonal : diagonals) key = key * kDiagonals + static_cast<uint64_t>(diagonal);
    const auto [entry, is_new] = cost_.try_emplace(key, 0);
    if (is_new) {
      const double quality = DivideCell(mesh_.corners[cell], mesh_.vertices, diagonals).quality;
      entry->second = quality <= 0
                          ? kInvalidCost * (1 - quality)
                          : 1 + kQualityWeight * std::max(0.0, kWantedQuality / quality - 1);
    }
    return entry->second;
  }

  // The cells that see a change of the diagonals of `cells`, each once.
  std::vector<int32_t> Around(const std::vector<int32_t>& cells) const {
    std::vector<int32_t> around = cells;
    for (int32_t cell : cells) {
      for (int32_t quad : quads_of_cell_[cell]) {
        if (quad < 0) continue;
        for (int32_t other : quads_[quad].cell) {
          if (other >= 0) around.push_back(other);
        }
      }
    }
    std::sort(around.begin(), around.end());
    around.erase(std::unique(around.begin(), around.end()), around.end());
    return around;
  }

  double CostOf(const std::vector<int32_t>& cells) {
    double sum = 0;
    for (int32_t cell : cells) sum += Cost(cell);
    return sum;
  }

  // All that is worth trying for one cell: each quadrilateral changed alone, and the sets of
  // diagonals that its divisions without a new vertex need.
  std::vector<FaceDiagonals> Options(int32_t cell) const {
    const FaceDiagonals now = DiagonalsOf(cell);
    std::vector<FaceDiagonals> options = {FaceDiagonals{}};
    const FaceList faces = FacesOfCell(mesh_.corners[cell]);
    if (mesh_.types[cell] == PrimitiveType::kHexprism) {
      for (const FaceDiagonals& set : HexprismDiagonals(faces)) options.push_back(set);
    }
    for (int f = 0; f < faces.count; ++f) {
      if (faces.face[f].count != 4) continue;
      for (int value = 0; value < kDiagonals; ++value) {
        FaceDiagonals changed = now;
        changed[f] = static_cast<Diagonal>(value);
        options.push_back(changed);
        if (mesh_.types[cell] != PrimitiveType::kSlice) continue;
        // A slice has but two: all combinations.
        for (int g = f + 1; g < faces.count; ++g) {
          if (faces.face[g].count != 4) continue;
          for (int second = 0; second < kDiagonals; ++second) {
            changed[g] = static_cast<Diagonal>(second);
            options.push_back(changed);
          }
        }
      }
    }
    return options;
  }

  // Takes the cheapest option; true if that changed anything.
  bool Improve(int32_t cell) {
    const std::vector<int32_t> around = Around({cell});
    const FaceDiagonals before = DiagonalsOf(cell);
    FaceDiagonals best = before;
    double least = CostOf(around);
    for (const FaceDiagonals& option : Options(cell)) {
      SetDiagonals(cell, option);
      const double cost = CostOf(around);
      if (cost < least - kLeastGain) least = cost, best = option;
    }
    SetDiagonals(cell, best);
    return best != before;
  }

  // For cells that no choice of their own makes valid: together with a neighbour.
  bool ImproveWithNeighbour(int32_t cell) {
    for (int32_t other : Around({cell})) {
      if (other == cell || mesh_.types[other] == PrimitiveType::kHexahedron) continue;
      const std::vector<int32_t> around = Around({cell, other});
      const FaceDiagonals before = DiagonalsOf(cell), other_before = DiagonalsOf(other);
      const double cost_before = CostOf(around);
      for (const FaceDiagonals& option : Options(cell)) {
        SetDiagonals(cell, option);
        // What both share is now the cell's choice; the neighbour adapts the rest.
        for (const FaceDiagonals& other_option : Options(other)) {
          SetDiagonals(other, other_option);
          if (CostOf(around) < cost_before - kLeastGain) return true;
        }
        SetDiagonals(other, other_before);
        SetDiagonals(cell, before);
      }
    }
    return false;
  }

  void Search() {
    for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
      bool changed = false;
      for (int32_t cell : to_divide_) changed = Improve(cell) || changed;
      if (changed) continue;
      for (int32_t cell : to_divide_) {
        if (Cost(cell) >= kInvalidCost) changed = ImproveWithNeighbour(cell) || changed;
      }
      if (!changed) return;
    }
  }

  absl::StatusOr<AtMostHexaMesh> Build() const {
    AtMostHexaMesh result;
    result.vertices = mesh_.vertices;
    for (size_t cell = 0; cell < mesh_.corners.size(); ++cell) {
      const FaceDiagonals diagonals = DiagonalsOf(static_cast<int32_t>(cell));
      const Division division = DivideCell(mesh_.corners[cell], mesh_.vertices, diagonals);
      const bool divided = division.has_centre || division.cells.size() > 1;
      if (divided && !(division.quality > 0)) {
        const Vec3d place = CentreOfCell(mesh_.corners[cell], mesh_.vertices);
        return absl::FailedPreconditionError(
            absl::StrCat("cell ", cell, " (", PrimitiveName(mesh_.types[cell]), " at ", place.x,
                         ", ", place.y, ", ", place.z,
                         ") cannot be divided into cells of positive scaled Jacobian; the best "
                         "division has ",
                         division.quality));
      }
      const auto centre = static_cast<int32_t>(result.vertices.size());
      if (division.has_centre) result.vertices.push_back(division.centre);
      for (CellCorners corners : division.cells) {
        std::replace(corners.begin(), corners.end(), kCentreVertex, centre);
        result.corners.push_back(corners);
        result.types.push_back(TypeOfCell(corners).value_or(PrimitiveType::kHexahedron));
        result.quality.push_back(
            static_cast<float>(ScaledJacobianOfCell(corners, result.vertices)));
      }
    }
    return result;
  }

  static constexpr double kLeastGain = 1e-9;

  const AtMostHexaMesh& mesh_;
  std::vector<Quad> quads_;
  std::vector<std::array<int32_t, kFaces>> quads_of_cell_;
  std::vector<int32_t> to_divide_;
  absl::flat_hash_map<uint64_t, double> cost_;  // by cell and diagonals
};

}  // namespace

absl::StatusOr<AtMostHexaMesh> MakeSolverReady(const AtMostHexaMesh& mesh) {
  return SolverReadyMaker(mesh).Make();
}

}  // namespace amhex::client
