// Graph matching and judgement as plain arrays: what crosses the border to the CUDA library that is
// loaded at run time.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "topology/primitive_judge.h"

namespace amhex {

// One type's search.
struct TypeSearch {
  PrimitiveProgram program;
  PrimitiveShape shape;
  CellPattern pattern;  // of the shape
};

// Views are on host arrays that outlive the task.
struct SearchPrimitivesTask {
  FaceComplexView complex;
  ArrayView<const Vec3d> vertices;
  std::vector<TypeSearch> types;
  double min_quality = 0;
  std::vector<Primitive> primitives;  // out: type by type; as they were unless it was done
  std::function<bool()> should_stop;  // may be empty
};

}  // namespace amhex
