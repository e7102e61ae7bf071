// A part of a mesh, to be changed on its own and put back.
#pragma once

#include <cstdint>
#include <vector>

#include "assembly/cell_complex.h"
#include "closure/working_mesh.h"

namespace amhex {

using CellLists = std::vector<std::vector<int>>;  // [vertex] living cells at it

// The cells and those that share a vertex with any of them, ascending.
std::vector<int> WithRing(const WorkingMesh& mesh, const CellLists& cells_at,
                          const std::vector<int>& cells);

class Excerpt {
 public:
  // `cells`: living cells of `whole`, ascending.
  Excerpt(const WorkingMesh& whole, std::vector<int> cells);

  // Its vertices and cells have numbers of their own; the cells are in the order of cells().
  const CellComplex& complex() const { return complex_; }
  const std::vector<int>& cells() const { return cells_; }            // numbers in the whole
  const std::vector<int32_t>& vertices() const { return vertices_; }  // numbers in the whole
  // Whether a vertex of complex() is on a face towards the rest of the mesh.
  bool IsAtCut(int32_t vertex) const { return is_at_cut_[vertex] != 0; }
  // The complex with the faces towards the rest of the mesh declared hull, so that nothing is open.
  CellComplex Closed() const;
  // The number of a cell of the whole in complex(). O(log n).
  int32_t CellOf(int cell_of_whole) const;

  // A changed version of Closed(), its vertices the old ones followed by new ones, without what
  // Closed() has declared. False if it has open faces, or cells at the rest of the mesh are not the
  // same any more.
  bool TakeBack(CellComplex* changed) const;
  // Replaces the excerpt's cells in `whole` by those of a complex that TakeBack has accepted, and
  // moves the vertices. False, and `whole` is spoiled, if new cells collide with others.
  bool PutInto(const CellComplex& changed, WorkingMesh* whole) const;

 private:
  std::vector<int> cells_;
  std::vector<int32_t> vertices_;
  std::vector<CellFace> cut_;       // outward faces towards the rest, in numbers of the excerpt
  std::vector<uint8_t> is_at_cut_;  // [vertex]
  CellComplex complex_;
};

}  // namespace amhex
