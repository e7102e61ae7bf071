// Builds the hierarchy of hull_tree_task.h with arrays where bodies run: level by level, with the
// arithmetic and so the nodes of the host's recursion (hull_queries.cpp).
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/last_element.h"
#include "exec/resident_arrays.h"
#include "exec/rounds_per_look.h"
#include "exec/uploaded_arrays.h"
#include "input/hull_tree_finish.h"
#include "input/hull_tree_split.h"
#include "input/hull_tree_task.h"

namespace amhex {

// What the host gets of a hierarchy that was built where bodies run (HullFetchTask).
template <class E>
HullArrays HullCopy(const ResidentSlot& built) {
  const auto& resident = *static_cast<const ResidentArrays<E, HullView>*>(built.get());
  HullArrays copy;
  const auto fetch = [&resident](const auto& view, auto& host) {
    host.resize(static_cast<size_t>(view.size));
    resident.arrays().CopyOutLater(view, host.data());
  };
  const HullView& there = resident.views();
  copy.is_closed = there.is_closed;
  fetch(there.original, copy.original);
  fetch(there.nodes, copy.nodes);
  fetch(there.dipoles, copy.dipoles);
  resident.arrays().Synchronize();
  return copy;
}

// One object per run.
template <class E>
class HullTreeBuild {
 public:
  // `built` is empty and gets the copy of the hierarchy that stays. It must outlive the executor:
  // when the run fails, what is under way may still write there.
  HullTreeBuild(E& executor, HullTreeTask& task, ResidentSlot& built)
      : executor_(executor), task_(task), built_(built) {}

  // Memory where bodies run, at its peak, without what the executor needs of its own.
  static int64_t Bytes(const HullTreeTask& task) {
    // When the triangles are put in leaf order they are there twice, and nodes in both forms: three
    // for every four triangles, where there is room for two per triangle.
    constexpr int64_t kOfTriangle = 2 * sizeof(HullTriangle) + sizeof(Vec3d) + 3 * sizeof(int32_t);
    constexpr int64_t kOfNode = sizeof(HullNode) + sizeof(HullDipole);
    constexpr int64_t kRoomForNodes = int64_t{2} * 3 * sizeof(int32_t);
    return task.triangles.size * (kOfTriangle + kRoomForNodes + kOfNode * 3 / 4);
  }

  // False if it was stopped.
  bool Run() {
    if (!TakeTriangles() || !SplitLevels()) return false;
    ReserveResults();
    if (count_ > 0) {
      PutInLeafOrder();
      WriteNodes();
      MakeDipoles();
    }
    executor_.Synchronize();  // before others read what stays
    if (executor_.Stopped()) return false;
    if (task_.copy != nullptr) *task_.copy = HullCopy<E>(built_);
    return true;
  }

 private:
  template <class T>
  Buffer<E, T> Alloc(int64_t count) {
    return executor_.template Alloc<T>(count);
  }

  // Those that have an area.
  bool TakeTriangles() {
    const Buffer<E, Vec3d> vertices = Uploaded(executor_, task_.vertices.data, task_.vertices.size);
    const Buffer<E, std::array<int32_t, 3>> triangles =
        Uploaded(executor_, task_.triangles.data, task_.triangles.size);
    const int64_t given = task_.triangles.size;
    Buffer<E, int32_t> kept = Alloc<int32_t>(given + 1);
    executor_.ForEach("find triangles with an area", given + 1,
                      KeepTrianglesBody{vertices.View(), triangles.View(), kept.View()});
    executor_.ExclusiveScan(kept, given + 1);
    count_ = LastElement(executor_, kept);
    if (executor_.Stopped()) return false;
    taken_ = Alloc<HullTriangle>(count_);
    taken_original_ = Alloc<int32_t>(count_);
    executor_.ForEach("take triangles", given,
                      TakeTrianglesBody{vertices.View(), triangles.View(), ReadOnly(kept.View()),
                                        taken_.View(), taken_original_.View()});
    return !executor_.Stopped();
  }

  HullTreeNodes Nodes() { return {begin_.View(), end_.View(), left_.View()}; }

  bool SplitLevels() {
    level_begins_ = {0};
    if (count_ == 0) return true;
    AllocateLevels();
    executor_.ForEach("begin the tree", count_,
                      BeginTreeBody{Nodes(), order_.View(), place_.View()});
    executor_.ForEach("begin the levels", kLevelCounts, BeginLevelsBody{counts_.View()});
    std::vector<int64_t> counts(kLevelCounts);
    do {
      for (int level = 0; level < kRoundsPerLook; ++level) {
        ChooseSplits();
        PartLevel();
      }
      executor_.CopyOut(counts_, kLevelCounts, counts.data());
      if (executor_.Stopped()) return false;
      if (counts[kMustSort] != 0) SortByCentres();
    } while (counts[kLevelNodes] > 0);
    const auto begins = counts.begin() + kLevelBegins;
    level_begins_.assign(begins, begins + counts[kLevelDepth] + 1);
    next_order_ = {}, next_place_ = {}, place_ = {}, to_left_ = {}, split_ = {}, splits_ = {};
    return true;
  }

  void AllocateLevels() {
    // Every part of a split holds a triangle.
    begin_ = Alloc<int32_t>(2 * count_);
    end_ = Alloc<int32_t>(2 * count_);
    left_ = Alloc<int32_t>(2 * count_);
    order_ = Alloc<int32_t>(count_);
    place_ = Alloc<int32_t>(count_);
    next_order_ = Alloc<int32_t>(count_);
    next_place_ = Alloc<int32_t>(count_);
    to_left_ = Alloc<int32_t>(count_ + 1);
    most_splits_ = MostSplits(count_);
    split_ = Alloc<int32_t>(2 * most_splits_ + 2);
    splits_ = Alloc<HullSplit>(most_splits_);
    counts_ = Alloc<int64_t>(kLevelCounts);
  }
  // Of a level: every inner node has more triangles than a leaf.
  static int64_t MostSplits(int64_t triangles) { return triangles / (kHullLeafTriangles + 1); }

  HullTreeLevel Level() {
    return {Nodes(),       counts_.View(), ReadOnly(taken_.View()), order_.View(),
            place_.View(), split_.View(),  splits_.View(),          to_left_.View()};
  }
  template <class Body>
  void ForLive(const char* description, int place, int64_t count, const Body& body) {
    executor_.ForEachOf(description, count, {counts_.View().data + place, 1}, body);
  }

  // Which nodes of the level become two, and where they are parted. Nothing if there are none, or
  // if an earlier level waits for triangles to be sorted.
  void ChooseSplits() {
    const HullTreeLevel level = Level();
    const int64_t most_nodes = 2 * most_splits_ + 1;
    executor_.ForEach("find inner nodes", most_nodes + 1, FindInnerNodesBody{level});
    executor_.ExclusiveScan(split_, most_nodes + 1);
    executor_.ForEach("count splits", 1, CountSplitsBody{level});
    ForLive("begin splits", kLiveNodes, most_nodes, BeginSplitsBody{level});
    executor_.ForEach("bound centres", count_, BoundCentresBody{level});
    ForLive("choose axes", kLiveSplits, most_splits_, ChooseAxisBody{level});
    executor_.ForEach("fill bins", count_, FillBinsBody{level});
    ForLive("choose bins", kLiveSplits, most_splits_, ChooseBinBody{level});
  }

  // Adds the level below.
  void PartLevel() {
    const HullTreeLevel level = Level();
    executor_.ForEach("choose sides", count_ + 1, ChooseSidesBody{level});
    executor_.ExclusiveScan(to_left_, count_ + 1);
    executor_.ForEach("part triangles", count_,
                      PartBody{level, next_order_.View(), next_place_.View()});
    ForLive("begin children", kLiveSplits, most_splits_, BeginChildrenBody{level});
    executor_.ForEach("end the level", 1, EndLevelBody{level});
    std::swap(order_, next_order_);
    std::swap(place_, next_place_);
  }

  // The triangles of those nodes that are to be halved by count; rare.
  void SortByCentres() {
    const HullTreeLevel level = Level();
    KeyedIds<E> pairs{Alloc<uint32_t>(count_), Alloc<int32_t>(count_)};
    KeyedIds<E> sorted{Alloc<uint32_t>(count_), Alloc<int32_t>(count_)};
    ArrayView<const int32_t> so_far;
    for (const CentreWord word : {CentreWord::kLow, CentreWord::kHigh, CentreWord::kRange}) {
      executor_.ForEach("key centres", count_,
                        CentreKeysBody{level, word, so_far, pairs.key.View(), pairs.id.View()});
      executor_.SortByKey(pairs, count_, ~uint32_t{0}, sorted);
      so_far = ReadOnly(sorted.id.View());
    }
    executor_.ForEach("take the order", count_,
                      TakeOrderBody{so_far, ReadOnly(order_.View()), next_order_.View()});
    std::swap(order_, next_order_);
    executor_.ForEach("go on with the level", 1, GoOnBody{Level()});
    PartLevel();
  }

  // What stays, on an executor that outlives this one.
  void ReserveResults() {
    const int64_t nodes = level_begins_.back();
    built_ = std::make_shared<ResidentArrays<E, HullView>>([&](UploadedArrays<E>& arrays) {
      triangles_ = arrays.template AddArray<HullTriangle>(count_);
      normals_ = arrays.template AddArray<Vec3d>(count_);
      original_ = arrays.template AddArray<int32_t>(count_);
      nodes_ = arrays.template AddArray<HullNode>(nodes);
      dipoles_ = arrays.template AddArray<HullDipole>(nodes);
      const bool is_closed = task_.edges_balance && count_ == task_.triangles.size;
      return HullView{ReadOnly(triangles_),
                      ReadOnly(normals_),
                      ReadOnly(original_),
                      ReadOnly(nodes_),
                      ReadOnly(dipoles_),
                      {},
                      is_closed};
    });
  }

  void PutInLeafOrder() {
    executor_.ForEach("put triangles in leaf order", count_,
                      PutInLeafOrderBody{ReadOnly(taken_.View()), ReadOnly(taken_original_.View()),
                                         ReadOnly(order_.View()), triangles_, normals_, original_});
    taken_ = {}, taken_original_ = {}, order_ = {};
  }

  // Bounds from the leaves up, numbers from the root down.
  void WriteNodes() {
    Buffer<E, HullBox> box = Alloc<HullBox>(nodes_.size);
    Buffer<E, int32_t> size = Alloc<int32_t>(nodes_.size), number = Alloc<int32_t>(nodes_.size);
    const HullTreeShape tree{Nodes(), box.View(), size.View(), number.View()};
    const auto level_count = static_cast<int32_t>(level_begins_.size()) - 1;
    const auto count_of = [&](int32_t level) {
      return level_begins_[level + 1] - level_begins_[level];
    };
    for (int32_t level = level_count; level-- > 0;) {
      executor_.ForEach("bound nodes", count_of(level),
                        BoundNodesBody{tree, ReadOnly(triangles_), level_begins_[level]});
    }
    for (int32_t level = 0; level < level_count; ++level) {
      executor_.ForEach("number nodes", count_of(level),
                        NumberNodesBody{tree, level_begins_[level]});
    }
    executor_.ForEach("write nodes", nodes_.size, WriteNodesBody{tree, nodes_});
    begin_ = {}, end_ = {}, left_ = {};
  }

  void MakeDipoles() {
    Buffer<E, int32_t> first = Alloc<int32_t>(nodes_.size + 1);
    const HullParts parts{ReadOnly(nodes_), ReadOnly(triangles_), first.View()};
    executor_.ForEach("count parts", nodes_.size + 1, CountPartsBody{parts});
    executor_.ExclusiveScan(first, nodes_.size + 1);
    // Of the nodes of a level at most one each has a part that is not full.
    const auto levels = static_cast<int64_t>(level_begins_.size());
    const int64_t most_parts = nodes_.size + levels * (count_ / kTrianglesPerSum);
    Buffer<E, DipoleSums> sums = Alloc<DipoleSums>(most_parts);
    executor_.ForEach("sum parts", most_parts, SumPartBody{parts, sums.View()});
    executor_.ForEach("make dipoles", nodes_.size,
                      MakeDipolesBody{parts, ReadOnly(sums.View()), dipoles_});
    Buffer<E, DipoleMoments> moments = Alloc<DipoleMoments>(most_parts);
    executor_.ForEach("moments of parts", most_parts,
                      PartMomentsBody{parts, ReadOnly(dipoles_), moments.View()});
    executor_.ForEach("add moments", nodes_.size,
                      AddMomentsBody{parts, ReadOnly(moments.View()), dipoles_});
  }

  E& executor_;
  HullTreeTask& task_;
  ResidentSlot& built_;
  int64_t count_ = 0;  // of triangles that have an area
  Buffer<E, HullTriangle> taken_;
  Buffer<E, int32_t> taken_original_;
  std::vector<int64_t> level_begins_;      // nodes before each level, and all
  Buffer<E, int32_t> begin_, end_, left_;  // of nodes (HullTreeNodes)
  Buffer<E, int32_t> order_, place_, next_order_, next_place_, to_left_, split_;  // HullTreeLevel's
  Buffer<E, HullSplit> splits_;
  Buffer<E, int64_t> counts_;
  int64_t most_splits_ = 0;
  // What stays:
  ArrayView<HullTriangle> triangles_;
  ArrayView<Vec3d> normals_;
  ArrayView<int32_t> original_;
  ArrayView<HullNode> nodes_;
  ArrayView<HullDipole> dipoles_;
};

}  // namespace amhex
