// Runs the labelling on a CUDA device: one thread block per group of tiles (label_kernel.cuh).
#pragma once

#include <cstdint>
#include <vector>

#include "exec/cuda_executor.cuh"
#include "relax/label_kernel.cuh"
#include "relax/label_tiles.h"

namespace amhex {

template <>
class TileLabeller<CudaExecutor> {
 public:
  TileLabeller(CudaExecutor& executor, const RelaxationTask& task)
      : executor_(executor), tiles_per_group_(TilesPerGroup(task.barrier.lattice)) {
    const std::vector<LabelGroup> groups = GroupsOf(task);
    const auto count = static_cast<int64_t>(groups.size());
    groups_ = executor.Alloc<LabelGroup>(count);
    executor.CopyIn(groups.data(), count, groups_);
  }

  // Device memory that it takes.
  static int64_t Bytes(const RelaxationTask& task) {
    return static_cast<int64_t>(GroupsOf(task).size() * sizeof(LabelGroup));
  }

  void Label(const LabelTileBody& body) {
    if (groups_.size() == 0 || !executor_.MayLaunch()) return;
    const auto kernel =
        tiles_per_group_ == 1 ? LabelGroupsKernel<1> : LabelGroupsKernel<kTileBlocks>;
    executor_.Launch("label lattice points", kernel, groups_.size(), kGroupThreads, body,
                     ReadOnly(groups_.View()), executor_.stop_flag());
  }

 private:
  static std::vector<LabelGroup> GroupsOf(const RelaxationTask& task) {
    const FccLattice& lattice = task.barrier.lattice;
    return BundleLabelItems(lattice, task.items, TilesPerGroup(lattice));
  }

  CudaExecutor& executor_;
  int tiles_per_group_;
  DeviceBuffer<LabelGroup> groups_;
};

}  // namespace amhex
