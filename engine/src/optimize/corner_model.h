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
// never negative: s (I - u u^T) / length^2 for each edge u that moves. Of one corner (Vector is
// Vec3d) or of lanes of corners; an Edge has a direction and an inverse_length.
template <class Vector>
class CornerModel {
 public:
  using Number = decltype(Vector::x);

  template <class Edge>
  AMHEX_LANES_TOO CornerModel(const Vector& normal, const Edge& edge) {
    AddEdge(normal, edge, Dot(normal, edge.direction));
  }
  template <class Edge>
  AMHEX_LANES_TOO CornerModel(const Number& sign, const Edge& a, const Edge& b, const Edge& c) {
    const Vector of_a = Cross(b.direction, c.direction) * sign;
    const Number jacobian = Dot(of_a, a.direction);
    AddEdge(of_a, a, jacobian);
    AddEdge(Cross(c.direction, a.direction) * sign, b, jacobian);
    AddEdge(Cross(a.direction, b.direction) * sign, c, jacobian);
  }
  // Adds what a penalty of this slope (negative) and curvature adds.
  template <class Model>
  AMHEX_LANES_TOO void AddTo(Model& model, const Number& slope, const Number& curvature) const {
    model.gradient += gradient_ * slope;
    for (int a = 0; a < 3; ++a) {
      const Number steep = curvature * gradient_[a];
      model.hessian[a] += gradient_ * steep - bend_[a] * slope;
    }
  }

 private:
  template <class Edge>
  AMHEX_LANES_TOO void AddEdge(const Vector& normal, const Edge& edge, const Number& jacobian) {
    const Vector& u = edge.direction;
    gradient_ -= (normal - u * jacobian) * edge.inverse_length;
    const Number bend =
        jacobian > 0 ? jacobian * edge.inverse_length * edge.inverse_length : Number{};
    for (int a = 0; a < 3; ++a) {
      const Number share = bend * u[a];
      bend_[a] -= u * share;
      bend_[a][a] += bend;
    }
  }
  Vector gradient_{};
  std::array<Vector, 3> bend_{};
};

}  // namespace amhex
