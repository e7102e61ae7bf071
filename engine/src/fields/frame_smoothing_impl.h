// The smoothing of frame_smoothing.h as a template over the executor.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/resident_arrays.h"
#include "exec/uploaded_arrays.h"
#include "fields/find_neighbours.h"
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

struct CopyFrameBody {
  ArrayView<const Quaternion> from;
  ArrayView<Quaternion> to;
  AMHEX_HD void operator()(int64_t node) const { to[node] = from[node]; }
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
  FrameSmoothing(E& executor, SmoothingTask& task)
      : executor_(executor), task_(task), arrays_(executor) {}

  // Memory where bodies run, at its peak, without what the executor needs of its own. Frames that
  // stay take less than the forms, which are gone by then.
  static int64_t Bytes(const SmoothingTask& task) {
    constexpr int64_t kOfNode =
        sizeof(Quaternion) + sizeof(QuarticForm) + sizeof(ForwardCodes::value_type);
    int64_t sum = BytesOfViewsThere<E>(task.cells), coarser = 0, finest = 0;
    for (const SmoothingLevel& level : task.levels) {
      sum += UploadedArrays<E>::Bytes(level);
      coarser = std::exchange(finest, level.node_count());
    }
    return sum + kOfNode * finest + static_cast<int64_t>(sizeof(Quaternion)) * coarser;
  }

  bool Run() {
    const std::vector<SmoothingLevel> levels = UploadLevels();
    for (size_t level = 0; level < levels.size(); ++level) {
      Smooth(levels[level]);
      if (level + 1 == levels.size()) MatchNeighbours(levels[level]);
      if (executor_.Stopped()) return false;
      if (task_.on_level) task_.on_level(static_cast<int32_t>(level));
    }
    std::vector<Quaternion> frames(static_cast<size_t>(frames_.size()));
    ForwardCodes codes(frames.size());
    executor_.CopyOutLater(frames_, frames_.size(), frames.data());
    executor_.CopyOutLater(codes_, codes_.size(), codes.data());
    executor_.Synchronize();
    if (executor_.Stopped()) return false;
    if (task_.frames_there != nullptr) KeepFrames();
    task_.frames = std::move(frames);
    task_.codes = std::move(codes);
    return true;
  }

 private:
  template <class T>
  using Array = Buffer<E, T>;

  void KeepFrames() {
    Resident<E>(*task_.frames_there, [this](UploadedArrays<E>& arrays) {
      const auto kept = arrays.template AddArray<Quaternion>(frames_.size());
      arrays.executor().ForEach("keep frames", kept.size,
                                CopyFrameBody{ReadOnly(frames_.View()), kept});
      return ReadOnly(kept);
    });
  }

  // All at once: most are small. Neighbours on the last one follow from its cells.
  std::vector<SmoothingLevel> UploadLevels() {
    std::vector<SmoothingLevel> levels;
    for (size_t level = 0; level + 1 < task_.levels.size(); ++level) {
      levels.push_back(arrays_.Upload(task_.levels[level]));
    }
    if (!task_.levels.empty()) levels.push_back(UploadLast(task_.levels.back()));
    return levels;
  }
  SmoothingLevel UploadLast(SmoothingLevel level) {
    level.neighbours = {};
    level = arrays_.Upload(level);
    const auto neighbours =
        arrays_.template AddArray<int32_t>(level.node_count() * kNeighbourCount);
    executor_.ForEach("find neighbours", level.node_count(),
                      FindNeighboursBody{ViewsThere(arrays_, task_.cells).keys, neighbours});
    level.neighbours = ReadOnly(neighbours);
    return level;
  }

  void Smooth(const SmoothingLevel& level) {
    const int64_t count = level.node_count();
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
    frames_ = std::move(frames);
  }

  void MatchNeighbours(const SmoothingLevel& level) {
    codes_ = executor_.template Alloc<ForwardCodes::value_type>(level.node_count());
    executor_.ForEach(
        "match neighbours", level.node_count(),
        MatchNeighboursBody{level.neighbours, ReadOnly(frames_.View()), codes_.View()});
  }

  E& executor_;
  SmoothingTask& task_;
  UploadedArrays<E> arrays_;               // of all levels
  Array<Quaternion> frames_;               // of the level that is done
  Array<ForwardCodes::value_type> codes_;  // of the last
};

}  // namespace amhex::fields
