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

// What stands where a cell was, if no piece does.
constexpr int32_t kAsItIs = -1, kPartOfAnother = -2;

// The cells that are no hexahedra, with their faces on the hull.
struct Others {
  BrokenVolume volume;
  std::vector<int32_t> cell;         // [other] its number in the complex
  std::vector<CellFace> hull_faces;  // of all other cells
};

Others OthersOf(const CellComplex& complex) {
  Others others;
  std::vector<CellFace> faces;
  for (size_t c = 0; c < complex.cells.size(); ++c) {
    const CellCorners& cell = complex.cells[c];
    if (RecognizeCell(cell) == PrimitiveType::kHexahedron) continue;
    others.volume.cells.push_back(cell);
    others.cell.push_back(static_cast<int32_t>(c));
    for (const CellFace& face : FacesOf(cell)) faces.push_back(CanonicalHalfFace(face));
  }
  std::sort(faces.begin(), faces.end());
  for (const CellFace& face : complex.hull_faces) {
    const bool is_of_others =
        std::binary_search(faces.begin(), faces.end(), CanonicalHalfFace(face));
    (is_of_others ? others.volume.boundary : others.hull_faces).push_back(face);
  }
  others.volume.vertices = complex.vertices;
  return others;
}

// Every piece in the place of its first atom.
std::vector<CellCorners> PutIn(const CellComplex& complex, const Others& others,
                               const PieceTable& pieces, const std::vector<int32_t>& chosen) {
  std::vector<int32_t> piece_at(complex.cells.size(), kAsItIs);
  for (const int32_t cell : others.cell) piece_at[static_cast<size_t>(cell)] = kPartOfAnother;
  for (const int32_t piece : chosen) {
    const int32_t first = pieces.atoms(piece).front();
    piece_at[static_cast<size_t>(others.cell[static_cast<size_t>(first)])] = piece;
  }
  std::vector<CellCorners> cells;
  for (size_t c = 0; c < piece_at.size(); ++c) {
    if (piece_at[c] == kPartOfAnother) continue;
    cells.push_back(piece_at[c] == kAsItIs
                        ? complex.cells[c]
                        : pieces.pieces[static_cast<size_t>(piece_at[c])].corners);
  }
  return cells;
}

}  // namespace

absl::StatusOr<CellComplex> MergeOthers(CellComplex complex, double sharp_angle_degrees,
                                        RunContext& run) {
  AMHEX_RETURN_IF_ERROR(run.CheckStop());
  Others others = OthersOf(complex);
  PieceLimits limits = kLimits;
  limits.quads.hull_fold = std::min(limits.quads.hull_fold, kFlatShare * sharp_angle_degrees);
  AMHEX_ASSIGN_OR_RETURN(const PieceTable pieces, FindPieces(others.volume, limits, run));
  AMHEX_ASSIGN_OR_RETURN(const std::vector<int32_t> chosen, MergeCells(pieces, run));
  if (chosen.empty() || chosen.back() < pieces.atom_count) return complex;  // all as they are
  complex.cells = PutIn(complex, others, pieces, chosen);
  complex.hull_faces = std::move(others.hull_faces);
  AppendHullFaces(pieces, chosen, &complex.hull_faces);
  return complex;
}

}  // namespace amhex
