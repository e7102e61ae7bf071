// A patch of triangles and quads that closes a loop of a star's walls, seen from its apex: part of
// the hull, or a membrane that cuts the star off from the rest of a cavity.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "closure/working_mesh.h"
#include "input/hull.h"

namespace amhex {

enum class PatchKind : uint8_t {
  kHull,      // every face becomes hull
  kMembrane,  // faces between hull vertices become hull, others stay open
};

struct PatchRequest {
  const std::vector<int>& absorbed;  // cells that the star replaces, ascending
  const std::vector<int32_t>& loop;
  Vec3d apex;
  PatchKind kind = PatchKind::kHull;
};

struct HullPatch {
  std::vector<CellFace> faces;  // looking into the cavity
  double cost = 0;
};

// The cheapest polygonisation of the loop by dynamic programming: one per face, plus penalties for
// poor cells towards the apex, for chords off the hull and for folded quads. nullopt if there is
// none with positive cells. On the hull, chords that cells other than the absorbed ones have as an
// edge already are refused: the mesh would touch itself there. O(n^4) in the loop's length n, which
// is bounded.
std::optional<HullPatch> FindHullPatch(const WorkingMesh& mesh, const Hull& hull,
                                       const PatchRequest& request);

// Of the triangles and quads that close a loop: all quads but one at most.
inline size_t LeastPatchFaces(size_t loop_length) {
  return loop_length < 3 ? 0 : (loop_length - 1) / 2;
}

// True if just outside of a face that is to be hull, looking in, there is a cell that stays: where
// a part is hardly thicker than a cell, a loop that belongs to one of its sides can be closed from
// the other one, through the cells between.
bool RunsThroughCells(const WorkingMesh& mesh, const std::vector<CellFace>& faces,
                      const std::vector<int>& absorbed);

// Nearer than this to the hull, in edge lengths, a loop's vertex counts as lying on it.
inline constexpr double kOnHullDistance = 0.1;
bool IsOnHull(const Hull& hull, const Vec3d& p);

// True if a patch face between vertices on the hull follows it: it becomes hull.
bool FollowsHull(const Hull& hull, const CellFace& face, const std::vector<Vec3d>& vertices);

}  // namespace amhex
