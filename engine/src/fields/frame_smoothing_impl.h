// The smoothing of frame_smoothing.h as a template over the executor.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/uploaded_arrays.h"
#include "fields/frame_smoothing.h"
#include "fields/grid_neighbours.h"

namespace amhex::fields {

struct InheritFrameBody {
  SmoothingLevel level;
  ArrayView<const Quaternion> coarser;
  ArrayView<Quaternion> frames;
  ArrayView<QuarticForm> forms;
  AMHEX_HD void operator()(int64_t node) const {
    frames[node] = level.StartOf(node, coarser);
    forms[node] = FormOfFrame(frames[node]);
  }
};

// One element per node of a colour: reads nodes of other colours, writes its own.
struct SmoothFrameBody {
  SmoothingLevel level;
  ArrayView<const int32_t> colour;
  ArrayView<Quaternion> frames;
  ArrayView<QuarticForm> forms;

  AMHEX_HD void operator()(int64_t index) const {
    const int64_t node = colour[index];
    QuarticForm sum;
    if (const int32_t hull = level.hull_of_node[node]; hull >= 0) sum = level.hull_forms[hull];
    for (int k = 0; k < kNeighbourCount; ++k) {
      const int32_t neighbour = level.neighbours[node * kNeighbourCount + k];
      if (neighbour >= 0) sum.Add(forms[neighbour], level.WeightOf(node, k));
    }
    const Quaternion frame = NearestFrame(sum, frames[node], kAscentRounds);
    frames[node] = frame;
    forms[node] = FormOfFrame(frame);
  }
};

// One object per run.
template <class E>
class FrameSmoothing {
 public:
  FrameSmoothing(E& executor, SmoothingTask& task) : executor_(executor), task_(task) {}

  // Memory where bodies run, at its peak, without what the executor needs of its own.
  static int64_t Bytes(const SmoothingTask& task) {
    int64_t largest = 0, coarser = 0;
    for (const SmoothingLevel& level : task.levels) {
      const int64_t frames = level.node_count() * static_cast<int64_t>(sizeof(Quaternion));
      const int64_t sum = UploadedArrays<E>::Bytes(level) + frames +
                          level.node_count() * static_cast<int64_t>(sizeof(QuarticForm));
      largest = largest > sum + coarser ? largest : sum + coarser;
      coarser = frames;
    }
    return largest + coarser / static_cast<int64_t>(sizeof(Quaternion)) *
                         static_cast<int64_t>(sizeof(ForwardCodes::value_type));
  }

  bool Run() {
    for (size_t level = 0; level < task_.levels.size(); ++level) {
      Smooth(task_.levels[level]);
      if (executor_.Stopped()) return false;
      if (task_.on_level) task_.on_level(static_cast<int32_t>(level));
    }
    std::vector<Quaternion> frames(static_cast<size_t>(frames_.size()));
    ForwardCodes codes(frames.size());
    executor_.CopyOutLater(frames_, frames_.size(), frames.data());
    executor_.CopyOutLater(codes_, codes_.size(), codes.data());
    executor_.Synchronize();
    if (executor_.Stopped()) return false;
    task_.frames = std::move(frames);
    task_.codes = std::move(codes);
    return true;
  }

 private:
  template <class T>
  using Array = Buffer<E, T>;

  void Smooth(const SmoothingLevel& host_level) {
    const int64_t count = host_level.node_count();
    UploadedArrays<E> arrays(executor_);
    const SmoothingLevel level = arrays.Upload(host_level);
    Array<Quaternion> frames = executor_.template Alloc<Quaternion>(count);
    Array<QuarticForm> forms = executor_.template Alloc<QuarticForm>(count);
    executor_.ForEach(
        "inherit frames", count,
        InheritFrameBody{level, ReadOnly(frames_.View()), frames.View(), forms.View()});
    const Array<int64_t> no_state = executor_.template Alloc<int64_t>(0);
    int32_t sweep = 0;
    const auto take_sweep = [&] {
      for (int step = 0; step < kColourCount; ++step) {
        const auto colour =
            level.colours[static_cast<size_t>(SmoothingLevel::ColourOf(sweep, step))];
        executor_.ForEach("smooth frames", colour.size,
                          SmoothFrameBody{level, colour, frames.View(), forms.View()});
      }
      ++sweep;
    };
    executor_.Repeat(level.sweeps, no_state, take_sweep, NoObserver{});
    if (&host_level == &task_.levels.back()) {
      codes_ = executor_.template Alloc<ForwardCodes::value_type>(count);
      executor_.ForEach(
          "match neighbours", count,
          MatchNeighboursBody{level.neighbours, ReadOnly(frames.View()), codes_.View()});
    }
    frames_ = std::move(frames);
  }

  E& executor_;
  SmoothingTask& task_;
  Array<Quaternion> frames_;               // of the level that is done
  Array<ForwardCodes::value_type> codes_;  // of the last
};

}  // namespace amhex::fields
