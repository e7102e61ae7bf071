// Makes one short edge longer: a step of lengthen_edges.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "optimize/hull_deviation.h"
#include "optimize/placement.h"
#include "optimize/press_vertex.h"
#include "optimize/seen_vertices.h"

namespace amhex {

using VertexPair = std::array<int32_t, 2>;

struct LengthAim {
  double length = 0;  // edges are to be so long
  double floor = 0;   // no cell that is better falls below
  // What the cells around may lack more than before, in sum, to a scaled Jacobian of 1.
  double most_loss = 0;
};

// Edges that are to be so long at most are lengthened along or away from a crease, whatever that
// does to it.
inline constexpr double kUrgentLength = 0.05;

// What lengthening an edge looked at and did, so that it need not be found out again.
struct LengthenedEdge {
  struct Move {
    int32_t vertex;
    Vec3d place;
  };
  bool is_long_enough = false;  // then
  std::vector<int32_t> seen;    // vertices whose places decided
  std::vector<Move> moves;      // none if it stayed
};

class EdgeLengthener {
 public:
  // `placement`'s cells, constraints and faces must be those of the sampling. Both must outlive
  // this.
  EdgeLengthener(Placement& placement, const HullSampling& sampling, const LengthAim& aim);

  // Moves one end of the edge along it, if need be with vertices inside giving way. The record
  // holds until the next call, and may be changed. Work: that of a few dozen vertices.
  LengthenedEdge& Run(const VertexPair& edge);

 private:
  struct QualityThere {
    double least = 1;
    double lack = 0;  // to 1, in sum
  };
  struct Move {
    int32_t vertex = -1;
    Vec3d place;
    QualityThere there;
  };

  bool Lengthen(const VertexPair& edge);
  Constraint KindOf(int32_t vertex) const { return placement_.constraints.vertex[vertex].kind; }
  bool IsPermitted(int32_t vertex, const Vec3d& place);
  bool ShortensAnother(int32_t vertex, int32_t other, const Vec3d& place) const;
  QualityThere QualityAt(int32_t vertex, const Vec3d& place);
  bool PutAt(const Move& move);
  bool PressAt(const Move& move);
  double ShortnessOf(const std::vector<int32_t>& cells) const;

  Placement& placement_;
  const HullSampling& sampling_;
  const DeviationLimits limits_;
  const LengthAim aim_;
  VertexPress press_;
  LengthenedEdge record_;
  SeenVertices seen_;
};

}  // namespace amhex
