// How the energy around a vertex changes as it moves, to the second order; usable where bodies run.
#pragma once

#include <array>
#include <cstdint>

#include "amhex/vec3.h"
#include "base/platform.h"

namespace amhex {

// An edge from the vertex to another one.
struct MovingEdge {
  int32_t far_vertex;
  Vec3d far_end;
  Vec3d direction;  // unit, towards the far end; zero for an edge without length
  double inverse_length;
};

// The energy around a place, to the second order.
struct EnergyModel {
  Vec3d gradient;
  std::array<Vec3d, 3> hessian;  // rows; positive semidefinite
};

// The model of one corner's scaled Jacobian s: its gradient, and the part of -(its Hessian) that is
// never negative: s (I - u u^T) / length^2 for each edge u that moves.
class CornerModel {
 public:
  AMHEX_HD CornerModel(const Vec3d& normal, const MovingEdge& edge) {
    AddEdge(normal, edge, Dot(normal, edge.direction));
  }
  AMHEX_HD CornerModel(double sign, const MovingEdge& a, const MovingEdge& b, const MovingEdge& c) {
    const Vec3d of_a = Cross(b.direction, c.direction) * sign;
    const double jacobian = Dot(of_a, a.direction);
    AddEdge(of_a, a, jacobian);
    AddEdge(Cross(c.direction, a.direction) * sign, b, jacobian);
    AddEdge(Cross(a.direction, b.direction) * sign, c, jacobian);
  }
  // Adds what a penalty of this slope (negative) and curvature adds.
  AMHEX_HD void AddTo(EnergyModel& model, double slope, double curvature) const {
    model.gradient += gradient_ * slope;
    for (int a = 0; a < 3; ++a) {
      model.hessian[a] += gradient_ * (curvature * gradient_[a]) - bend_[a] * slope;
    }
  }

 private:
  AMHEX_HD void AddEdge(const Vec3d& normal, const MovingEdge& edge, double jacobian) {
    const Vec3d& u = edge.direction;
    gradient_ -= (normal - u * jacobian) * edge.inverse_length;
    const double bend = jacobian > 0 ? jacobian * edge.inverse_length * edge.inverse_length : 0.0;
    for (int a = 0; a < 3; ++a) {
      bend_[a] -= u * (bend * u[a]);
      bend_[a][a] += bend;
    }
  }
  Vec3d gradient_;
  std::array<Vec3d, 3> bend_;
};

}  // namespace amhex
