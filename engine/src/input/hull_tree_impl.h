// Builds the hierarchy of hull_tree_task.h with arrays where bodies run: level by level, with the
// arithmetic and so the nodes of the host's recursion (hull_queries.cpp).
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/last_element.h"
#include "exec/resident_arrays.h"
#include "exec/uploaded_arrays.h"
#include "input/hull_tree_finish.h"
#include "input/hull_tree_split.h"
#include "input/hull_tree_task.h"

namespace amhex {

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
    constexpr int64_t kRoomForNodes = 2 * 3 * sizeof(int32_t);
    return task.triangles.size * (kOfTriangle + kRoomForNodes + kOfNode * 3 / 4);
  }

  // False if it was stopped.
  bool Run() {
    if (!TakeTriangles() || !SplitLevels()) return false;
    ReserveResults();
    if (count_ > 0) {
      PutInLeafOrder();
      WriteNodes();
      if (!MakeDipoles()) return false;
    }
    CopyOut();
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
    // Every part of a split holds a triangle.
    begin_ = Alloc<int32_t>(2 * count_);
    end_ = Alloc<int32_t>(2 * count_);
    left_ = Alloc<int32_t>(2 * count_);
    order_ = Alloc<int32_t>(count_);
    place_ = Alloc<int32_t>(count_);
    next_order_ = Alloc<int32_t>(count_);
    next_place_ = Alloc<int32_t>(count_);
    to_left_ = Alloc<int32_t>(count_ + 1);
    executor_.ForEach("begin the tree", count_,
                      BeginTreeBody{Nodes(), order_.View(), place_.View()});
    level_begins_.push_back(1);
    for (int32_t depth = 0; level_begins_[depth + 1] > level_begins_[depth]; ++depth) {
      if (!SplitLevel(depth)) return false;
    }
    next_order_ = {}, next_place_ = {}, place_ = {}, to_left_ = {};
    return true;
  }

  // Adds the level below.
  bool SplitLevel(int32_t depth) {
    HullTreeLevel level;
    level.nodes = Nodes();
    level.first = level_begins_[depth];
    level.count = level_begins_[depth + 1] - level.first;
    level.depth = depth;
    level.triangles = ReadOnly(taken_.View());
    level.order = order_.View(), level.place = place_.View(), level.to_left = to_left_.View();
    Buffer<E, int32_t> split = Alloc<int32_t>(level.count + 1);
    level.split = split.View();
    executor_.ForEach("find inner nodes", level.count + 1, FindInnerNodesBody{level});
    executor_.ExclusiveScan(split, level.count + 1);
    const int64_t inner = LastElement(executor_, split);
    if (executor_.Stopped()) return false;
    Buffer<E, HullSplit> splits = Alloc<HullSplit>(inner);
    level.splits = splits.View();
    executor_.ForEach("begin splits", level.count, BeginSplitsBody{level});
    level_begins_.push_back(level_begins_.back() + 2 * inner);
    if (inner == 0) return true;
    executor_.ForEach("bound centres", count_, BoundCentresBody{level});
    executor_.ForEach("choose axes", inner, ChooseAxisBody{level});
    executor_.ForEach("fill bins", count_, FillBinsBody{level});
    executor_.ForEach("choose bins", inner, ChooseBinBody{level});
    const int64_t sorted =
        executor_.Reduce("count nodes to sort", inner, CountSortedBody{ReadOnly(level.splits)});
    if (executor_.Stopped()) return false;
    if (sorted > 0) SortByCentres(level);
    executor_.ForEach("choose sides", count_ + 1, ChooseSidesBody{level});
    executor_.ExclusiveScan(to_left_, count_ + 1);
    executor_.ForEach("part triangles", count_,
                      PartBody{level, next_order_.View(), next_place_.View()});
    executor_.ForEach("begin children", inner, BeginChildrenBody{level});
    std::swap(order_, next_order_);
    std::swap(place_, next_place_);
    return !executor_.Stopped();
  }

  // The triangles of those nodes that are to be halved by count; rare.
  void SortByCentres(HullTreeLevel& level) {
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
    level.order = order_.View();
  }

  // What stays, on an executor that outlives this one.
  void ReserveResults() {
    const int64_t nodes = level_begins_.back();
    Resident<E>(built_, [&](UploadedArrays<E>& arrays) {
      arrays_ = &arrays;
      triangles_ = arrays.template AddArray<HullTriangle>(count_);
      normals_ = arrays.template AddArray<Vec3d>(count_);
      original_ = arrays.template AddArray<int32_t>(count_);
      nodes_ = arrays.template AddArray<HullNode>(nodes);
      dipoles_ = arrays.template AddArray<HullDipole>(nodes);
      return HullView{ReadOnly(triangles_), ReadOnly(normals_), ReadOnly(original_),
                      ReadOnly(nodes_), ReadOnly(dipoles_)};
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

  // False if it was stopped.
  bool MakeDipoles() {
    Buffer<E, int32_t> first = Alloc<int32_t>(nodes_.size + 1);
    const HullParts parts{ReadOnly(nodes_), ReadOnly(triangles_), first.View()};
    executor_.ForEach("count parts", nodes_.size + 1, CountPartsBody{parts});
    executor_.ExclusiveScan(first, nodes_.size + 1);
    const int64_t count = LastElement(executor_, first);
    if (executor_.Stopped()) return false;
    Buffer<E, DipoleSums> sums = Alloc<DipoleSums>(count);
    executor_.ForEach("sum parts", count, SumPartBody{parts, sums.View()});
    executor_.ForEach("make dipoles", nodes_.size,
                      MakeDipolesBody{parts, ReadOnly(sums.View()), dipoles_});
    Buffer<E, DipoleMoments> moments = Alloc<DipoleMoments>(count);
    executor_.ForEach("moments of parts", count,
                      PartMomentsBody{parts, ReadOnly(dipoles_), moments.View()});
    executor_.ForEach("add moments", nodes_.size,
                      AddMomentsBody{parts, ReadOnly(moments.View()), dipoles_});
    executor_.Synchronize();  // before others read what stays
    return !executor_.Stopped();
  }

  void CopyOut() {
    std::vector<HullTriangle> triangles = CopyOf(triangles_);
    std::vector<Vec3d> normals = CopyOf(normals_);
    std::vector<int32_t> original = CopyOf(original_);
    std::vector<HullNode> nodes = CopyOf(nodes_);
    std::vector<HullDipole> dipoles = CopyOf(dipoles_);
    task_.leaf_triangles = std::move(triangles);
    task_.normals = std::move(normals);
    task_.original = std::move(original);
    task_.nodes = std::move(nodes);
    task_.dipoles = std::move(dipoles);
  }
  template <class T>
  std::vector<T> CopyOf(ArrayView<T> array) {
    std::vector<T> host(static_cast<size_t>(array.size));
    arrays_->CopyOut(ReadOnly(array), host.data());
    return host;
  }

  E& executor_;
  HullTreeTask& task_;
  ResidentSlot& built_;
  int64_t count_ = 0;  // of triangles that have an area
  Buffer<E, HullTriangle> taken_;
  Buffer<E, int32_t> taken_original_;
  std::vector<int64_t> level_begins_;      // nodes before each level, and all
  Buffer<E, int32_t> begin_, end_, left_;  // of nodes (HullTreeNodes)
  Buffer<E, int32_t> order_, place_, next_order_, next_place_, to_left_;  // HullTreeLevel's
  UploadedArrays<E>* arrays_ = nullptr;                                   // own what stays:
  ArrayView<HullTriangle> triangles_;
  ArrayView<Vec3d> normals_;
  ArrayView<int32_t> original_;
  ArrayView<HullNode> nodes_;
  ArrayView<HullDipole> dipoles_;
};

}  // namespace amhex
