#include "fields/phase_seeds.h"

#include <cmath>
#include <numbers>

namespace amhex::fields {
namespace {

constexpr double kFullTurn = 2 * std::numbers::pi;

// Walks over (node, axis) pairs, numbered 3 * node + axis.
class PhaseWalk {
 public:
  PhaseWalk(const GridLevel& level, const ForwardCodes& codes, const LatticeForm& form)
      : level_(level),
        codes_(codes),
        form_(form),
        phase_(3 * level.count(), 0.0),
        is_reached_(3 * level.count(), 0) {}

  bool is_reached(int64_t u) const { return is_reached_[u] != 0; }
  double phase(int64_t u) const { return phase_[u]; }

  void Start(int64_t u, double phase) {
    is_reached_[u] = 1;
    phase_[u] = phase;
  }

  // From what has been started at `seeds` to all that is connected; appends those in the order of
  // the walk.
  std::vector<int64_t> Spread(std::vector<int64_t> seeds) {
    for (size_t next = 0; next < seeds.size(); ++next) {
      const int64_t node = seeds[next] / 3;
      const int axis = static_cast<int>(seeds[next] % 3);
      const double phase = phase_[seeds[next]];
      for (int d = 0; d < 3; ++d) {
        StepForward(node, axis, d, phase, &seeds);
        StepBackward(node, axis, d, phase, &seeds);
      }
    }
    return seeds;
  }

 private:
  void StepForward(int64_t node, int axis, int d, double phase, std::vector<int64_t>* queue) {
    const int64_t other = level_.neighbours[node][d];
    if (other < 0) return;
    const AxisRotation& rotation = kAxisRotations[codes_[node][d]];
    Reach(3 * other + rotation.source[axis],
          rotation.sign[axis] * (phase + form_.increments[node][d][axis]), queue);
  }

  void StepBackward(int64_t node, int axis, int d, double phase, std::vector<int64_t>* queue) {
    const int64_t other = level_.neighbours[node][Opposite(d)];
    if (other < 0) return;
    const AxisRotation& rotation = kAxisRotations[codes_[other][d]];
    for (int a = 0; a < 3; ++a) {
      if (rotation.source[a] != axis) continue;
      Reach(3 * other + a, rotation.sign[a] * phase - form_.increments[other][d][a], queue);
    }
  }

  void Reach(int64_t u, double phase, std::vector<int64_t>* queue) {
    if (is_reached_[u] != 0) return;
    is_reached_[u] = 1;
    phase_[u] = phase;
    queue->push_back(u);
  }

  const GridLevel& level_;
  const ForwardCodes& codes_;
  const LatticeForm& form_;
  std::vector<double> phase_;  // turns
  std::vector<uint8_t> is_reached_;
};

}  // namespace

void SeedWeakPhases(const GridLevel& level, const ForwardCodes& codes, const LatticeForm& form,
                    std::vector<float>* x) {
  const int64_t count = 3 * level.count();
  PhaseWalk walk(level, codes, form);
  std::vector<int64_t> seeds;
  for (int64_t u = 0; u < count; ++u) {
    const double re = (*x)[2 * u], im = (*x)[2 * u + 1];
    if (re * re + im * im < kWeakPhase * kWeakPhase) continue;
    walk.Start(u, std::atan2(im, re) / kFullTurn);
    seeds.push_back(u);
  }
  size_t known = seeds.size();
  for (int64_t next = 0; next <= count; ++next) {
    const std::vector<int64_t> walked = walk.Spread(std::move(seeds));
    for (size_t k = known; k < walked.size(); ++k) {
      const int64_t u = walked[k];
      (*x)[2 * u] = static_cast<float>(std::cos(kFullTurn * walk.phase(u)));
      (*x)[2 * u + 1] = static_cast<float>(std::sin(kFullTurn * walk.phase(u)));
    }
    while (next < count && walk.is_reached(next)) ++next;
    if (next == count) break;
    walk.Start(next, 0);
    seeds = {next};
    known = 0;
  }
}

}  // namespace amhex::fields
