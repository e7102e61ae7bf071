// Where the boundary of a placed mesh gets another vertex, or loses one, with what is around.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "closure/excerpt.h"
#include "closure/working_mesh.h"
#include "input/hull.h"
#include "optimize/hull_features.h"
#include "optimize/place_refill.h"
#include "optimize/place_vertices.h"

namespace amhex {

// From a point to a face, taken as the fan of triangles around its middle.
double DistanceToFace(const Vec3d& p, const CellFace& face, const std::vector<Vec3d>& vertices);

enum class SeatUse : uint8_t {
  kDivide,  // cells become pyramids and tetrahedra around a new vertex in their face or edge
  kRefill,  // a vertex goes with its cells, and the room that they leave is filled anew
  kCutOff,  // cells go
};

// Where a boundary is changed: in a face, in an edge where two of them meet, or at a vertex, of the
// boundary or within.
struct Seat {
  SeatUse use = SeatUse::kDivide;
  std::vector<int> cells;        // all that have it, or those of them that go; ascending
  std::vector<int32_t> corners;  // of the face, both of the edge, or the vertex
  bool IsEdge() const { return corners.size() == 2; }
  bool IsIn(const CellFace& face) const;
};

// An edge, to be divided.
Seat SeatInEdge(int32_t a, int32_t b, const WorkingMesh& whole, const CellLists& cells_at);

// For a point of the boundary that should be at `wanted`: the nearest face and its edges, to be
// divided, and last the nearest of its vertices: to be cut off with its cells where the boundary
// should be farther in and these are few, to be refilled otherwise. None where there is no
// boundary. `whole` is the complex, `cells_at` its cells by vertex. O(faces of the boundary).
std::vector<Seat> SeatsAt(const Vec3d& p, const Vec3d& wanted, const CellComplex& complex,
                          const WorkingMesh& whole, const CellLists& cells_at);

// For a point of the boundary: the vertices within, of the nearest cell, at which cells with faces
// of the boundary lie outside of the hull, as over a groove: these cells are to be cut off. None
// where they are many. O(faces of the boundary).
std::vector<Seat> SeatsUnder(const Vec3d& p, const CellComplex& complex, const WorkingMesh& whole,
                             const CellLists& cells_at, const HullQueries& hull);

// A seat with everything around it that placing its vertex may look at.
class SeatExcerpt {
 public:
  SeatExcerpt(const WorkingMesh& whole, const CellLists& cells_at, const Seat& seat);

  // The part with its seat used, what is divided at `at`, placed with this effort; nothing where a
  // cell stays below both kBearable and the poorest one that there was, what would be cut off is no
  // lump on the boundary, nothing fills the room, or the run stops.
  std::optional<CellComplex> Changed(const Vec3d& at, PlacementEffort effort,
                                     const RefillWith& with) const;
  // Such a part, its cells raised to the end; nothing where the run stops.
  std::optional<CellComplex> Raised(CellComplex part, const HullFeatures& features,
                                    const RunContext& run) const;
  // `whole` with such a part; nothing where it does not fit.
  std::optional<CellComplex> InWhole(const WorkingMesh& whole, const CellComplex& part,
                                     const StopPoll& poll) const;

  SeatUse use() const { return seat_.use; }
  const CellComplex& before() const { return excerpt_.complex(); }

 private:
  CellComplex Divided(const Vec3d& at) const;
  std::optional<CellComplex> Refilled(const RefillWith& with) const;
  std::optional<CellComplex> CutOff() const;

  Excerpt excerpt_;
  Seat seat_;                   // in numbers of the excerpt
  std::vector<uint8_t> fixed_;  // [vertex of the excerpt]
};

}  // namespace amhex
