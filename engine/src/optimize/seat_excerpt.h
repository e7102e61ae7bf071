// One vertex more in the boundary of a placed mesh, with what is around it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "amhex/run_context.h"
#include "assembly/cell_complex.h"
#include "closure/excerpt.h"
#include "closure/working_mesh.h"
#include "optimize/hull_features.h"
#include "optimize/place_vertices.h"

namespace amhex {

// From a point to a face, taken as the fan of triangles around its middle.
double DistanceToFace(const Vec3d& p, const CellFace& face, const std::vector<Vec3d>& vertices);

// What a new vertex divides: a face of the boundary, or an edge where two of them meet.
struct Seat {
  std::vector<int> cells;        // all that have it, ascending
  std::vector<int32_t> corners;  // of the face, or both of the edge
  bool IsEdge() const { return corners.size() == 2; }
  bool IsIn(const CellFace& face) const;
};

// The face of the boundary that is nearest to a point, and its edges; none where there is no
// boundary. `whole` is the complex, `cells_at` its cells by vertex. O(faces of the boundary).
std::vector<Seat> SeatsAt(const Vec3d& p, const CellComplex& complex, const WorkingMesh& whole,
                          const CellLists& cells_at);

// A seat with everything around it that placing its vertex may look at.
class SeatExcerpt {
 public:
  SeatExcerpt(const WorkingMesh& whole, const CellLists& cells_at, const Seat& seat);

  // The part with a vertex at `at` in the seat, whose cells become pyramids and tetrahedra around
  // it, placed with this effort; nothing where a cell stays below both kBearable and the poorest
  // one that there was, or the run stops.
  std::optional<CellComplex> WithVertex(const Vec3d& at, const HullFeatures& features,
                                        PlacementEffort effort, const RunContext& run) const;
  // Such a part, its cells raised to the end; nothing where the run stops.
  std::optional<CellComplex> Raised(CellComplex part, const HullFeatures& features,
                                    const RunContext& run) const;
  // `whole` with such a part; nothing where it does not fit.
  std::optional<CellComplex> InWhole(const WorkingMesh& whole, const CellComplex& part,
                                     const StopPoll& poll) const;

 private:
  // The seat's cells become cells around the vertex.
  CellComplex Divided(const Vec3d& at) const;

  Excerpt excerpt_;
  Seat seat_;                   // in numbers of the excerpt
  std::vector<uint8_t> fixed_;  // [vertex of the excerpt]
};

}  // namespace amhex
