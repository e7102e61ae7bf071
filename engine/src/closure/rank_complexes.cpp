#include "closure/rank_complexes.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "closure/extrude_layer.h"
#include "closure/fill_wedges.h"
#include "closure/prepare_cavities.h"
#include "input/wanted_cells.h"

namespace amhex {
namespace {

// What an open face comes to once it is closed and others have been merged, fitted to 81 meshes of
// 5,000 to 15,000 cells: so many cells more, and what all of them lack and the hexahedra that were
// given up for them.
constexpr double kCellsPerOpenFace = 1.1;
constexpr double kShortfallPerOpenFace = 0.9;
// A number of cells this share away from the wanted one is as good as the wanted one.
constexpr double kFreeDeviation = 0.12;
constexpr double kDeviationWeight = 1.0;

// What cells usually lack to the scaled Jacobian 1 once they are placed (measured on scans).
double TypicalShortfall(PrimitiveType type) {
  switch (type) {
    case PrimitiveType::kHexahedron:
      return 0.03;
    case PrimitiveType::kHexprism:
      return 0.18;
    case PrimitiveType::kPrism:
      return 0.27;
    case PrimitiveType::kSlice:
      return 0.35;
    case PrimitiveType::kPyramid:
      return 0.45;
    case PrimitiveType::kTetrahedron:
      return 0.57;
  }
  return 1;
}

RankedComplex Judge(const CellComplex& complex, size_t index, const Hull& hull, double wanted_cells,
                    const StopPoll& poll) {
  WorkingMesh mesh(complex, poll);
  if (mesh.HasOpenFaces()) {
    RemoveLooseCells(&mesh);
    SnapFacesToHull(hull, &mesh);
    ExtrudeToHull(hull, &mesh);
    FillWedges(hull, &mesh, poll);
  }
  RankedComplex judged{index, 0, static_cast<int64_t>(mesh.OpenFaces().size())};
  double cells = 0, loss = 0;
  for (int cell = 0; cell < mesh.cell_slots(); ++cell) {
    if (!mesh.alive(cell)) continue;
    cells += 1;
    loss += TypicalShortfall(mesh.type(cell));
  }
  const auto open_faces = static_cast<double>(judged.open_faces);
  cells += kCellsPerOpenFace * open_faces;
  loss += kShortfallPerOpenFace * open_faces;
  judged.loss = loss / std::max(1.0, cells) + DeviationLoss(cells, wanted_cells);
  return judged;
}

}  // namespace

double DeviationLoss(double cell_count, double wanted_cells) {
  const double deviation = std::abs(cell_count / std::max(1.0, wanted_cells) - 1);
  return kDeviationWeight * std::max(0.0, deviation - kFreeDeviation);
}

absl::StatusOr<std::vector<RankedComplex>> RankComplexes(const std::vector<CellComplex>& complexes,
                                                         const Hull& hull, const RunContext& run) {
  std::vector<RankedComplex> ranked;
  if (complexes.size() == 1) ranked.resize(1);  // nothing to choose from
  if (complexes.size() < 2) return ranked;
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  ranked.resize(complexes.size());
  const double wanted_cells = WantedCells(hull, StopPoll(run));
  oneapi::tbb::parallel_for(size_t{0}, complexes.size(), [&](size_t i) {
    ranked[i] = Judge(complexes[i], i, hull, wanted_cells, StopPoll(run));
  });
  if (absl::Status status = run.CheckStop(); !status.ok()) return status;
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const RankedComplex& a, const RankedComplex& b) { return a.loss < b.loss; });
  return ranked;
}

}  // namespace amhex
