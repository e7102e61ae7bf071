// The steps of sweep_task.h with arrays where bodies run. The bits are those of ProjectToHull and
// SweepQuality: visits and surveys are the same, and vertices of one colour do not see each other.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/resident_arrays.h"
#include "exec/uploaded_arrays.h"
#include "input/hull_batch_impl.h"
#include "optimize/project_vertex.h"
#include "optimize/sweep_task.h"
#include "optimize/uploaded_features.h"

namespace amhex {

// The vertices of one colour; every one has its own room in a common array.
struct ColourRoom {
  ArrayView<const int32_t> vertices;
  ArrayView<const int64_t> room_of;  // [index in the colour]
  ArrayView<LocalCell> room;
  AMHEX_HD LocalCell* At(int64_t i) const { return room.data + room_of[i]; }
};

struct VisitBody {
  SweepVisits sweep;
  ColourRoom colour;
  AMHEX_HD void operator()(int64_t i) const {
    const int32_t v = colour.vertices[i];
    if (sweep.Wants(v)) sweep.Visit(v, colour.At(i));
  }
};

struct ProjectBody {
  PlacementView placement;
  double quality_floor = 0;
  ColourRoom colour;
  ArrayView<uint8_t> moved;  // [vertex]
  AMHEX_HD void operator()(int64_t i) const {
    const int32_t v = colour.vertices[i];
    if (!IsOnHull(placement, v)) return;
    moved[v] = ProjectVertex(placement, v, quality_floor, colour.At(i)) ? 1 : 0;
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
        cell_count_(task.placement.cells.size) {}

  // Memory where bodies run, beyond what is there.
  static int64_t Bytes(const SweepTask& task) {
    constexpr int64_t kPerVertex =
        sizeof(Vec3d) + sizeof(VertexConstraint) + 2 * sizeof(uint8_t) + sizeof(float);
    constexpr int64_t kPerCell = sizeof(float) + 2 * sizeof(uint8_t);
    constexpr int64_t kPerVertexOfPlan = sizeof(int32_t) + sizeof(int64_t);
    const PlacementView& placement = task.placement;
    int64_t sum = ResidentHullBytes<E>(placement.features.hull, *task.resident.hull);
    if (*task.resident.features == nullptr) sum += FeatureUpload(placement.features).Bytes();
    if (*task.resident.cells == nullptr) {
      sum += UploadedArrays<E>::Bytes(placement) + kPerVertexOfPlan * placement.vertices.size;
    }
    return sum + kPerVertex * placement.vertices.size + kPerCell * placement.cells.size +
           Plan(task).most_room * static_cast<int64_t>(sizeof(LocalCell));
  }

  // False if it was stopped.
  bool Run() {
    Upload();
    if (task_.projection_floor.has_value()) Project();
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

  // What one task after the other finds there.
  struct Cells {
    PlacementView placement;  // cells and neighbourhoods only
    ArrayView<const int32_t> vertices;
    ArrayView<const int64_t> room_of;
  };
  Cells ResidentCells(const Order& order) {
    return Resident<E>(*task_.resident.cells, [&](UploadedArrays<E>& arrays) {
      const auto view = [](const auto& values) {
        return ArrayView{values.data(), static_cast<int64_t>(values.size())};
      };
      return Cells{arrays.Upload(task_.placement), arrays.UploadArray(view(order.vertices)),
                   arrays.UploadArray(view(order.room_of))};
    });
  }
  FeatureView ResidentFeatures() {
    const FeatureView& host = task_.placement.features;
    const HullView hull = ResidentHull<E>(host.hull, *task_.resident.hull);
    return Resident<E>(*task_.resident.features, [&](UploadedArrays<E>& arrays) {
      return FeatureUpload(host).Upload(arrays, hull);
    });
  }

  void Upload() {
    const Order order = Plan(task_);
    const PlacementView& host = task_.placement;
    cells_ = ResidentCells(order);
    room_ = executor_.template Alloc<LocalCell>(order.most_room);
    vertices_ = Uploaded(executor_, host.vertices.data, vertex_count_);
    constraints_ = Uploaded(executor_, host.constraints.data, vertex_count_);
    quality_ = Uploaded(executor_, host.min_scaled_jacobian.data, cell_count_);
    near_folding_ = Uploaded(executor_, host.near_folding.data, cell_count_);
    active_ = Uploaded(executor_, *task_.active);
    step_ = Uploaded(executor_, *task_.step);
    moved_ = executor_.template Alloc<uint8_t>(vertex_count_);
    is_touched_ = executor_.template Alloc<uint8_t>(cell_count_);
    PlacementView there = cells_.placement;
    there.vertices = vertices_.View();
    there.constraints = ReadOnly(constraints_.View());
    there.min_scaled_jacobian = quality_.View();
    there.near_folding = near_folding_.View();
    there.features = ResidentFeatures();
    sweep_ = {there, task_.rules, active_.View(), step_.View(), moved_.View()};
    executor_.ForEach("touch no cell", cell_count_, ClearBody{is_touched_.View()});
  }

  // Calls step(count, vertices of a colour with their room) for one colour after the other.
  template <class Step>
  void ForColours(const Step& step) {
    int64_t first = 0;
    for (const ArrayView<const int32_t>& colour : task_.colours) {
      step(colour.size, ColourRoom{{cells_.vertices.data + first, colour.size},
                                   {cells_.room_of.data + first, colour.size},
                                   room_.View()});
      first += colour.size;
    }
  }

  void Project() {
    executor_.ForEach("move no vertex", vertex_count_, ClearBody{moved_.View()});
    ForColours([this](int64_t count, const ColourRoom& colour) {
      executor_.ForEach(
          "project the vertices of a colour", count,
          ProjectBody{sweep_.placement, *task_.projection_floor, colour, moved_.View()});
    });
    projected_count_ = NoteMoves();
  }

  // Returns the number of vertices that moved.
  int64_t Sweep() {
    executor_.ForEach("move no vertex", vertex_count_, ClearBody{moved_.View()});
    ForColours([this](int64_t count, const ColourRoom& colour) {
      executor_.ForEach("visit the vertices of a colour", count, VisitBody{sweep_, colour});
    });
    executor_.ForEach("rest", vertex_count_, ClearBody{active_.View()});
    return NoteMoves();
  }

  // As the host's: surveys cells of which a vertex has moved, and activates their vertices. Returns
  // the number of vertices that moved.
  int64_t NoteMoves() {
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
    task_.projected_count = projected_count_;
    *task_.active = std::move(active);
    *task_.step = std::move(step);
    return true;
  }

  E& executor_;
  SweepTask& task_;
  int64_t vertex_count_, cell_count_;
  int64_t projected_count_ = 0;
  Cells cells_;
  Array<LocalCell> room_;
  Array<VertexConstraint> constraints_;
  Array<Vec3d> vertices_;
  Array<float> quality_, step_;
  Array<uint8_t> near_folding_, active_, moved_, is_touched_;
  SweepVisits sweep_;
};

}  // namespace amhex
