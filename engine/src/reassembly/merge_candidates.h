// What neighbouring cells of a volume mesh could become together. Section 5.2, I and II, on the
// faces of an input's cells instead of merged cubes.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "reassembly/break_down.h"
#include "reassembly/merged_quads.h"
#include "topology/face_table.h"
#include "topology/primitive_table.h"

namespace amhex {

// Atoms are the volume's own cells, as numbered there. Pieces are what the mesh can be put together
// from: first one piece per atom, then every primitive that some atoms form together.
struct PieceTable {
  FaceTable faces;
  std::vector<uint8_t> on_hull;  // [half_face_count] 1 if the solid ends there
  std::vector<Primitive> pieces;
  int32_t atom_count = 0;

  std::vector<int32_t> first_atom;  // [piece_count + 1] rows of atoms_of
  std::vector<int32_t> atoms_of;
  std::span<const int32_t> atoms(int32_t piece) const {
    return {atoms_of.data() + first_atom[static_cast<size_t>(piece)],
            atoms_of.data() + first_atom[static_cast<size_t>(piece) + 1]};
  }
  int InnerQuads(int32_t piece) const {
    const Primitive& p = pieces[static_cast<size_t>(piece)];
    int count = 0;
    for (int i = 0; i < p.face_count; ++i) {
      const HalfFaceId face = p.half_faces[i];
      count += faces.face(FaceOf(face)).count == 4 && on_hull[static_cast<size_t>(face)] == 0;
    }
    return count;
  }
};

struct PieceLimits {
  double min_quality = 0;  // scaled Jacobian
  QuadLimits quads = kQuadsOfVolumes;
};

// Merged quads are pairs of triangles over a common edge, about plane and of fair angles, more
// strictly so on the hull. Primitives of merged and own faces are found by the graph search; those
// above the minimum quality that enclose nothing but atoms below the hexahedron become pieces.
// Hexahedra of the input are in no other piece than their own. O(n) in the cells for meshes of
// bounded degree.
absl::StatusOr<PieceTable> FindPieces(const BrokenVolume& volume, const PieceLimits& limits,
                                      RunContext& run);

}  // namespace amhex
