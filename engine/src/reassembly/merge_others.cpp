#include "reassembly/merge_others.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "base/status_macros.h"
#include "reassembly/break_down.h"
#include "reassembly/merge_candidates.h"
#include "reassembly/merge_cells.h"
#include "reassembly/reassemble.h"
#include "topology/direct_cells.h"
#include "topology/half_face.h"

namespace amhex {
namespace {

// Poor cells and bent quads become good ones as vertices move.
constexpr PieceLimits kLimits{0.2, {20, 75, 30}};
// Of the angle of a crease. One that is kept may be flatter where the mesh's vertices have it.
constexpr double kFlatShare = 0.85;

bool IsHexahedron(const CellCorners& cell) {
  return RecognizeCell(cell) == PrimitiveType::kHexahedron;
}

// Moves all cells that are no hexahedra, with their faces on the hull, out of the complex.
BrokenVolume TakeOthers(CellComplex* complex) {
  BrokenVolume others;
  std::vector<CellFace> faces;
  std::vector<CellCorners> hexahedra;
  for (const CellCorners& cell : complex->cells) {
    if (IsHexahedron(cell)) {
      hexahedra.push_back(cell);
      continue;
    }
    others.cells.push_back(cell);
    for (const CellFace& face : FacesOf(cell)) faces.push_back(CanonicalHalfFace(face));
  }
  std::sort(faces.begin(), faces.end());
  std::vector<CellFace> kept;
  for (const CellFace& face : complex->hull_faces) {
    const bool is_of_others =
        std::binary_search(faces.begin(), faces.end(), CanonicalHalfFace(face));
    (is_of_others ? others.boundary : kept).push_back(face);
  }
  others.vertices = complex->vertices;
  complex->cells = std::move(hexahedra);
  complex->hull_faces = std::move(kept);
  return others;
}

template <class T>
void Append(const std::vector<T>& more, std::vector<T>* all) {
  all->insert(all->end(), more.begin(), more.end());
}

}  // namespace

absl::StatusOr<CellComplex> MergeOthers(CellComplex complex, double sharp_angle_degrees,
                                        RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  CellComplex rest = complex;
  const BrokenVolume others = TakeOthers(&rest);
  PieceLimits limits = kLimits;
  limits.quads.hull_fold = std::min(limits.quads.hull_fold, kFlatShare * sharp_angle_degrees);
  AMHEX_ASSIGN_OR_RETURN(const PieceTable pieces, FindPieces(others, limits, run));
  AMHEX_ASSIGN_OR_RETURN(const std::vector<int32_t> chosen, MergeCells(pieces, run));
  if (chosen.empty() || chosen.back() < pieces.atom_count) return complex;  // all as they are
  const CellComplex merged = ComplexOfPieces(others, pieces, chosen, Frame());
  Append(merged.cells, &rest.cells);
  Append(merged.hull_faces, &rest.hull_faces);
  return rest;
}

}  // namespace amhex
