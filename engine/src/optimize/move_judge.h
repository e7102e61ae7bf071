// The rules that every move of a vertex obeys; usable where bodies run.
#pragma once

#include <array>
#include <cstdint>

#include "optimize/local_cells.h"
#include "optimize/placement_view.h"

namespace amhex {

// Least agreement (cosine) between the corner normals of the hull faces at `vertex`, were it at
// `position`, and the hull's normals there; 1 without hull faces.
AMHEX_HD inline double WorstNormalAgreement(const PlacementView& placement, int32_t vertex,
                                            const Vec3d& position) {
  const auto at = [&](int32_t v) -> const Vec3d& {
    return v == vertex ? position : placement.vertices.data[v];
  };
  double worst = 1;
  const ArrayView<const int32_t> faces = placement.hull_faces_at[vertex];
  for (int64_t k = 0; k < faces.size; ++k) {
    const CellFace& face = placement.hull_faces[faces[k]];
    const int corner_count = face.count == 3 ? 1 : 4;
    for (int j = 0; j < corner_count; ++j) {
      const Vec3d& corner = at(face.v[j]);
      const Vec3d to_next = at(face.v[(j + 1) % face.count]) - corner;
      const Vec3d to_previous = at(face.v[(j + face.count - 1) % face.count]) - corner;
      const Vec3d normal = Normalized(Cross(to_next, to_previous));
      const double agreement = Dot(normal, placement.face_normal[faces[k]]);
      worst = agreement < worst ? agreement : worst;
    }
  }
  return worst;
}

// The middle of a hull face, were its corner `vertex` at `position`.
AMHEX_HD inline Vec3d MiddleOfFace(const PlacementView& placement, int32_t f, int32_t vertex,
                                   const Vec3d& position) {
  const CellFace& face = placement.hull_faces[f];
  Vec3d middle;
  for (int j = 0; j < face.count; ++j) {
    middle += face.v[j] == vertex ? position : placement.vertices[face.v[j]];
  }
  return middle / static_cast<double>(face.count);
}

// Judges moves of one vertex. A move may not let any incident cell's scaled Jacobian fall below
// both what the worst one had and `floor`, nor fold a cell, nor turn a hull face away from the
// hull. Cells are LocalCells, LaneCells where there are lanes, or TeamCells where threads share a
// vertex.
template <class Cells>
class MoveJudge {
 public:
  // `room` as for LocalCells.
  AMHEX_HD MoveJudge(const PlacementView& placement, int32_t vertex, const CornerPenalty& penalty,
                     FoldWatch watch, LocalCell* room)
      : placement_(placement),
        vertex_(vertex),
        start_(placement.vertices[vertex]),
        cells_(placement, vertex, penalty, watch, room),
        score_(cells_.Score()) {}

  AMHEX_HD const LocalScore& score() const { return score_; }  // where the vertex is now
  AMHEX_HD Cells& cells() { return cells_; }

  // Scaled Jacobians at `position`; leaves the trial there.
  AMHEX_HD LocalScore Try(const Vec3d& position) {
    cells_.MoveTo(position);
    return cells_.Score();
  }

  // May the vertex stay at the position last tried, which scored `trial`?
  AMHEX_HD bool Permits(const LocalScore& trial, double floor) {
    if (!(trial.minimum >= Smaller(score_.minimum, floor))) return false;
    return KeepsToHull() && DoesNotFold();
  }

 private:
  AMHEX_HD bool KeepsToHull() {
    // Hull faces whose corner normals agree less with the hull fold over it: a closed conforming
    // mesh can overlap itself there.
    constexpr double kMinNormalAgreement = 0.3;
    if (placement_.constraints[vertex_].kind == Constraint::kFree) return true;
    const Vec3d& tried = cells_.position();
    const double agreement = WorstNormalAgreement(placement_, vertex_, tried);
    if (agreement < kMinNormalAgreement &&
        agreement < WorstNormalAgreement(placement_, vertex_, start_)) {
      return false;
    }
    return SagIsPermitted(tried);
  }

  AMHEX_HD bool DoesNotFold() {
    const double margin = cells_.WorstFoldMargin();
    if (margin > 0) return true;
    // Cells that fold already may only unfold.
    const Vec3d tried = cells_.position();
    cells_.MoveTo(start_);
    const double margin_before = cells_.WorstFoldMargin();
    cells_.MoveTo(tried);
    return margin > margin_before;
  }

  // True if no hull face at the vertex sags by more than it may, or than it did before.
  AMHEX_HD bool SagIsPermitted(const Vec3d& position) {
    // Hull faces whose middle is nearer to the hull than this many edge lengths may sag freely.
    constexpr double kFreeSag = 0.14;
    const ArrayView<const int32_t> faces = placement_.hull_faces_at[vertex_];
    // The one that refused the last trial most likely refuses this one as well.
    return cells_.HoldForAll(faces.size, refusing_face_, [&](int64_t k) {
      const Vec3d middle = MiddleOfFace(placement_, faces[k], vertex_, position);
      if (MiddleIsWithin(placement_, faces[k], middle, kFreeSag) ||
          MiddleIsWithin(placement_, faces[k], middle, SagBefore(k))) {
        return true;
      }
      refusing_face_ = k;
      return false;
    });
  }

  // How far the middle of the k-th hull face at the vertex was from the hull before.
  AMHEX_HD double SagBefore(int64_t k) {
    if (k < kRemembered && sag_before_[k] >= 0) return sag_before_[k];
    const int32_t face = placement_.hull_faces_at[vertex_][k];
    const double sag =
        placement_.features.hull.Closest(MiddleOfFace(placement_, face, vertex_, start_)).distance;
    if (k < kRemembered) sag_before_[k] = sag;
    return sag;
  }

  // Few vertices have more hull faces; those of the others are asked for again.
  static constexpr int64_t kRemembered = 6;

  const PlacementView& placement_;
  int32_t vertex_;
  Vec3d start_;
  Cells cells_;
  LocalScore score_;
  int64_t refusing_face_ = 0;  // index in the vertex's hull faces
  std::array<double, kRemembered> sag_before_ = {-1, -1, -1, -1, -1, -1};  // < 0: not known yet
};

}  // namespace amhex
