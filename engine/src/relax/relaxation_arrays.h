// Everything a relaxation keeps where its bodies run, and how much memory that is.
#pragma once

#include <cmath>
#include <cstdint>
#include <type_traits>

#include "base/quat.h"
#include "exec/executor.h"
#include "graph/grid_bins.h"
#include "graph/knn_graph.h"
#include "graph/n6_body.h"
#include "relax/cell_moments.h"
#include "relax/relaxation_state.h"
#include "relax/relaxation_task.h"
#include "relax/site_metric.h"

namespace amhex {

// Bins of one edge length hold about one site each; a box with more bins than this gets larger
// ones, so that thin solids in large boxes do not pay for the emptiness around them.
inline constexpr double kMaxBins = 1 << 25;

inline float BinSizeFor(const Vec3d& extent) {
  return static_cast<float>(std::fmax(1.0, std::cbrt(extent.x * extent.y * extent.z / kMaxBins)));
}

// Splits may add this share of the sites in all.
inline constexpr double kLargestGrowth = 0.25;

// How many sites a task may end with.
inline int64_t SiteCapacity(const RelaxationTask& task) {
  const auto site_count = static_cast<double>(task.position.size());
  return static_cast<int64_t>(task.iteration_count > 0 ? site_count * (1.0 + kLargestGrowth)
                                                       : site_count);
}

template <class E>
struct RelaxationArrays {
  template <class T>
  using Array = Buffer<E, T>;

  Array<int64_t> state;            // [kStateSize]
  Array<Vec3d> position;           // [capacity]
  Array<Vec3d> moved;              // [capacity] double buffer of position
  Array<Vec3f> rounded;            // [capacity] position as float
  Array<Quatf> orientation;        // [capacity]
  Array<Quatf> aligned;            // [capacity] double buffer of orientation
  Array<Vec3f> size;               // [capacity]
  Array<int32_t> is_inside;        // [capacity]
  Array<int32_t> neighbours;       // [capacity][26]
  Array<int32_t> axis_neighbours;  // [capacity][6]
  Array<int32_t> links;            // [capacity][6]
  Array<int32_t> claim_count;      // [capacity]
  Array<int32_t> split_rank;       // [capacity + 1]
  Array<SiteMetric> metric;        // [capacity] by slot
  Array<CellMoments> moments;      // [capacity]
  Array<int64_t> movement;         // [capacity]

  // Calls visit(array, element count) for each of them.
  template <class Visit>
  void VisitAll(int64_t capacity, const Visit& visit) {
    visit(state, int64_t{kStateSize});
    visit(position, capacity);
    visit(moved, capacity);
    visit(rounded, capacity);
    visit(orientation, capacity);
    visit(aligned, capacity);
    visit(size, capacity);
    visit(is_inside, capacity);
    visit(neighbours, capacity * kNeighbourCount);
    visit(axis_neighbours, capacity * kAxisDirectionCount);
    visit(links, capacity * kAxisDirectionCount);
    visit(claim_count, capacity);
    visit(split_rank, capacity + 1);
    visit(metric, capacity);
    visit(moments, capacity);
    visit(movement, capacity);
  }

  void Allocate(E& executor, int64_t capacity) {
    VisitAll(capacity, [&]<class T>(T& array, int64_t count) {
      using Element = std::remove_reference_t<decltype(*array.View().data)>;
      array = executor.template Alloc<Element>(count);
    });
  }
};

// The most points that a relaxation of `task` sorts at once.
inline int64_t LargestSort(const RelaxationTask& task) {
  const auto nodes = static_cast<int64_t>(task.position.size() + task.sample_position.size());
  return Larger(SiteCapacity(task), nodes);
}

// The most memory that a relaxation of `task` takes where its bodies run, but for what an executor
// needs of its own. Within 10 % of the truth.
template <class E>
int64_t RelaxationBytes(const RelaxationTask& task) {
  const auto bytes = [](const auto& host) {
    return static_cast<int64_t>(host.size() * sizeof(host[0]));
  };
  const int64_t capacity = SiteCapacity(task);
  const auto site_count = static_cast<int64_t>(task.position.size());
  const auto sample_count = static_cast<int64_t>(task.sample_position.size());
  const Vec3d extent = task.barrier.extent;
  const float bin_size = BinSizeFor(extent);
  int64_t sum = bytes(task.barrier.tile_side) + bytes(task.barrier.inside_mask) +
                bytes(task.items) + bytes(task.sample_position) + bytes(task.sample_normal);
  sum += GridBins<E>::Bytes(extent, bin_size, capacity);
  sum += GridBins<E>::Bytes(extent, bin_size, sample_count);
  RelaxationArrays<E> arrays;
  arrays.VisitAll(capacity, [&](auto& array, int64_t count) {
    sum += count * static_cast<int64_t>(sizeof(*array.View().data));
  });
  if (task.propagates_orientation && task.iteration_count > 0) {
    // Sites and samples as one graph: position, frame, two hop distances.
    constexpr int64_t kNodeBytes = sizeof(Vec3f) + sizeof(Quatf) + 2 * sizeof(int32_t);
    const int64_t node_count = site_count + sample_count;
    sum += kNodeBytes * node_count + GridBins<E>::Bytes(extent, bin_size, node_count);
  }
  return sum;
}

}  // namespace amhex
