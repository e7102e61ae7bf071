// The sweeps of sweep_task.h with arrays where bodies run. The bits are those of SweepQuality:
// visits and surveys are the same, and vertices of one colour do not see each other.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/uploaded_arrays.h"
#include "optimize/sweep_task.h"
#include "optimize/uploaded_features.h"

namespace amhex {

// Visits the vertices of one colour; every one has its own room in a common array.
struct VisitBody {
  SweepVisits sweep;
  ArrayView<const int32_t> colour;
  ArrayView<const int64_t> room_of;  // [index in the colour]
  ArrayView<LocalCell> room;
  AMHEX_HD void operator()(int64_t i) const {
    const int32_t v = colour[i];
    if (sweep.Wants(v)) sweep.Visit(v, room.data + room_of[i]);
  }
};

// Everyone who writes writes the same.
struct MarkBody {
  PlacementView placement;
  ArrayView<const uint8_t> moved;  // [vertex]
  ArrayView<uint8_t> is_touched;   // [cell]
  AMHEX_HD void operator()(int64_t v) const {
    if (moved[v] == 0) return;
    const ArrayView<const int32_t> cells = placement.cells_at[v];
    for (int64_t k = 0; k < cells.size; ++k) is_touched[cells[k]] = 1;
  }
};

// Surveys a cell of which a vertex has moved, and activates all its vertices.
struct RenewBody {
  PlacementView placement;
  ArrayView<uint8_t> is_touched;  // [cell]; zero afterwards
  ArrayView<uint8_t> active;      // [vertex]
  AMHEX_HD void operator()(int64_t c) const {
    if (is_touched[c] == 0) return;
    is_touched[c] = 0;
    SurveyCell(placement, c);
    for (const int32_t v : placement.cells[c]) active[v] = 1;
  }
};

struct ClearBody {
  ArrayView<uint8_t> flags;
  AMHEX_HD void operator()(int64_t i) const { flags[i] = 0; }
};

struct FlagBody {
  ArrayView<const uint8_t> flags;
  AMHEX_HD int64_t operator()(int64_t i) const { return flags[i]; }
};

// One object per task.
template <class E>
class QualitySweeps {
 public:
  QualitySweeps(E& executor, SweepTask& task)
      : executor_(executor),
        task_(task),
        vertex_count_(task.placement.vertices.size),
        cell_count_(task.placement.cells.size),
        arrays_(executor) {}

  // Memory where bodies run.
  static int64_t Bytes(const SweepTask& task) {
    constexpr int64_t kPerVertex =
        sizeof(Vec3d) + 2 * sizeof(uint8_t) + sizeof(float) + sizeof(int32_t) + sizeof(int64_t);
    constexpr int64_t kPerCell = sizeof(float) + 2 * sizeof(uint8_t);
    return FeatureUpload(task.placement.features).Bytes() +
           UploadedArrays<E>::Bytes(task.placement) + kPerVertex * task.placement.vertices.size +
           kPerCell * task.placement.cells.size +
           Plan(task).most_room * static_cast<int64_t>(sizeof(LocalCell));
  }

  // False if it was stopped.
  bool Run() {
    Upload();
    for (int32_t sweep = 0; sweep < task_.most_sweeps; ++sweep) {
      const int64_t moved = Sweep();
      if (executor_.Stopped()) return false;
      if (HasSettled(moved, task_)) break;
    }
    return Download();
  }

 private:
  template <class T>
  using Array = Buffer<E, T>;

  // The vertices of all colours, one colour behind the other, and where each vertex has its room.
  struct Order {
    std::vector<int32_t> vertices;
    std::vector<int64_t> room_of;
    int64_t most_room = 0;  // cells around the vertices of one colour
  };
  static Order Plan(const SweepTask& task) {
    Order order;
    for (const ArrayView<const int32_t>& colour : task.colours) {
      int64_t room = 0;
      for (int64_t i = 0; i < colour.size; ++i) {
        order.vertices.push_back(colour[i]);
        order.room_of.push_back(room);
        room += task.placement.cells_at[colour[i]].size;
      }
      order.most_room = std::max(order.most_room, room);
    }
    return order;
  }

  void Upload() {
    const Order order = Plan(task_);
    const PlacementView& host = task_.placement;
    colours_ = Uploaded(executor_, order.vertices);
    room_of_ = Uploaded(executor_, order.room_of);
    room_ = executor_.template Alloc<LocalCell>(order.most_room);
    vertices_ = Uploaded(executor_, host.vertices.data, vertex_count_);
    quality_ = Uploaded(executor_, host.min_scaled_jacobian.data, cell_count_);
    near_folding_ = Uploaded(executor_, host.near_folding.data, cell_count_);
    active_ = Uploaded(executor_, *task_.active);
    step_ = Uploaded(executor_, *task_.step);
    moved_ = executor_.template Alloc<uint8_t>(vertex_count_);
    is_touched_ = executor_.template Alloc<uint8_t>(cell_count_);
    PlacementView there = arrays_.Upload(host);
    there.vertices = vertices_.View();
    there.min_scaled_jacobian = quality_.View();
    there.near_folding = near_folding_.View();
    there.features = FeatureUpload(host.features).Upload(arrays_);
    sweep_ = {there, task_.rules, active_.View(), step_.View(), moved_.View()};
    executor_.ForEach("touch no cell", cell_count_, ClearBody{is_touched_.View()});
  }

  // Returns the number of vertices that moved.
  int64_t Sweep() {
    executor_.ForEach("move no vertex", vertex_count_, ClearBody{moved_.View()});
    int64_t first = 0;
    for (const ArrayView<const int32_t>& colour : task_.colours) {
      executor_.ForEach("visit the vertices of a colour", colour.size,
                        VisitBody{sweep_,
                                  {colours_.View().data + first, colour.size},
                                  {room_of_.View().data + first, colour.size},
                                  room_.View()});
      first += colour.size;
    }
    executor_.ForEach("rest", vertex_count_, ClearBody{active_.View()});
    executor_.ForEach("mark cells", vertex_count_,
                      MarkBody{sweep_.placement, ReadOnly(moved_.View()), is_touched_.View()});
    executor_.ForEach("survey cells", cell_count_,
                      RenewBody{sweep_.placement, is_touched_.View(), active_.View()});
    return executor_.Reduce("count moves", vertex_count_, FlagBody{ReadOnly(moved_.View())});
  }

  bool Download() {
    std::vector<Vec3d> vertices(static_cast<size_t>(vertex_count_));
    std::vector<float> step(vertices.size()), quality(static_cast<size_t>(cell_count_));
    std::vector<uint8_t> active(vertices.size()), near_folding(quality.size());
    executor_.CopyOut(vertices_, vertex_count_, vertices.data());
    executor_.CopyOut(step_, vertex_count_, step.data());
    executor_.CopyOut(active_, vertex_count_, active.data());
    executor_.CopyOut(quality_, cell_count_, quality.data());
    executor_.CopyOut(near_folding_, cell_count_, near_folding.data());
    if (executor_.Stopped()) return false;
    std::copy(vertices.begin(), vertices.end(), task_.placement.vertices.data);
    std::copy(quality.begin(), quality.end(), task_.placement.min_scaled_jacobian.data);
    std::copy(near_folding.begin(), near_folding.end(), task_.placement.near_folding.data);
    *task_.active = std::move(active);
    *task_.step = std::move(step);
    return true;
  }

  E& executor_;
  SweepTask& task_;
  int64_t vertex_count_, cell_count_;
  UploadedArrays<E> arrays_;
  Array<int32_t> colours_;
  Array<int64_t> room_of_;
  Array<LocalCell> room_;
  Array<Vec3d> vertices_;
  Array<float> quality_, step_;
  Array<uint8_t> near_folding_, active_, moved_, is_touched_;
  SweepVisits sweep_;
};

}  // namespace amhex
