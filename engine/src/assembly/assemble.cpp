#include "assembly/assemble.h"

#include <algorithm>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "assembly/conflict.h"
#include "assembly/initial_mesh.h"
#include "assembly/open_faces.h"
#include "base/status_macros.h"
#include "optimize/report_cells.h"
#include "topology/primitives.h"

namespace amhex {
namespace {

// Listing 3's limits.
constexpr int kLargestType = 8;        // primType starts with the hexahedron
constexpr int kMostClosedFaces = 4;    // cLim starts here
constexpr int kFewestClosedFaces = 2;  // and never falls below
constexpr int kPrimitivesPerStopCheck = 64;

// What a primitive must have to be considered: primType and cLim.
struct Criteria {
  int type = kLargestType;
  int closed_faces = kMostClosedFaces;

  void Reset() { *this = Criteria(); }
  void Lower() {
    if (closed_faces < kMostClosedFaces) --type;
    closed_faces = std::max(kFewestClosedFaces, closed_faces - 1);
  }
};

struct Candidate {
  int32_t primitive = 0;
  int type = 0;
  int closed_faces = 0;
  double quality = 0;
};

class Assembler {
 public:
  Assembler(const PrimitiveTable& table, const MeshingParams& params, const RunContext& context,
            OpenFaces* open_faces, ConflictFinder* conflicts)
      : table_(table),
        params_(params),
        context_(context),
        open_faces_(open_faces),
        conflicts_(conflicts),
        is_decided_(table.primitives.size(), 0) {
    for (int32_t i = 0; i < static_cast<int32_t>(table.primitives.size()); ++i) {
      if (!open_faces->IsInMesh(i)) waiting_.push_back(i);
    }
  }

  // Listing 3. Ends because every round either adds a primitive or lowers the criteria.
  absl::Status AddWhatClosesFaces() {
    Criteria criteria;
    while (criteria.type > 0 && !waiting_.empty()) {
      AMHEX_RETURN_IF_ERROR(context_.CheckStop());
      if (AddBest(Select(criteria), criteria) > 0) {
        criteria.Reset();
      } else {
        criteria.Lower();
      }
    }
    return absl::OkStatus();
  }

  // Deviates: a direct cell that closes too few faces still fills space that the search found no
  // better use for.
  absl::Status AddRemainingDirectCells() {
    std::vector<int32_t> remaining;
    for (const int32_t i : waiting_) {
      if (table_.primitives[i].cube >= 0) remaining.push_back(i);
    }
    std::sort(remaining.begin(), remaining.end(),
              [&](int32_t a, int32_t b) { return HasPriority(table_, a, b); });
    for (const int32_t i : remaining) {
      AMHEX_RETURN_IF_ERROR(context_.CheckStop());
      if (!open_faces_->CanAdd(table_.primitives[i]) ||
          open_faces_->IsBehindHull(table_.primitives[i]) || conflicts_->IsInConflict(i)) {
        continue;
      }
      open_faces_->Add(i);
      conflicts_->Add(i);
    }
    return absl::OkStatus();
  }

 private:
  // Deviates: with direct cells the rest is filled by closure, so a primitive must not leave
  // more to fill than it found. The paper adds whatever closes enough faces.
  bool IsWorthwhile(const OpenFaces::Change& change) const {
    return params_.assembly.extraction == Extraction::kPaper || change.opened <= change.closed;
  }

  bool Qualifies(const Primitive& primitive, const Criteria& criteria) const {
    if (static_cast<int>(primitive.type) < criteria.type) return false;
    const OpenFaces::Change change = open_faces_->ChangeBy(primitive);
    return change.closed >= criteria.closed_faces && IsWorthwhile(change) &&
           primitive.quality > params_.assembly.min_quality && open_faces_->CanAdd(primitive) &&
           !open_faces_->IsBehindHull(primitive);
  }

  // Lines 4 to 11: the pre-selection, best first.
  std::vector<int32_t> Select(const Criteria& criteria) const {
    std::vector<Candidate> candidates;
    for (const int32_t i : waiting_) {
      const Primitive& primitive = table_.primitives[i];
      if (!Qualifies(primitive, criteria)) continue;
      candidates.push_back({i, static_cast<int>(primitive.type),
                            open_faces_->ChangeBy(primitive).closed, primitive.quality});
    }
    const auto key = [](const Candidate& c) {
      return std::make_tuple(-c.type, -c.closed_faces, -c.quality, c.primitive);
    };
    std::sort(candidates.begin(), candidates.end(),
              [&](const Candidate& a, const Candidate& b) { return key(a) < key(b); });
    std::vector<int32_t> selected;
    selected.reserve(candidates.size());
    for (const Candidate& candidate : candidates) selected.push_back(candidate.primitive);
    return selected;
  }

  // Lines 13 to 19. A primitive that stopped qualifying because of one just added waits for
  // another round; one in conflict never comes back.
  int AddBest(const std::vector<int32_t>& selected, const Criteria& criteria) {
    int added = 0;
    for (size_t i = 0; i < selected.size(); ++i) {
      if (i % kPrimitivesPerStopCheck == 0 && context_.ShouldStop()) break;
      const int32_t primitive = selected[i];
      if (!Qualifies(table_.primitives[primitive], criteria)) continue;
      if (!conflicts_->IsInConflict(primitive)) {
        open_faces_->Add(primitive);
        conflicts_->Add(primitive);
        ++added;
      }
      is_decided_[primitive] = 1;
    }
    std::erase_if(waiting_, [&](int32_t i) { return is_decided_[i] != 0; });
    return added;
  }

  const PrimitiveTable& table_;
  const MeshingParams& params_;
  const RunContext& context_;
  OpenFaces* open_faces_;
  ConflictFinder* conflicts_;
  std::vector<uint8_t> is_decided_;  // [primitive_count] tried: added, or in conflict
  std::vector<int32_t> waiting_;     // ascending: neither in the mesh nor ruled out
};

// The primitives whose neighbourhood matters: those not in the mesh and those with open faces.
std::vector<int32_t> PrimitivesToAskAbout(const PrimitiveTable& table, const OpenFaces& mesh) {
  std::vector<int32_t> asked = mesh.PrimitivesWithOpenFaces();
  for (int32_t i = 0; i < static_cast<int32_t>(table.primitives.size()); ++i) {
    if (!mesh.IsInMesh(i)) asked.push_back(i);
  }
  return asked;
}

CellComplex BuildComplex(const PrimitiveTable& table, const MergedCubes& cubes,
                         const OpenFaces& mesh) {
  CellComplex complex;
  complex.vertices = cubes.vertices;
  for (int32_t i = 0; i < static_cast<int32_t>(table.primitives.size()); ++i) {
    if (!mesh.IsInMesh(i)) continue;
    const Primitive& primitive = table.primitives[i];
    complex.cells.push_back(primitive.corners);
    for (int j = 0; j < primitive.face_count; ++j) {
      const HalfFaceId half_face = primitive.half_faces[j];
      const bool is_free = mesh.owner(OppositeOf(half_face)) == kNoPrimitive;
      if (is_free && table.on_hull[half_face] != 0) {
        complex.hull_faces.push_back(table.faces.half_face(half_face));
      }
    }
  }
  return complex;
}

}  // namespace

absl::StatusOr<CellComplex> AssembleCells(const PrimitiveTable& table, const MergedCubes& cubes,
                                          const MeshingParams& params, RunContext& context) {
  AMHEX_RETURN_IF_ERROR(context.CheckStop());
  OpenFaces mesh(table);
  AddWithoutSharedHalfFaces(table, &mesh);
  AMHEX_RETURN_IF_ERROR(context.CheckStop());
  ConflictFinder conflicts(table, cubes.vertices, PrimitivesToAskAbout(table, mesh));
  for (int32_t i = 0; i < table.initial_count; ++i) {
    if (mesh.IsInMesh(i)) conflicts.Add(i);
  }
  AMHEX_RETURN_IF_ERROR(RemoveOverlaps(table, context, &mesh, &conflicts));
  Assembler assembler(table, params, context, &mesh, &conflicts);
  AMHEX_RETURN_IF_ERROR(assembler.AddWhatClosesFaces());
  AMHEX_RETURN_IF_ERROR(assembler.AddRemainingDirectCells());
  CellComplex complex = BuildComplex(table, cubes, mesh);
  ReportCells(complex, context);
  return complex;
}

}  // namespace amhex
