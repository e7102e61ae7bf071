// Questions to the hull for many points at once: what crosses the border to the CUDA library that
// is loaded at run time.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/array_view.h"
#include "exec/resident_slot.h"
#include "input/hull_view.h"

namespace amhex {

enum class HullSide : uint8_t { kOutside = 0, kInside = 1, kNear = 2 };

// Points given one by one; a question may have others that follow from less (Points).
struct PlainPoints {
  ArrayView<const Vec3d> position;

  int64_t count() const { return position.size; }
  AMHEX_HD const Vec3d& operator[](int64_t i) const { return position[i]; }
  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(position);
  }
};
inline PlainPoints PointsOf(const std::vector<Vec3d>& points) {
  return {{points.data(), static_cast<int64_t>(points.size())}};
}

// A question is a body that answers for the i-th of its points:
//
// on which side it is; points at most `near` from the hull are not asked for theirs.
template <class Points>
struct SideOf {
  using Answer = HullSide;
  Points points;
  double near = -1;  // edge lengths; negative: no point is near
  AMHEX_HD HullSide operator()(const HullView& hull, int64_t i) const {
    const Vec3d p = points[i];
    if (IsNear(hull, p)) return HullSide::kNear;
    return hull.IsInside(p) ? HullSide::kInside : HullSide::kOutside;
  }
  AMHEX_HD bool IsNear(const HullView& hull, const Vec3d& p) const {
    return near >= 0 && hull.IsWithin(p, near);
  }
};

// How far the hull is, in edge lengths.
template <class Points>
struct DistanceTo {
  using Answer = double;
  Points points;
  double enough = 0;  // up to this any distance not above it is as good an answer, which is sooner
  AMHEX_HD double operator()(const HullView& hull, int64_t i) const {
    return hull.Closest(points[i]).distance;
  }
};

// The point of the hull that is nearest.
template <class Points>
struct ClosestTo {
  using Answer = Vec3d;
  Points points;
  AMHEX_HD Vec3d operator()(const HullView& hull, int64_t i) const {
    return hull.Closest(points[i]).point;
  }
};

// How often the hull winds around.
template <class Points>
struct WindingAround {
  using Answer = double;
  Points points;
  AMHEX_HD double operator()(const HullView& hull, int64_t i) const {
    return hull.WindingNumber(points[i]);
  }
};

// Views are on host arrays that outlive the batch.
template <class Question>
struct HullBatch {
  HullView hull;
  ResidentSlot* resident = nullptr;  // the hull's, never null
  Question question;
  std::vector<typename Question::Answer> answers;  // out: by point; as they were unless it was done
  std::function<bool()> should_stop;               // may be empty; asked from several threads
};

// Asks one question and keeps the answer.
template <class Question>
struct AskBody {
  HullView hull;
  Question question;
  ArrayView<typename Question::Answer> answers;
  AMHEX_HD void operator()(int64_t i) const { answers[i] = question(hull, i); }
};

}  // namespace amhex
