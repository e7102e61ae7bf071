// The hull's features with their arrays where bodies run: those of all patches one behind the
// other, so that many patches cost no more copies than one. The hull as a whole has its own copy
// (hull_batch_impl.h).
#pragma once

#include <cstdint>
#include <vector>

#include "base/array_view_of.h"
#include "exec/uploaded_arrays.h"
#include "optimize/feature_view.h"

namespace amhex {

// Arrays of several owners, one behind the other.
template <class T>
class JoinedArrays {
 public:
  void Append(ArrayView<const T> part) {
    joined_.insert(joined_.end(), part.data, part.data + part.size);
  }
  int64_t Bytes() const { return static_cast<int64_t>(joined_.size() * sizeof(T)); }

  template <class E>
  void Upload(UploadedArrays<E>& arrays) {
    rest_ = arrays.UploadArray(Joined()).data;
    joined_ = {};
  }
  // The uploaded copy of the next part, in the order of Append.
  ArrayView<const T> Take(ArrayView<const T> part) {
    const T* const first = rest_;
    rest_ += part.size;
    return {first, part.size};
  }

 private:
  ArrayView<const T> Joined() const {
    return {joined_.data(), static_cast<int64_t>(joined_.size())};
  }
  std::vector<T> joined_;
  const T* rest_ = nullptr;
};

class FeatureUpload {
 public:
  explicit FeatureUpload(const FeatureView& host) : host_(host) {
    // Winding numbers are not asked for, so the dipoles stay.
    for (int64_t i = 0; i < host.patches.size; ++i) {
      if (!IsWholeHull(host.patches[i])) Append(host.patches[i]);
    }
    for (int64_t i = 0; i < host.creases.size; ++i) {
      segments_.Append(host.creases[i].segments.segments);
      segment_nodes_.Append(host.creases[i].segments.nodes);
    }
  }

  // Memory where bodies run; before Upload.
  int64_t Bytes() const {
    return triangles_.Bytes() + normals_.Bytes() + original_.Bytes() + nodes_.Bytes() +
           segments_.Bytes() + segment_nodes_.Bytes() +
           host_.patches.size * static_cast<int64_t>(sizeof(HullView)) +
           host_.creases.size * static_cast<int64_t>(sizeof(CreaseView)) +
           host_.corners.size * static_cast<int64_t>(sizeof(Vec3d));
  }

  // Given the copy of the hull. Once.
  template <class E>
  FeatureView Upload(UploadedArrays<E>& arrays, const HullView& hull_there) {
    triangles_.Upload(arrays), normals_.Upload(arrays), original_.Upload(arrays);
    nodes_.Upload(arrays), segments_.Upload(arrays), segment_nodes_.Upload(arrays);
    FeatureView there;
    there.hull = hull_there;
    std::vector<HullView> patches;
    for (int64_t i = 0; i < host_.patches.size; ++i) {
      const HullView& patch = host_.patches[i];
      patches.push_back(IsWholeHull(patch) ? hull_there : Take(patch));
    }
    std::vector<CreaseView> creases;
    for (int64_t i = 0; i < host_.creases.size; ++i) {
      const CreaseView& crease = host_.creases[i];
      creases.push_back(
          {crease.low,
           crease.high,
           {segments_.Take(crease.segments.segments), segment_nodes_.Take(crease.segments.nodes)}});
    }
    there.patches = arrays.UploadArray(ArrayViewOf(patches));
    there.creases = arrays.UploadArray(ArrayViewOf(creases));
    there.corners = arrays.UploadArray(host_.corners);
    return there;
  }

 private:
  // A hull without creases is one patch, and shares its arrays.
  bool IsWholeHull(const HullView& patch) const {
    return patch.triangles.data == host_.hull.triangles.data;
  }
  void Append(const HullView& part) {
    triangles_.Append(part.triangles), normals_.Append(part.normals);
    original_.Append(part.original), nodes_.Append(part.nodes);
  }
  HullView Take(const HullView& part) {
    return {triangles_.Take(part.triangles),
            normals_.Take(part.normals),
            original_.Take(part.original),
            nodes_.Take(part.nodes),
            {},
            {}};
  }

  FeatureView host_;
  JoinedArrays<HullTriangle> triangles_;
  JoinedArrays<Vec3d> normals_;
  JoinedArrays<int32_t> original_;
  JoinedArrays<HullNode> nodes_;
  JoinedArrays<LineSegment> segments_;
  JoinedArrays<SegmentNode> segment_nodes_;
};

}  // namespace amhex
