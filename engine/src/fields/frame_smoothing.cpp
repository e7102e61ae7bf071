#include "fields/frame_smoothing.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <utility>

#include "base/vector_lanes.h"
#include "fields/frame_batch.h"
#include "fields/grid_neighbours.h"

namespace amhex::fields {
namespace {

constexpr int64_t kBatchesPerPoll = 32;  // some microseconds each

class CpuSmoothing {
 public:
  explicit CpuSmoothing(SmoothingTask& task) : task_(task) {}

  bool Run() {
    for (size_t l = 0; l < task_.levels.size(); ++l) {
      const SmoothingLevel& level = task_.levels[l];
      Inherit(level);
      for (int32_t sweep = 0; sweep < level.sweeps && !ShouldStop(); ++sweep) Sweep(level, sweep);
      if (ShouldStop()) return false;
      if (task_.on_level) task_.on_level(static_cast<int32_t>(l));
    }
    ForwardCodes codes = MatchNeighbours();
    if (ShouldStop()) return false;
    task_.frames = std::move(frames_);
    task_.codes = std::move(codes);
    return true;
  }

 private:
  bool ShouldStop() const { return task_.should_stop && task_.should_stop(); }

  // Calls body(begin, end) for kLanes elements at a time; polls.
  template <class Body>
  void ForBatches(int64_t count, const Body& body) const {
    using Range = oneapi::tbb::blocked_range<int64_t>;
    oneapi::tbb::parallel_for(Range(0, LaneBlocks(count), kBatchesPerPoll),
                              [&](const Range& range) {
                                if (ShouldStop()) return;
                                for (int64_t b = range.begin(); b < range.end(); ++b) {
                                  body(b * kLanes, std::min(count, (b + 1) * kLanes));
                                }
                              });
  }

  void Inherit(const SmoothingLevel& level) {
    const auto count = static_cast<size_t>(level.node_count());
    std::vector<Quaternion> finer(count);
    forms_.resize(count);
    const ArrayView<const Quaternion> coarser{frames_.data(), static_cast<int64_t>(frames_.size())};
    ForBatches(level.node_count(), [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        finer[i] = level.StartOf(i, coarser);
        forms_[i] = FormOfFrame(finer[i]);
      }
    });
    frames_ = std::move(finer);
  }

  ForwardCodes MatchNeighbours() const {
    const auto count = static_cast<int64_t>(frames_.size());
    ForwardCodes codes(frames_.size());
    const MatchNeighboursBody match{
        task_.levels.back().neighbours, {frames_.data(), count}, {codes.data(), count}};
    ForBatches(count, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) match(i);
    });
    return codes;
  }

  void Sweep(const SmoothingLevel& level, int32_t sweep) {
    for (int step = 0; step < kColourCount; ++step) {
      const ArrayView<const int32_t>& colour = level.colours[SmoothingLevel::ColourOf(sweep, step)];
      ForBatches(colour.size, [&](int64_t begin, int64_t end) {
        SmoothNodes(level, {colour.data + begin, end - begin});
      });
    }
  }

  // The neighbours' and the hull's wishes together.
  QuarticForm WishesAt(const SmoothingLevel& level, int64_t node) const {
    QuarticForm sum;
    if (const int32_t index = level.hull_of_node[node]; index >= 0) sum = level.hull_forms[index];
    RunWithWidestVectors([&] {
      // In registers: QuarticForm::Add would go through memory, number by number.
      FloatLanes first = LoadFloats(sum.coefficients.data());
      FloatLanes rest = LoadFloats(sum.coefficients.data() + kLanes);
      for (int k = 0; k < kNeighbourCount; ++k) {
        const int32_t j = level.neighbours[node * kNeighbourCount + k];
        if (j < 0) continue;
        const float* form = forms_[j].coefficients.data();
        const float weight = level.WeightOf(node, k);
        first += weight * LoadFloats(form);
        rest += weight * LoadFloats(form + kLanes);
      }
      StoreFloats(first, sum.coefficients.data());
      StoreFloats(rest, sum.coefficients.data() + kLanes);
    });
    return sum;
  }

  // Moves the frames of up to kLanes nodes, none a neighbour of another.
  void SmoothNodes(const SmoothingLevel& level, ArrayView<const int32_t> nodes) {
    FrameBatch batch;
    for (int64_t lane = 0; lane < kLanes; ++lane) {
      const bool is_used = lane < nodes.size;  // the others repeat the first
      batch.forms[lane] = is_used ? WishesAt(level, nodes[lane]) : batch.forms[0];
      batch.frames[lane] = frames_[nodes[is_used ? lane : 0]];
    }
    FindNearestFrames(kAscentRounds, &batch);
    for (int64_t lane = 0; lane < nodes.size; ++lane) {
      frames_[nodes[lane]] = batch.frames[lane];
      forms_[nodes[lane]] = FormOfFrame(batch.frames[lane]);
    }
  }

  SmoothingTask& task_;
  std::vector<Quaternion> frames_;
  std::vector<QuarticForm> forms_;
};

}  // namespace

bool SmoothFramesOnCpu(SmoothingTask& task) { return CpuSmoothing(task).Run(); }

}  // namespace amhex::fields
