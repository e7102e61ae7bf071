// The relaxation loop of section 4, as a template over the executor: the only place that puts the
// bodies in order. Instantiated in relaxation_cpu.cpp (oneTBB) and relaxation_cuda.cu.
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "graph/hop_distance.h"
#include "graph/knn_exact_body.h"
#include "graph/n6_body.h"
#include "graph/point_bins.h"
#include "orientation/align_body.h"
#include "orientation/propagate_body.h"
#include "relax/label_tiles.h"
#include "relax/link_body.h"
#include "relax/regularity_weight.h"
#include "relax/regularize_body.h"
#include "relax/relaxation_task.h"
#include "relax/split_sites.h"

namespace amhex {

// Bins of one edge length hold about one site each; a box with more bins than this gets larger
// ones, so that thin solids in large boxes do not pay for the emptiness around them.
inline constexpr double kMaxBins = 1 << 25;

inline float BinSizeFor(const Vec3d& extent) {
  return static_cast<float>(std::fmax(1.0, std::cbrt(extent.x * extent.y * extent.z / kMaxBins)));
}
// Smoothing of the propagated frames before the sites move. The paper leaves this to the first
// iterations, in which the sites would follow frames that are still wrong.
inline constexpr int kFirstAlignments = 30;
// The last iterations do not split, so that every new cell can settle.
inline constexpr int32_t kSettlingIterations = 5;
// Splits may add this share of the sites in all.
inline constexpr double kLargestGrowth = 0.25;

struct FloatPositionBody {
  ArrayView<const Vec3d> position;
  ArrayView<Vec3f> rounded;
  AMHEX_HD void operator()(int64_t i) const { rounded[i] = ToFloat(position[i]); }
};

struct ClearClaimsBody {
  ArrayView<int32_t> claim_count;
  AMHEX_HD void operator()(int64_t i) const { claim_count[i] = 0; }
};

struct IsClusterBody {
  ArrayView<const int32_t> claim_count;
  ArrayView<const int32_t> is_inside;
  int32_t split_limit = 0;
  AMHEX_HD int64_t operator()(int64_t i) const {
    return is_inside[i] != 0 && claim_count[i] >= split_limit ? 1 : 0;
  }
};

struct MustSplitBody {
  ArrayView<const int32_t> claim_count;
  ArrayView<const int32_t> is_inside;
  ArrayView<const CellMoments> moments;
  ArrayView<const Vec3f> size;
  SplitCriterion criterion;
  AMHEX_HD int64_t operator()(int64_t i) const {
    return is_inside[i] != 0 && criterion(claim_count[i], moments[i].count, size[i]) ? 1 : 0;
  }
};

struct ValueBody {
  ArrayView<const int64_t> value;
  AMHEX_HD int64_t operator()(int64_t i) const { return value[i]; }
};

struct PointCountBody {
  ArrayView<const CellMoments> moments;
  ArrayView<int64_t> point_count;
  AMHEX_HD void operator()(int64_t i) const { point_count[i] = moments[i].count; }
};

// Relaxes `task` in place. One object per run.
template <class E>
class Relaxation {
 public:
  Relaxation(E& executor, RelaxationTask& task)
      : executor_(executor),
        task_(task),
        site_bins_(executor, task.barrier.extent, BinSizeFor(task.barrier.extent)),
        sample_bins_(executor, task.barrier.extent, BinSizeFor(task.barrier.extent)) {}

  RelaxationOutcome Run() {
    UploadFixed();
    UploadSites();
    if (task_.propagates_orientation && task_.iteration_count > 0) InitializeOrientations();
    for (int32_t iteration = 0; iteration < task_.iteration_count; ++iteration) {
      if (executor_.Stopped()) return RelaxationOutcome::kStopped;
      Iterate(iteration);
    }
    MeasureCells();
    executor_.Synchronize();
    return executor_.Stopped() ? RelaxationOutcome::kStopped : RelaxationOutcome::kDone;
  }

 private:
  template <class T>
  using Array = Buffer<E, T>;

  template <class T>
  Array<T> Uploaded(const std::vector<T>& host) {
    const auto count = static_cast<int64_t>(host.size());
    Array<T> buffer = executor_.template Alloc<T>(count);
    executor_.CopyIn(host.data(), count, buffer);
    return buffer;
  }

  // What never changes during the run: the lattice's sides and the hull's samples.
  void UploadFixed() {
    tile_side_ = Uploaded(task_.barrier.tile_side);
    inside_mask_ = Uploaded(task_.barrier.inside_mask);
    items_ = Uploaded(task_.items);
    barrier_ = {task_.barrier.lattice, ReadOnly(tile_side_.View()), ReadOnly(inside_mask_.View())};
    sample_position_ = Uploaded(task_.sample_position);
    sample_normal_ = Uploaded(task_.sample_normal);
    sample_bins_.Build(ReadOnly(sample_position_.View()),
                       static_cast<int64_t>(task_.sample_position.size()));
    site_limit_ =
        static_cast<int64_t>(static_cast<double>(task_.position.size()) * (1.0 + kLargestGrowth));
  }

  void UploadSites() {
    site_count_ = static_cast<int64_t>(task_.position.size());
    position_ = Uploaded(task_.position);
    orientation_ = Uploaded(task_.orientation);
    size_ = Uploaded(task_.size);
    is_inside_ = Uploaded(task_.is_inside);
    moved_ = executor_.template Alloc<Vec3d>(site_count_);
    aligned_ = executor_.template Alloc<Quatf>(site_count_);
    rounded_ = executor_.template Alloc<Vec3f>(site_count_);
    neighbours_ = executor_.template Alloc<int32_t>(site_count_ * kNeighbourCount);
    axis_neighbours_ = executor_.template Alloc<int32_t>(site_count_ * kAxisDirectionCount);
    links_ = executor_.template Alloc<int32_t>(site_count_ * kAxisDirectionCount);
    claim_count_ = executor_.template Alloc<int32_t>(site_count_);
    metric_ = executor_.template Alloc<SiteMetric>(site_count_);
    moments_ = executor_.template Alloc<CellMoments>(site_count_);
    movement_ = executor_.template Alloc<int64_t>(site_count_);
    largest_size_ = 0;
    for (const Vec3f& size : task_.size) {
      largest_size_ = Larger(largest_size_, Larger(size.x, Larger(size.y, size.z)));
    }
  }

  // Section 4.3: frames travel from the samples through the graph of sites and samples.
  void InitializeOrientations() {
    std::vector<Vec3f> nodes;
    for (const Vec3d& p : task_.position) nodes.push_back(ToFloat(p));
    nodes.insert(nodes.end(), task_.sample_position.begin(), task_.sample_position.end());
    std::vector<Quatf> frames = task_.orientation;
    frames.insert(frames.end(), task_.sample_orientation.begin(), task_.sample_orientation.end());
    const auto node_count = static_cast<int64_t>(nodes.size());
    const Array<Vec3f> node_position = Uploaded(nodes);
    Array<Quatf> node_orientation = Uploaded(frames);
    PointBins<E> bins(executor_, task_.barrier.extent, BinSizeFor(task_.barrier.extent));
    executor_.ForEach("find neighbours among sites and samples", site_count_,
                      KnnExactBody{bins.Build(node_position.View(), node_count),
                                   node_position.View(), neighbours_.View()});
    const Array<int32_t> hops =
        ComputeHopDistance(executor_, ReadOnly(neighbours_.View()), site_count_, node_count);
    std::vector<int32_t> host_hops(static_cast<size_t>(site_count_));
    executor_.CopyOut(hops, site_count_, host_hops.data());
    int32_t last_wave = 0;
    for (const int32_t hop : host_hops) {
      if (hop < kUnreached) last_wave = Larger(last_wave, hop);
    }
    for (int32_t wave = 1; wave <= last_wave; ++wave) {
      executor_.ForEach("propagate orientations", site_count_,
                        PropagateBody{wave, node_position.View(), hops.View(),
                                      ReadOnly(neighbours_.View()), node_orientation.View()});
    }
    executor_.CopyOut(node_orientation, site_count_, task_.orientation.data());
    executor_.CopyIn(task_.orientation.data(), site_count_, orientation_);
    FindNeighbours();
    for (int pass = 0; pass < kFirstAlignments && !executor_.Stopped(); ++pass) Align();
  }

  void FindNeighbours() {
    executor_.ForEach("round positions", site_count_,
                      FloatPositionBody{ReadOnly(position_.View()), rounded_.View()});
    const BinGrid& bins = site_bins_.Build(ReadOnly(rounded_.View()), site_count_);
    executor_.ForEach("find nearest neighbours", site_count_,
                      KnnExactBody{bins, ReadOnly(rounded_.View()), neighbours_.View()});
  }

  void Align() {
    executor_.ForEach(
        "align orientations", site_count_,
        AlignBody{ReadOnly(rounded_.View()), ReadOnly(neighbours_.View()), sample_bins_.grid(),
                  ReadOnly(sample_position_.View()), ReadOnly(sample_normal_.View()),
                  ReadOnly(orientation_.View()), aligned_.View()});
    std::swap(orientation_, aligned_);
  }

  // eq. 1, and how many sites claim each as neighbour. Returns the number of clusters.
  int64_t FindAxisNeighbours() {
    executor_.ForEach(
        "find axis neighbours", site_count_,
        AxisNeighbourBody{ReadOnly(rounded_.View()), ReadOnly(orientation_.View()),
                          ReadOnly(size_.View()), ReadOnly(is_inside_.View()),
                          ReadOnly(neighbours_.View()), site_count_, axis_neighbours_.View()});
    executor_.ForEach("clear claims", site_count_, ClearClaimsBody{claim_count_.View()});
    executor_.ForEach("count claims", site_count_ * kAxisDirectionCount,
                      CountClaimsBody{ReadOnly(axis_neighbours_.View()), claim_count_.View()});
    return executor_.Reduce("count clusters", site_count_,
                            IsClusterBody{ReadOnly(claim_count_.View()),
                                          ReadOnly(is_inside_.View()), task_.split_limit});
  }

  // Section 4.1; the bins must be those of the current positions.
  void Label(bool wants_second_moments) {
    executor_.ForEach("compute site metrics", site_count_,
                      SiteMetricBody{site_bins_.grid().ids, ReadOnly(position_.View()),
                                     ReadOnly(orientation_.View()), ReadOnly(size_.View()),
                                     ReadOnly(is_inside_.View()), metric_.View()});
    executor_.ForEach("clear cell moments", site_count_, ClearMomentsBody{moments_.View()});
    LabelTileBody body;
    body.barrier = barrier_;
    body.items = ReadOnly(items_.View());
    body.bins = site_bins_.grid();
    body.metric = ReadOnly(metric_.View());
    body.largest_size = largest_size_;
    body.wants_second_moments = wants_second_moments;
    body.moments = moments_.View();
    LabelTiles(executor_, body, static_cast<int64_t>(task_.items.size()));
  }

  void Iterate(int32_t iteration) {
    FindNeighbours();
    Align();
    const int64_t cluster_count = FindAxisNeighbours();
    const bool may_split =
        cluster_count > 0 && iteration + kSettlingIterations < task_.iteration_count;
    Label(may_split);
    Move(task_.regularity_weight *
         RegularityWeight(static_cast<double>(iteration) / task_.iteration_count));
    if (executor_.Stopped()) return;
    const int64_t movement =
        executor_.Reduce("sum movements", site_count_, ValueBody{ReadOnly(movement_.View())});
    if (may_split) Split();
    if (task_.on_iteration) {
      const double mean_movement =
          static_cast<double>(movement) * kMovementUnit / static_cast<double>(site_count_);
      task_.on_iteration(iteration + 1, mean_movement, site_count_);
    }
  }

  // eq. 3
  void Move(double weight) {
    if (weight > 0) {
      executor_.ForEach(
          "link faces", site_count_ * kAxisDirectionCount,
          LinkBody{barrier_, ReadOnly(position_.View()), ReadOnly(orientation_.View()),
                   ReadOnly(size_.View()), ReadOnly(is_inside_.View()),
                   ReadOnly(axis_neighbours_.View()), links_.View()});
    }
    RegularizeBody body;
    body.barrier = barrier_;
    body.weight = weight;
    body.position = ReadOnly(position_.View());
    body.orientation = ReadOnly(orientation_.View());
    body.size = ReadOnly(size_.View());
    body.is_inside = ReadOnly(is_inside_.View());
    body.moments = ReadOnly(moments_.View());
    body.links = ReadOnly(links_.View());
    body.sample_bins = sample_bins_.grid();
    body.sample_position = ReadOnly(sample_position_.View());
    body.sample_normal = ReadOnly(sample_normal_.View());
    body.moved = moved_.View();
    body.movement = movement_.View();
    executor_.ForEach("move sites", site_count_, body);
    std::swap(position_, moved_);
  }

  // Rare, and changes array sizes: done on the host.
  void Split() {
    const SplitCriterion criterion{task_.split_limit, task_.barrier.lattice.point_volume()};
    const int64_t due = executor_.Reduce(
        "count due splits", site_count_,
        MustSplitBody{ReadOnly(claim_count_.View()), ReadOnly(is_inside_.View()),
                      ReadOnly(moments_.View()), ReadOnly(size_.View()), criterion});
    if (due == 0) return;
    std::vector<int32_t> claim_count(static_cast<size_t>(site_count_));
    std::vector<CellMoments> moments(static_cast<size_t>(site_count_));
    executor_.CopyOut(claim_count_, site_count_, claim_count.data());
    executor_.CopyOut(moments_, site_count_, moments.data());
    DownloadSites();
    const int64_t split_count = SplitClusters(claim_count, moments, site_limit_, task_);
    task_.split_count += split_count;
    if (split_count > 0) UploadSites();
  }

  void DownloadSites() {
    executor_.CopyOut(position_, site_count_, task_.position.data());
    executor_.CopyOut(orientation_, site_count_, task_.orientation.data());
  }

  // The volume of every cell where the sites came to rest.
  void MeasureCells() {
    executor_.ForEach("round positions", site_count_,
                      FloatPositionBody{ReadOnly(position_.View()), rounded_.View()});
    site_bins_.Build(ReadOnly(rounded_.View()), site_count_);
    Label(false);
    executor_.ForEach("take point counts", site_count_,
                      PointCountBody{ReadOnly(moments_.View()), movement_.View()});
    task_.point_count.resize(static_cast<size_t>(site_count_));
    executor_.CopyOut(movement_, site_count_, task_.point_count.data());
    DownloadSites();
  }

  E& executor_;
  RelaxationTask& task_;
  int64_t site_count_ = 0;
  int64_t site_limit_ = 0;
  float largest_size_ = 1.0f;
  BarrierView barrier_;

  PointBins<E> site_bins_;
  PointBins<E> sample_bins_;
  Array<int32_t> tile_side_;
  Array<uint32_t> inside_mask_;
  Array<LabelItem> items_;
  Array<Vec3f> sample_position_;
  Array<Vec3f> sample_normal_;

  Array<Vec3d> position_;           // [site_count]
  Array<Vec3d> moved_;              // [site_count] double buffer of position_
  Array<Vec3f> rounded_;            // [site_count] position_ as float
  Array<Quatf> orientation_;        // [site_count]
  Array<Quatf> aligned_;            // [site_count] double buffer of orientation_
  Array<Vec3f> size_;               // [site_count]
  Array<int32_t> is_inside_;        // [site_count]
  Array<int32_t> neighbours_;       // [site_count][26]
  Array<int32_t> axis_neighbours_;  // [site_count][6]
  Array<int32_t> links_;            // [site_count][6]
  Array<int32_t> claim_count_;      // [site_count]
  Array<SiteMetric> metric_;        // [site_count]
  Array<CellMoments> moments_;      // [site_count]
  Array<int64_t> movement_;         // [site_count]
};

}  // namespace amhex
