#include "geometry/merge_sets.h"

#include "base/array_view_of.h"

namespace amhex {

MergeSets::MergeSets(const Cubes& cubes) {
  const size_t count = 8 * cubes.centre.size();
  parent_.resize(count), size_.resize(count), ring_next_.resize(count);
  low_.resize(count), high_.resize(count);
  matches_.assign(cubes.centre.size(), {-1, -1, -1, -1, -1, -1});
  const auto face_count = static_cast<int64_t>(6 * matches_.size());
  int32_t* const first_face = matches_.empty() ? nullptr : matches_.data()->data();
  view_ = {cubes.view(),
           WritableViewOf(parent_),
           WritableViewOf(size_),
           WritableViewOf(ring_next_),
           WritableViewOf(low_),
           WritableViewOf(high_),
           {first_face, face_count}};
  for (int64_t v = 0; v < view_.parent.size; ++v) view_.Start(v);
}

}  // namespace amhex
