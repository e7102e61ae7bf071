// The steps of sweep_task.h with arrays where bodies run. The bits are those of ProjectToHull and
// SweepQuality: visits and surveys are the same, and vertices of one colour do not see each other.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/array_view_of.h"
#include "exec/executor.h"
#include "exec/resident_arrays.h"
#include "exec/uploaded_arrays.h"
#include "input/hull_batch_impl.h"
#include "optimize/colour_visits.h"
#include "optimize/survey_cell.h"
#include "optimize/sweep_task.h"
#include "optimize/uploaded_features.h"

namespace amhex {

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

// What a task works on in place.
struct SweptArrays {
  ArrayView<Vec3d> vertices;
  ArrayView<float> quality;         // [cell] of the survey
  ArrayView<uint8_t> near_folding;  // [cell] of the survey
  ArrayView<uint8_t> active;        // SweepMemory's
  ArrayView<float> step;            // SweepMemory's

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(vertices), visit(quality), visit(near_folding), visit(active), visit(step);
  }
};

// Places in the array of counts; all but the first turn zero after the last sweep.
inline constexpr int kMovedVertices = 0;  // by the last sweep
inline constexpr int kLiveVertices = 1;
inline constexpr int kLiveCells = 2;
inline constexpr int kIsLive = 3;
inline constexpr int kLiveColours = 4;  // vertices of the first colour, and so on

// Decides whether there is another sweep; runs as one element.
struct SettleBody {
  int64_t vertex_count = 0;
  QualityAim aim = QualityAim::kMinimum;
  int64_t fewest_moved = 0;
  ArrayView<int64_t> counts;
  AMHEX_HD void operator()(int64_t) const {
    const int64_t moved = counts[kMovedVertices];
    if (moved >= fewest_moved && !HasSettled(moved, vertex_count, aim)) return;
    for (int64_t place = kLiveVertices; place < counts.size; ++place) counts[place] = 0;
  }
};

// One object per task.
template <class E>
class QualitySweeps {
 public:
  QualitySweeps(E& executor, SweepTask& task)
      : executor_(executor),
        task_(task),
        arrays_(executor),
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
    executor_.Repeat(
        task_.most_sweeps, counts_, [this] { Sweep(); },
        [this](const int64_t* counts) {
          ++sweeps_done_;
          moved_last_ = counts[kMovedVertices];
          return counts[kIsLive] == 0;
        });
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
      return Cells{arrays.Upload(task_.placement), arrays.UploadArray(ArrayViewOf(order.vertices)),
                   arrays.UploadArray(ArrayViewOf(order.room_of))};
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
    swept_ = arrays_.Upload(SweptArrays{host.vertices,
                                        host.min_scaled_jacobian,
                                        host.near_folding,
                                        {task_.active->data(), vertex_count_},
                                        {task_.step->data(), vertex_count_}});
    moved_ = executor_.template Alloc<uint8_t>(vertex_count_);
    is_touched_ = executor_.template Alloc<uint8_t>(cell_count_);
    std::vector<int64_t> counts = {0, vertex_count_, cell_count_, 1};
    for (const ArrayView<const int32_t>& colour : task_.colours) counts.push_back(colour.size);
    counts_ = Uploaded(executor_, counts);
    PlacementView there = cells_.placement;
    there.vertices = swept_.vertices;
    there.known_feet = {};  // the host's, and the next
    there.likely_triangles = {};
    there.constraints = arrays_.UploadArray(host.constraints);
    there.min_scaled_jacobian = swept_.quality;
    there.near_folding = swept_.near_folding;
    there.features = ResidentFeatures();
    sweep_ = {there, task_.rules, swept_.active, swept_.step, moved_.View()};
    executor_.ForEach("touch no cell", cell_count_, ClearBody{is_touched_.View()});
  }

  // Calls step(place in the counts, vertices of a colour with their room) for one colour after the
  // other.
  template <class Step>
  void ForColours(const Step& step) {
    int64_t first = 0;
    int place = kLiveColours;
    for (const ArrayView<const int32_t>& colour : task_.colours) {
      step(place++, ColourRoom{{cells_.vertices.data + first, colour.size},
                               {cells_.room_of.data + first, colour.size},
                               room_.View()});
      first += colour.size;
    }
  }

  // Runs as many elements as the sweeps have left, none once they have ended.
  template <class Body>
  void ForLive(const char* description, int place, int64_t count, const Body& body) {
    executor_.ForEachOf(description, count, Live(place), body);
  }
  ArrayView<const int64_t> Live(int place) { return {counts_.View().data + place, 1}; }

  void Project() {
    ForLive("move no vertex", kLiveVertices, vertex_count_, ClearBody{moved_.View()});
    ForColours([this](int place, const ColourRoom& colour) {
      ColourVisits<E>::Run(
          executor_, "project the vertices of a colour", colour.vertices.size, Live(place),
          ProjectBody{sweep_.placement, *task_.projection_floor, colour, moved_.View()});
    });
    NoteMoves();
    executor_.CopyOutLater(counts_, 1, &projected_count_);
  }

  void Sweep() {
    ForLive("move no vertex", kLiveVertices, vertex_count_, ClearBody{moved_.View()});
    ForColours([this](int place, const ColourRoom& colour) {
      ColourVisits<E>::Run(executor_, "visit the vertices of a colour", colour.vertices.size,
                           Live(place), VisitBody{sweep_, colour});
    });
    ForLive("rest", kLiveVertices, vertex_count_, ClearBody{swept_.active});
    NoteMoves();
    ForLive("see whether to go on", kIsLive, 1,
            SettleBody{vertex_count_, task_.rules.aim, task_.fewest_moved, counts_.View()});
  }

  // As the host's: surveys cells of which a vertex has moved, and activates their vertices. Counts
  // the vertices that moved.
  void NoteMoves() {
    ForLive("mark cells", kLiveVertices, vertex_count_,
            MarkBody{sweep_.placement, ReadOnly(moved_.View()), is_touched_.View()});
    ForLive("survey cells", kLiveCells, cell_count_,
            RenewBody{sweep_.placement, is_touched_.View(), swept_.active});
    executor_.ReduceInto("count moves", vertex_count_, FlagBody{ReadOnly(moved_.View())},
                         {counts_.View().data + kMovedVertices, 1});
  }

  bool Download() {
    std::vector<Vec3d> vertices(static_cast<size_t>(vertex_count_));
    std::vector<float> step(vertices.size()), quality(static_cast<size_t>(cell_count_));
    std::vector<uint8_t> active(vertices.size()), near_folding(quality.size());
    arrays_.Download(swept_, {{vertices.data(), vertex_count_},
                              {quality.data(), cell_count_},
                              {near_folding.data(), cell_count_},
                              {active.data(), vertex_count_},
                              {step.data(), vertex_count_}});
    if (executor_.Stopped()) return false;
    std::copy(vertices.begin(), vertices.end(), task_.placement.vertices.data);
    std::copy(quality.begin(), quality.end(), task_.placement.min_scaled_jacobian.data);
    std::copy(near_folding.begin(), near_folding.end(), task_.placement.near_folding.data);
    task_.projected_count = projected_count_;
    task_.sweeps_done = sweeps_done_;
    task_.moved_last = moved_last_;
    *task_.active = std::move(active);
    *task_.step = std::move(step);
    return true;
  }

  E& executor_;
  SweepTask& task_;
  UploadedArrays<E> arrays_;
  int64_t vertex_count_, cell_count_;
  int64_t projected_count_ = 0, moved_last_ = 0;
  int32_t sweeps_done_ = 0;
  Cells cells_;
  Array<LocalCell> room_;
  SweptArrays swept_;
  Array<uint8_t> moved_, is_touched_;
  Array<int64_t> counts_;
  SweepVisits sweep_;
};

}  // namespace amhex
