// Runs the labelling on a CUDA device: the sites near each group of tiles (label_gather.cuh), the
// points (label_kernel.cuh), and the few tiles that are left (label_rest.cuh).
#pragma once

#include <cstdint>
#include <vector>

#include "exec/cuda_executor.cuh"
#include "relax/label_gather.cuh"
#include "relax/label_kernel.cuh"
#include "relax/label_rest.cuh"
#include "relax/label_tiles.h"

namespace amhex {

// Before the first labelling nothing is known.
struct ForgetGroupBody {
  GroupLists lists;
  AMHEX_HD void operator()(int64_t group) const { lists.next_reach[group] = lists.left[group] = 0; }
};

template <>
class TileLabeller<CudaExecutor> {
 public:
  TileLabeller(CudaExecutor& executor, const RelaxationTask& task)
      : executor_(executor), shape_(ShapeOf(task.barrier.lattice)) {
    const std::vector<LabelGroup> groups = GroupsOf(task);
    const auto count = static_cast<int64_t>(groups.size());
    groups_ = executor.Alloc<LabelGroup>(count);
    executor.CopyIn(groups.data(), count, groups_);
    slots_ = executor.Alloc<int32_t>(shape_ == LabelShape::kFine ? count * kFineCapacity : 0);
    counts_ = executor.Alloc<int32_t>(count);
    reaches_ = executor.Alloc<float>(count);
    next_reaches_ = executor.Alloc<uint32_t>(count);
    left_ = executor.Alloc<uint32_t>(count);
    executor.ForEach("forget groups", count, ForgetGroupBody{Lists()});
  }

  // Device memory that it takes.
  static int64_t Bytes(const RelaxationTask& task) {
    return static_cast<int64_t>(GroupsOf(task).size()) *
           LabelBytesPerGroup(ShapeOf(task.barrier.lattice));
  }

  void Label(const LabelTileBody& body) {
    if (groups_.size() == 0 || !executor_.MayLaunch()) return;
    const GroupLists lists = Lists();
    switch (shape_) {
      case LabelShape::kFine:
        executor_.Launch("gather sites", GatherSitesKernel,
                         (groups_.size() + kGatherWarps - 1) / kGatherWarps, kGatherThreads, body,
                         ReadOnly(groups_.View()), lists, executor_.stop_flag());
        LabelGroups<FineLabelWork>(body, lists);
        break;
      case LabelShape::kMedium:
        LabelGroups<MediumLabelWork>(body, lists);
        break;
      case LabelShape::kCoarse:
        LabelGroups<CoarseLabelWork>(body, lists);
        break;
    }
    executor_.Launch("label the rest", LabelRestKernel,
                     (groups_.size() + kGroupsOfRestBlock - 1) / kGroupsOfRestBlock, kRestThreads,
                     body, ReadOnly(groups_.View()), TilesPerGroup(shape_), lists,
                     executor_.stop_flag());
  }

 private:
  GroupLists Lists() {
    return {slots_.View(), counts_.View(), reaches_.View(), next_reaches_.View(), left_.View()};
  }

  static std::vector<LabelGroup> GroupsOf(const RelaxationTask& task) {
    const FccLattice& lattice = task.barrier.lattice;
    return BundleLabelItems(lattice, task.items, TilesPerGroup(ShapeOf(lattice)));
  }

  template <class Work>
  void LabelGroups(const LabelTileBody& body, const GroupLists& lists) {
    executor_.Launch("label lattice points", LabelGroupsKernel<Work>, groups_.size() * Work::kParts,
                     Work::kThreads, body, ReadOnly(groups_.View()), lists, executor_.stop_flag());
  }

  CudaExecutor& executor_;
  LabelShape shape_;
  DeviceBuffer<LabelGroup> groups_;
  DeviceBuffer<int32_t> slots_, counts_;
  DeviceBuffer<float> reaches_;
  DeviceBuffer<uint32_t> next_reaches_, left_;
};

}  // namespace amhex
