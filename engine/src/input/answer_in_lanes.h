// Answers for up to eight points that follow each other, with the bits of single ones: winding
// numbers side by side, distances each with the triangle of the one before. On the host only.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "input/hull_batch.h"
#include "input/winding_in_lanes.h"

namespace amhex {

template <class Question>
void AnswerSome(const HullView& hull, const Question& question, int64_t begin, int64_t end,
                typename Question::Answer* answers) {
  for (int64_t i = begin; i < end; ++i) answers[i] = question(hull, i);
}

template <class Points>
void AnswerSome(const HullView& hull, const WindingAround<Points>& question, int64_t begin,
                int64_t end, double* answers) {
  std::array<Vec3d, kPointsAtOnce> points;
  int count = 0;
  for (int64_t i = begin; i < end; ++i) points[static_cast<size_t>(count++)] = question.points[i];
  const std::array<double, kPointsAtOnce> winding = WindingNumbers(hull, points.data(), count);
  for (int64_t i = begin; i < end; ++i) answers[i] = winding[static_cast<size_t>(i - begin)];
}

template <class Points>
void AnswerSome(const HullView& hull, const DistanceTo<Points>& question, int64_t begin,
                int64_t end, double* answers) {
  int32_t likely = -1;
  for (int64_t i = begin; i < end; ++i) {
    const Vec3d p = question.points[i];
    const bool is_near = question.enough > 0 && hull.IsWithin(p, question.enough, likely);
    answers[i] = is_near ? 0.0 : hull.Closest(p, likely).distance;
  }
}

template <class Points>
void AnswerSome(const HullView& hull, const ClosestTo<Points>& question, int64_t begin, int64_t end,
                Vec3d* answers) {
  int32_t likely = -1;
  for (int64_t i = begin; i < end; ++i) {
    answers[i] = hull.Closest(question.points[i], likely).point;
  }
}

template <class Points>
void AnswerSome(const HullView& hull, const SideOf<Points>& question, int64_t begin, int64_t end,
                HullSide* answers) {
  std::array<Vec3d, kPointsAtOnce> points;
  std::array<int64_t, kPointsAtOnce> asked;
  size_t count = 0;
  for (int64_t i = begin; i < end; ++i) {
    const Vec3d p = question.points[i];
    if (question.IsNear(hull, p)) {
      answers[i] = HullSide::kNear;
    } else {
      points[count] = p;
      asked[count++] = i;
    }
  }
  const std::array<double, kPointsAtOnce> winding =
      WindingNumbers(hull, points.data(), static_cast<int>(count));
  for (size_t k = 0; k < count; ++k) {
    answers[asked[k]] = HullView::IsInsideBy(winding[k]) ? HullSide::kInside : HullSide::kOutside;
  }
}

// Per point: every eighth answers for the seven after it, too.
template <class Question>
struct AskSomeBody {
  HullView hull;
  Question question;
  ArrayView<typename Question::Answer> answers;
  void operator()(int64_t i) const {
    if (i % kPointsAtOnce != 0) return;
    AnswerSome(hull, question, i, Smaller<int64_t>(i + kPointsAtOnce, answers.size), answers.data);
  }
};

}  // namespace amhex
