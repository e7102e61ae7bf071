#include "reassembly/reassemble.h"

#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "closure/working_mesh.h"
#include "input/build_hull.h"
#include "output/finalize_mesh.h"

namespace amhex {
namespace {

double MeanEdgeLength(const BrokenVolume& volume) {
  double sum = 0;
  int64_t count = 0;
  for (const CellCorners& cell : volume.cells) {
    for (const auto& [a, b] : EdgesOf(cell)) {
      sum +=
          Norm(volume.vertices[static_cast<size_t>(a)] - volume.vertices[static_cast<size_t>(b)]);
      ++count;
    }
  }
  return count > 0 ? sum / static_cast<double>(count) : 0;
}

}  // namespace

absl::StatusOr<Hull> BuildHullOfVolume(const BrokenVolume& volume, const MeshingParams& params,
                                       RunContext& run) {
  const double edge_length = MeanEdgeLength(volume);
  if (!(edge_length > 0)) {
    return absl::InvalidArgumentError("no cell of the volume mesh has a volume");
  }
  AMHEX_ASSIGN_OR_RETURN(Hull hull, BuildHullOfCells(BoundaryOf(volume), edge_length, params, run));
  if (volume.broken_count > 0) {
    hull.warnings.push_back(
        absl::StrCat("cells that are none of an at-most-hexa mesh, broken up around their centre: ",
                     volume.broken_count));
  }
  if (volume.hollow_count > 0) {
    hull.warnings.push_back(absl::StrCat(
        "cells too distorted to be kept, their place filled anew: ", volume.hollow_count));
  }
  return hull;
}

void AppendHullFaces(const PieceTable& table, const std::vector<int32_t>& chosen,
                     std::vector<CellFace>* faces) {
  for (const int32_t piece : chosen) {
    const Primitive& primitive = table.pieces[static_cast<size_t>(piece)];
    for (int i = 0; i < primitive.face_count; ++i) {
      const HalfFaceId face = primitive.half_faces[i];
      if (table.on_hull[static_cast<size_t>(face)] != 0) {
        faces->push_back(table.faces.half_face(face));
      }
    }
  }
}

CellComplex ComplexOfPieces(const BrokenVolume& volume, const PieceTable& table,
                            const std::vector<int32_t>& chosen, const Frame& frame) {
  CellComplex complex;
  complex.vertices.reserve(volume.vertices.size());
  for (const Vec3d& p : volume.vertices) complex.vertices.push_back(frame.ToNormalized(p));
  for (const int32_t piece : chosen) {
    complex.cells.push_back(table.pieces[static_cast<size_t>(piece)].corners);
  }
  AppendHullFaces(table, chosen, &complex.hull_faces);
  return complex;
}

bool HasOpenFaces(const CellComplex& complex) { return !WorkingMesh(complex).OpenFaces().empty(); }

AtMostHexaMesh FinalizeReassembled(const CellComplex& complex, const BrokenVolume& volume,
                                   const Frame& frame) {
  AtMostHexaMesh mesh = FinalizeMesh(complex, frame);
  std::vector<uint8_t> is_used(complex.vertices.size(), 0);
  for (const CellCorners& corners : complex.cells) {
    for (const int32_t v : corners) is_used[static_cast<size_t>(v)] = 1;
  }
  // FinalizeMesh keeps the vertices' order and drops unused ones.
  size_t final_id = 0;
  for (size_t v = 0; v < complex.vertices.size(); ++v) {
    if (is_used[v] == 0) continue;
    const bool is_unmoved =
        v < volume.vertices.size() && complex.vertices[v] == frame.ToNormalized(volume.vertices[v]);
    if (is_unmoved) mesh.vertices[final_id] = volume.vertices[v];
    ++final_id;
  }
  for (size_t i = 0; i < mesh.corners.size(); ++i) {
    mesh.quality[i] = static_cast<float>(ScaledJacobian(mesh.corners[i], mesh.vertices));
  }
  return mesh;
}

}  // namespace amhex
