#include "assembly/assemble.h"

#include "assembly/initial_mesh.h"
#include "assembly/open_faces.h"

namespace amhex {
namespace {

CellComplex BuildComplex(const PrimitiveTable& table, const MergedCubes& cubes,
                         const std::vector<uint8_t>& in_mesh, const OpenFaces& open_faces) {
  CellComplex complex;
  complex.vertices = cubes.vertices;
  for (size_t i = 0; i < table.primitives.size(); ++i) {
    if (in_mesh[i] == 0) continue;
    const Primitive& primitive = table.primitives[i];
    complex.cells.push_back(primitive.corners);
    for (int j = 0; j < primitive.face_count; ++j) {
      const HalfFaceId half_face = primitive.half_faces[j];
      const bool is_free = open_faces.owner(OppositeOf(half_face)) == kNoPrimitive;
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
  (void)params;
  OpenFaces open_faces(table);
  std::vector<uint8_t> in_mesh = ChooseInitialMesh(table, &open_faces);
  if (absl::Status status = context.CheckStop(); !status.ok()) return status;
  return BuildComplex(table, cubes, in_mesh, open_faces);
}

}  // namespace amhex
