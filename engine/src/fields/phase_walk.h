// How phases are carried on from node to node (phase_seeds.h); usable where bodies run.
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "base/array_view.h"
#include "fields/linear_operators.h"

namespace amhex::fields {

inline constexpr int32_t kNeverReached = std::numeric_limits<int32_t>::max();

// Numbers of nodes, 3 * node + axis, by the step of the walk that reached them. In one step every
// number that has a neighbour of earlier steps is carried on from the first of those: so it does
// not matter in which order a step's numbers are looked at, or whether all at once.
struct PhaseWalk {
  PhaseOperator matrix;
  ArrayView<float> x;       // [6 * node + 2 * axis] real and imaginary part
  ArrayView<int32_t> step;  // [3 * node + axis] kNeverReached where none has

  AMHEX_HD bool IsReached(int64_t u) const { return StepOf(u) != kNeverReached; }

  AMHEX_HD void Start(int64_t u, int32_t now) const {
    x[2 * u] = 1, x[2 * u + 1] = 0;
    SetStep(u, now);
  }

  // Whether `u` was reached; it has not been before.
  AMHEX_HD bool Reach(int64_t u, int32_t now) const {
    const int64_t i = u / 3;
    const int a = static_cast<int>(u % 3);
    for (int d = 0; d < 3; ++d) {
      if (const int64_t v = NumberAhead(i, a, d); v >= 0 && StepOf(v) < now) {
        return Set(u, now, matrix.FromAhead(i, d, a, x.data));
      }
      if (const int64_t v = NumberBehind(i, a, d); v >= 0 && StepOf(v) < now) {
        return Set(u, now, matrix.FromBehind(i, d, a, x.data));
      }
    }
    return false;
  }

  // Calls visit(v) for the numbers of neighbours that are the same axis' as `u`.
  template <class Visit>
  AMHEX_HD void VisitNeighbours(int64_t u, const Visit& visit) const {
    const int64_t i = u / 3;
    const int a = static_cast<int>(u % 3);
    for (int d = 0; d < 3; ++d) {
      if (const int64_t v = NumberAhead(i, a, d); v >= 0) visit(v);
      if (const int64_t v = NumberBehind(i, a, d); v >= 0) visit(v);
    }
  }

 private:
  // Others may be setting theirs at the same time.
  AMHEX_HD int32_t StepOf(int64_t u) const {
#if defined(__CUDA_ARCH__)
    return *static_cast<const volatile int32_t*>(&step[u]);
#else
    return __atomic_load_n(&step[u], __ATOMIC_RELAXED);
#endif
  }
  AMHEX_HD void SetStep(int64_t u, int32_t now) const {
#if defined(__CUDA_ARCH__)
    *static_cast<volatile int32_t*>(&step[u]) = now;
#else
    __atomic_store_n(&step[u], now, __ATOMIC_RELAXED);
#endif
  }
  AMHEX_HD int64_t NumberAhead(int64_t i, int a, int d) const {
    const int64_t j = matrix.links.Ahead(i, d);
    return j < 0 ? -1 : 3 * j + matrix.links.RenamingAt(i, d).source[a];
  }
  AMHEX_HD int64_t NumberBehind(int64_t i, int a, int d) const {
    const int64_t j = matrix.links.Behind(i, d);
    return j < 0 ? -1 : 3 * j + matrix.links.RenamingAt(j, d).inverse[a];
  }
  // What is carried on has unit length, as nothing in between made it longer or shorter but by
  // rounding and the lengths of the first ones.
  AMHEX_HD bool Set(int64_t u, int32_t now, const PhaseNumber& number) const {
    const double real = number.real, imaginary = number.imaginary;
    const double length = std::sqrt(real * real + imaginary * imaginary);
    x[2 * u] = static_cast<float>(real / length);
    x[2 * u + 1] = static_cast<float>(imaginary / length);
    SetStep(u, now);
    return true;
  }
};

// Numbers shorter than kWeakPhase are to be reached by a walk from the others.
inline constexpr double kWeakPhase = 0.01;
AMHEX_HD inline bool IsWeakPhase(const float* x, int64_t u) {
  const double real = x[2 * u], imaginary = x[2 * u + 1];
  return real * real + imaginary * imaginary < kWeakPhase * kWeakPhase;
}

}  // namespace amhex::fields
