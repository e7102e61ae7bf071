// The relaxation loop of section 4, as a template over the executor: the only place that puts the
// bodies in order. Instantiated in relaxation_cpu.cpp (oneTBB) and relaxation_cuda.cu.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/uploaded_arrays.h"
#include "graph/grid_bins.h"
#include "graph/hop_distance.h"
#include "graph/knn_exact_body.h"
#include "graph/n6_body.h"
#include "graph/nearest_search.h"
#include "orientation/align_body.h"
#include "orientation/propagate_body.h"
#include "relax/label_tiles.h"
#include "relax/link_body.h"
#include "relax/regularity_weight.h"
#include "relax/regularize_body.h"
#include "relax/relaxation_arrays.h"
#include "relax/relaxation_task.h"
#include "relax/split_sites.h"

namespace amhex {

// Smoothing of the propagated frames before the sites move. The paper leaves this to the first
// iterations, in which the sites would follow frames that are still wrong.
inline constexpr int kFirstAlignments = 30;
// The last iterations do not split, so that every new cell can settle.
inline constexpr int32_t kSettlingIterations = 5;

enum class SecondMoments { kNone, kForClusters };

struct FloatPositionBody {
  ArrayView<const Vec3d> position;
  ArrayView<Vec3f> rounded;
  AMHEX_HD void operator()(int64_t i) const { rounded[i] = ToFloat(position[i]); }
};

struct ClearClaimsBody {
  ArrayView<int32_t> claim_count;
  AMHEX_HD void operator()(int64_t i) const { claim_count[i] = 0; }
};

// Bodies of sums run over all sites that there is room for; those that are not there yet add
// nothing.
struct IsClusterBody {
  RelaxationState state;
  ArrayView<const int32_t> claim_count;
  ArrayView<const int32_t> is_inside;
  int32_t split_limit = 0;
  int64_t last_split_iteration = 0;
  AMHEX_HD int64_t operator()(int64_t i) const {
    if (i >= state.SiteCount() || state.Iteration() > last_split_iteration) return 0;
    return is_inside[i] != 0 && claim_count[i] >= split_limit ? 1 : 0;
  }
};

struct MovementBody {
  RelaxationState state;
  ArrayView<const int64_t> movement;
  AMHEX_HD int64_t operator()(int64_t i) const { return i < state.SiteCount() ? movement[i] : 0; }
};

struct PointCountBody {
  ArrayView<const CellMoments> moments;
  ArrayView<int64_t> point_count;
  AMHEX_HD void operator()(int64_t i) const { point_count[i] = moments[i].count; }
};

// Relaxes `task` in place, or leaves it as it was. One object per run.
template <class E>
class Relaxation {
 public:
  Relaxation(E& executor, RelaxationTask& task)
      : executor_(executor),
        task_(task),
        capacity_(SiteCapacity(task)),
        site_bins_(executor, task.barrier.extent, BinSizeFor(task.barrier.extent)),
        sample_bins_(executor, task.barrier.extent, BinSizeFor(task.barrier.extent)),
        labeller_(executor, task) {}

  RelaxationOutcome Run() {
    UploadFixed();
    UploadSites();
    if (task_.propagates_orientation && task_.iteration_count > 0) InitializeOrientations();
    executor_.Repeat(
        task_.iteration_count, arrays_.state, [&] { Iterate(); },
        [&](const int64_t* state) { Report(state); });
    if (!executor_.Stopped()) {
      MeasureCells();
      Download();
    }
    return executor_.Stopped() ? RelaxationOutcome::kStopped : RelaxationOutcome::kDone;
  }

 private:
  template <class T>
  using Array = Buffer<E, T>;

  template <class T>
  void Upload(const std::vector<T>& host, Array<T>& buffer) {
    executor_.CopyIn(host.data(), static_cast<int64_t>(host.size()), buffer);
  }

  // The host has it once it has synchronized.
  template <class T>
  void DownloadLater(const Array<T>& buffer, int64_t count, std::vector<T>& host) {
    host.resize(static_cast<size_t>(count));
    executor_.CopyOutLater(buffer, count, host.data());
  }
  template <class T>
  void Download(const Array<T>& buffer, int64_t count, std::vector<T>& host) {
    DownloadLater(buffer, count, host);
    executor_.Synchronize();
  }

  RelaxationState State() { return {arrays_.state.View()}; }
  ArrayView<const int64_t> SiteCountView() { return ReadOnly(State().At(kSiteCount)); }

  template <class Body>
  void ForEachSite(const char* description, const Body& body) {
    executor_.ForEachOf(description, capacity_, SiteCountView(), body);
  }

  // What never changes during the run: the lattice's sides, the hull's samples, the weights.
  void UploadFixed() {
    tile_side_ = Uploaded(executor_, task_.barrier.tile_side);
    inside_mask_ = Uploaded(executor_, task_.barrier.inside_mask);
    items_ = Uploaded(executor_, task_.items);
    barrier_ = {task_.barrier.lattice, ReadOnly(tile_side_.View()), ReadOnly(inside_mask_.View())};
    sample_position_ = Uploaded(executor_, task_.sample_position);
    sample_normal_ = Uploaded(executor_, task_.sample_normal);
    sample_bins_.Build(ReadOnly(sample_position_.View()),
                       static_cast<int64_t>(task_.sample_position.size()));
    std::vector<double> weights;
    weights.reserve(task_.iteration_count);
    for (int32_t i = 0; i < task_.iteration_count; ++i) {
      weights.push_back(task_.regularity_weight *
                        RegularityWeight(static_cast<double>(i) / task_.iteration_count));
    }
    weight_at_ = Uploaded(executor_, weights);
  }

  void UploadSites() {
    arrays_.Allocate(executor_, capacity_);
    std::vector<int64_t> state(kStateSize, 0);
    state[kSiteCount] = static_cast<int64_t>(task_.position.size());
    Upload(state, arrays_.state);
    Upload(task_.position, arrays_.position);
    Upload(task_.orientation, arrays_.orientation);
    Upload(task_.size, arrays_.size);
    Upload(task_.is_inside, arrays_.is_inside);
    largest_size_ = 0;
    for (const Vec3f& size : task_.size) {
      largest_size_ = Larger(largest_size_, Larger(size.x, Larger(size.y, size.z)));
    }
  }

  // Section 4.3: frames travel from the samples through the graph of sites and samples.
  void InitializeOrientations() {
    std::vector<Vec3f> nodes;
    for (const Vec3d& p : task_.position) nodes.push_back(ToFloat(p));
    const auto site_count = static_cast<int64_t>(nodes.size());
    nodes.insert(nodes.end(), task_.sample_position.begin(), task_.sample_position.end());
    std::vector<Quatf> frames = task_.orientation;
    frames.insert(frames.end(), task_.sample_orientation.begin(), task_.sample_orientation.end());
    const auto node_count = static_cast<int64_t>(nodes.size());
    const Array<Vec3f> node_position = Uploaded(executor_, nodes);
    Array<Quatf> node_orientation = Uploaded(executor_, frames);
    GridBins<E> bins(executor_, task_.barrier.extent, BinSizeFor(task_.barrier.extent));
    executor_.ForEach("find neighbours among sites and samples", site_count,
                      KnnExactBody{bins.Build(node_position.View(), node_count),
                                   node_position.View(), arrays_.neighbours.View()});
    const Array<int32_t> hops =
        ComputeHopDistance(executor_, ReadOnly(arrays_.neighbours.View()), site_count, node_count);
    std::vector<int32_t> host_hops;
    Download(hops, site_count, host_hops);
    int32_t last_wave = 0;
    for (const int32_t hop : host_hops) {
      if (hop < kUnreached) last_wave = Larger(last_wave, hop);
    }
    for (int32_t wave = 1; wave <= last_wave; ++wave) {
      executor_.ForEach(
          "propagate orientations", site_count,
          PropagateBody{wave, node_position.View(), hops.View(),
                        ReadOnly(arrays_.neighbours.View()), node_orientation.View()});
    }
    frames.clear();
    Download(node_orientation, site_count, frames);
    Upload(frames, arrays_.orientation);
    FindNeighbours();
    for (int pass = 0; pass < kFirstAlignments && !executor_.Stopped(); ++pass) Align();
  }

  void SortIntoBins() {
    ForEachSite("round positions",
                FloatPositionBody{ReadOnly(arrays_.position.View()), arrays_.rounded.View()});
    site_bins_.Build(ReadOnly(arrays_.rounded.View()), capacity_, SiteCountView());
  }

  void FindNeighbours() {
    SortIntoBins();
    NearestSearch<E>::Run(
        executor_, capacity_, SiteCountView(),
        {site_bins_.grid(), ReadOnly(arrays_.rounded.View()), arrays_.neighbours.View()});
  }

  void Align() {
    ForEachSite("align orientations",
                AlignBody{ReadOnly(arrays_.rounded.View()), ReadOnly(arrays_.neighbours.View()),
                          sample_bins_.grid(), ReadOnly(sample_position_.View()),
                          ReadOnly(sample_normal_.View()), ReadOnly(arrays_.orientation.View()),
                          arrays_.aligned.View()});
    std::swap(arrays_.orientation, arrays_.aligned);
  }

  // eq. 1, how many sites claim each as neighbour, and the number of clusters.
  void FindAxisNeighbours() {
    ForEachSite(
        "find axis neighbours",
        AxisNeighbourBody{ReadOnly(arrays_.rounded.View()), ReadOnly(arrays_.orientation.View()),
                          ReadOnly(arrays_.size.View()), ReadOnly(arrays_.is_inside.View()),
                          ReadOnly(arrays_.neighbours.View()), capacity_,
                          arrays_.axis_neighbours.View()});
    ForEachSite("clear claims", ClearClaimsBody{arrays_.claim_count.View()});
    ForEachSite("count claims", CountClaimsBody{ReadOnly(arrays_.axis_neighbours.View()),
                                                arrays_.claim_count.View()});
    executor_.ReduceInto("count clusters", capacity_,
                         IsClusterBody{State(), ReadOnly(arrays_.claim_count.View()),
                                       ReadOnly(arrays_.is_inside.View()), task_.split_limit,
                                       int64_t{task_.iteration_count} - kSettlingIterations - 1},
                         State().At(kClusterCount));
  }

  // Section 4.1; the bins must be those of the current positions.
  void Label(SecondMoments second_moments) {
    ForEachSite("compute site metrics",
                SiteMetricBody{barrier_.lattice.spacing, site_bins_.grid().ids,
                               ReadOnly(arrays_.position.View()),
                               ReadOnly(arrays_.orientation.View()), ReadOnly(arrays_.size.View()),
                               ReadOnly(arrays_.is_inside.View()), arrays_.metric.View()});
    executor_.ForEach("clear cell moments", capacity_ * ClearMomentsBody::kNumbers,
                      ClearMomentsBody{arrays_.moments.View()});
    LabelTileBody body;
    body.barrier = barrier_;
    body.items = ReadOnly(items_.View());
    body.bins = site_bins_.grid();
    body.metric = ReadOnly(arrays_.metric.View());
    body.largest_size = largest_size_;
    body.wants_second_moments = second_moments == SecondMoments::kForClusters;
    body.cluster_count = ReadOnly(State().At(kClusterCount));
    body.claim_count = ReadOnly(arrays_.claim_count.View());
    body.split_limit = task_.split_limit;
    body.moments = arrays_.moments.View();
    labeller_.Label(body);
  }

  void Iterate() {
    FindNeighbours();
    Align();
    FindAxisNeighbours();
    Label(SecondMoments::kForClusters);
    Move();
    executor_.ReduceInto("sum movements", capacity_,
                         MovementBody{State(), ReadOnly(arrays_.movement.View())},
                         State().At(kMovement));
    Split();
  }

  // eq. 3
  void Move() {
    if (task_.regularity_weight > 0) {
      ForEachSite("link faces",
                  LinkBody{barrier_, ReadOnly(arrays_.position.View()),
                           ReadOnly(arrays_.orientation.View()), ReadOnly(arrays_.size.View()),
                           ReadOnly(arrays_.is_inside.View()),
                           ReadOnly(arrays_.axis_neighbours.View()), arrays_.links.View()});
    }
    RegularizeBody body;
    body.barrier = barrier_;
    body.weight_at = ReadOnly(weight_at_.View());
    body.iteration = ReadOnly(State().At(kIteration));
    body.position = ReadOnly(arrays_.position.View());
    body.orientation = ReadOnly(arrays_.orientation.View());
    body.size = ReadOnly(arrays_.size.View());
    body.is_inside = ReadOnly(arrays_.is_inside.View());
    body.moments = ReadOnly(arrays_.moments.View());
    body.links = ReadOnly(arrays_.links.View());
    body.sample_bins = sample_bins_.grid();
    body.sample_position = ReadOnly(sample_position_.View());
    body.sample_normal = ReadOnly(sample_normal_.View());
    body.moved = arrays_.moved.View();
    body.movement = arrays_.movement.View();
    ForEachSite("move sites", body);
    std::swap(arrays_.position, arrays_.moved);
  }

  void Split() {
    SplitView view;
    view.barrier = barrier_;
    view.criterion = {task_.split_limit, task_.barrier.lattice.point_volume()};
    view.state = State();
    view.capacity = capacity_;
    view.claim_count = ReadOnly(arrays_.claim_count.View());
    view.moments = ReadOnly(arrays_.moments.View());
    view.position = arrays_.position.View();
    view.orientation = arrays_.orientation.View();
    view.size = arrays_.size.View();
    view.is_inside = arrays_.is_inside.View();
    view.rank = arrays_.split_rank.View();
    executor_.ForEach("flag splits", capacity_ + 1, FlagSplitsBody{view});
    executor_.ExclusiveScan(arrays_.split_rank, capacity_ + 1);
    ForEachSite("split sites", SplitBody{view});
    executor_.ForEach("end the iteration", 1, AdvanceBody{view});
  }

  void Report(const int64_t* state) {
    if (!task_.on_iteration) return;
    const double mean_movement = static_cast<double>(state[kMovement]) * kMovementUnit /
                                 static_cast<double>(state[kMovedCount]);
    task_.on_iteration(static_cast<int32_t>(state[kIteration]), mean_movement, state[kSiteCount]);
  }

  // The volume of every cell where the sites came to rest.
  void MeasureCells() {
    SortIntoBins();
    Label(SecondMoments::kNone);
    ForEachSite("take point counts",
                PointCountBody{ReadOnly(arrays_.moments.View()), arrays_.movement.View()});
  }

  // All or nothing: whoever takes over from an executor that fails finds the task as it was.
  void Download() {
    std::vector<int64_t> state;
    Download(arrays_.state, kStateSize, state);
    const int64_t site_count = state[kSiteCount];
    RelaxationTask done;
    DownloadLater(arrays_.position, site_count, done.position);
    DownloadLater(arrays_.orientation, site_count, done.orientation);
    DownloadLater(arrays_.size, site_count, done.size);
    DownloadLater(arrays_.is_inside, site_count, done.is_inside);
    DownloadLater(arrays_.movement, site_count, done.point_count);
    executor_.Synchronize();
    if (executor_.Stopped()) return;
    task_.split_count = state[kSplitCount];
    task_.position = std::move(done.position);
    task_.orientation = std::move(done.orientation);
    task_.size = std::move(done.size);
    task_.is_inside = std::move(done.is_inside);
    task_.point_count = std::move(done.point_count);
  }

  E& executor_;
  RelaxationTask& task_;
  int64_t capacity_ = 0;
  float largest_size_ = 1.0f;
  BarrierView barrier_;
  RelaxationArrays<E> arrays_;
  GridBins<E> site_bins_;
  GridBins<E> sample_bins_;
  TileLabeller<E> labeller_;
  Array<int32_t> tile_side_;
  Array<uint32_t> inside_mask_;
  Array<LabelItem> items_;
  Array<Vec3f> sample_position_;
  Array<Vec3f> sample_normal_;
  Array<double> weight_at_;  // [iteration_count] w of eq. 4
};

}  // namespace amhex
