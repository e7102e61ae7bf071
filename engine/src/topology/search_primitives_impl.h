// The search of search_primitives_task.h with arrays where bodies run.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "exec/counted_list.h"
#include "exec/executor.h"
#include "exec/uploaded_arrays.h"
#include "topology/search_primitives_task.h"

namespace amhex {

// Memory where bodies run, but for the sums and scans.
template <class E>
int64_t SearchPrimitivesBytes(const SearchPrimitivesTask& task) {
  // In a lattice every third face starts a hexahedron, and there is little else.
  constexpr int64_t kFacesPerPrimitive = 3;
  const int64_t face_count = task.complex.faces.size;
  return UploadedArrays<E>::Bytes(task.complex) +
         task.vertices.size * static_cast<int64_t>(sizeof(Vec3d)) +
         ListItemsBytes<GoodPrimitiveSearch>(face_count, face_count / kFacesPerPrimitive);
}

// False if it was stopped.
template <class E>
bool SearchAllTypes(E& executor, SearchPrimitivesTask& task) {
  UploadedArrays<E> arrays(executor);
  const FaceComplexView complex = arrays.Upload(task.complex);
  const ArrayView<const Vec3d> vertices = arrays.UploadArray(task.vertices);
  std::vector<Buffer<E, Primitive>> found;
  size_t count = 0;
  for (const TypeSearch& type : task.types) {
    const Buffer<E, CellPattern> pattern = Uploaded(executor, &type.pattern, 1);
    const GoodPrimitiveSearch search{{complex, type.program, type.shape},
                                     {vertices, pattern.View(), task.min_quality}};
    found.push_back(ListItems(executor, "search primitives", complex.faces.size, search));
    if (executor.Stopped()) return false;
    count += static_cast<size_t>(found.back().size());
  }
  std::vector<Primitive> primitives(count);
  Primitive* next = primitives.data();
  for (const Buffer<E, Primitive>& of_type : found) {
    executor.CopyOutLater(of_type, of_type.size(), next);
    next += of_type.size();
  }
  executor.Synchronize();
  if (executor.Stopped()) return false;
  task.primitives = std::move(primitives);
  return true;
}

}  // namespace amhex
