// Which cells are exact unions of Delaunay tetrahedra, and what lies across a tetrahedron's face.
#pragma once

#include <cstdint>
#include <vector>

#include "closure/delaunay.h"
#include "closure/fill_scope.h"
#include "closure/working_mesh.h"

namespace amhex {

class TetrahedralCover {
 public:
  // Who occupies a tetrahedron.
  static constexpr int32_t kFree = -1;
  static constexpr int32_t kVanished = -2;  // flat, on a quad of a covered cell: no volume
  static constexpr int32_t kOutside = -3;   // has the infinite vertex

  // Tetrahedra over all vertices of the scope's cells and `extra_vertices`, Delaunay in the scope's
  // metric.
  TetrahedralCover(const WorkingMesh& mesh, const FillScope& scope,
                   const std::vector<int>& extra_vertices, uint64_t seed);

  // Marks all cells of the scope that are unions, except those with excluded[cell] set. May be
  // called again.
  void CoverCells(const std::vector<uint8_t>& excluded);

  const Tetrahedra& tetrahedra() const { return tetrahedra_; }  // with the mesh's vertex ids
  int32_t occupant(int t) const { return occupant_[t]; }        // a cell or one of the above
  bool IsCovered(int cell) const { return covered_[cell] != 0; }

  // What a walk meets behind corner `i` of a tetrahedron.
  struct Neighbour {
    int tetrahedron = -1;  // set if free or outside
    int cell = -1;         // set if a covered cell: its face
    CellFace face;
  };
  Neighbour Across(int t, int i) const;

  // Free tetrahedra that touch the given face of a covered cell from beyond.
  std::vector<int> TetrahedraBehind(int cell, const CellFace& face) const;

  // The tetrahedron that contains a point, searched from the given vertex; -1 if not found.
  int Containing(const Vec3d& p, int32_t near_vertex) const;

 private:
  std::vector<int> TetrahedraWithin(const CellVertices& vertices) const;
  bool FindUnion(int cell, std::vector<int>* solid, std::vector<int>* flat) const;

  const WorkingMesh& mesh_;
  const FillScope& scope_;
  Tetrahedra tetrahedra_;
  std::vector<int> incident_begin_, incident_;  // CSR: tetrahedra at each mesh vertex
  std::vector<int32_t> occupant_;
  std::vector<int32_t> flat_cell_;  // [tetrahedron] a covered cell whose quad a vanished one is on
  std::vector<uint8_t> covered_;
};

}  // namespace amhex
