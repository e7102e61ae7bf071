#include "fields/phase_seeds.h"

#include <utility>

namespace amhex::fields {
namespace {

// From what has been reached at `front` to all that is connected, step by step; returns the step
// after the last.
int32_t Spread(const PhaseWalk& walk, const StopPoll& poll, int32_t now,
               std::vector<int64_t> front) {
  int64_t visited = 0;
  while (!front.empty()) {
    std::vector<int64_t> next;
    for (const int64_t u : front) {
      poll.At(++visited);
      walk.VisitNeighbours(u, [&](int64_t v) {
        if (!walk.IsReached(v) && walk.Reach(v, now)) next.push_back(v);
      });
    }
    front = std::move(next);
    ++now;
  }
  return now;
}

}  // namespace

void SeedWeakPhases(const PhaseOperator& matrix, const StopPoll& poll, std::vector<float>* x) {
  const auto count = static_cast<int64_t>(x->size()) / 2;
  std::vector<int32_t> step(x->size() / 2, kNeverReached);
  const PhaseWalk walk{matrix, {x->data(), 2 * count}, {step.data(), count}};
  std::vector<int64_t> strong;
  for (int64_t u = 0; u < count; ++u) {
    poll.At(u);
    if (IsWeakPhase(x->data(), u)) continue;
    step[u] = 0;
    strong.push_back(u);
  }
  int32_t now = Spread(walk, poll, 1, std::move(strong));
  for (int64_t u = 0; u < count; ++u) {
    poll.At(u);
    if (walk.IsReached(u)) continue;
    walk.Start(u, now);
    now = Spread(walk, poll, now + 1, {u});
  }
}

}  // namespace amhex::fields
