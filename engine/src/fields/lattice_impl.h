// The steps from a closed lattice form to its sites with arrays where bodies run, with the bits of
// those on the host (field_sites.cpp): frames and sizes, thin walls, phases, clusters, votes.
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/resident_arrays.h"
#include "exec/uploaded_arrays.h"
#include "fields/cluster_impl.h"
#include "fields/find_neighbours.h"
#include "fields/lattice_task.h"
#include "fields/phase_impl.h"
#include "fields/wall_question.h"
#include "input/hull_batch_impl.h"

namespace amhex::fields {

struct CopyNumbersBody {
  ArrayView<const float> from;
  ArrayView<float> to;
  AMHEX_HD void operator()(int64_t k) const { to[k] = from[k]; }
};
struct NoPlaceBody {
  ArrayView<int32_t> place;
  AMHEX_HD void operator()(int64_t i) const { place[i] = -1; }
};
struct PutPlaceBody {
  ArrayView<const int32_t> nodes;
  ArrayView<int32_t> place;
  AMHEX_HD void operator()(int64_t k) const { place[nodes[k]] = static_cast<int32_t>(k); }
};
struct PutLatticeSiteBody {
  LatticeView lattice;
  ArrayView<const ClusterSite> clusters;
  ArrayView<LatticeSite> sites;
  AMHEX_HD void operator()(int64_t s) const {
    const ClusterSite& cluster = clusters[s];
    sites[s] = {cluster.centre, lattice.frames[cluster.node], lattice.sizes[cluster.node]};
  }
};
// The box around so many boxes; one element per group of them.
struct JoinBoxesBody {
  static constexpr int64_t kPerGroup = 256;
  ArrayView<const Vec3d> low, high;
  ArrayView<Vec3d> joined_low, joined_high;
  AMHEX_HD void operator()(int64_t group) const {
    const int64_t begin = group * kPerGroup, end = Smaller(low.size, begin + kPerGroup);
    Vec3d least = low[begin], most = high[begin];
    for (int64_t i = begin + 1; i < end; ++i) {
      for (int a = 0; a < 3; ++a) {
        least[a] = Smaller(least[a], low[i][a]), most[a] = Larger(most[a], high[i][a]);
      }
    }
    joined_low[group] = least, joined_high[group] = most;
  }
};

// One object per task.
template <class E>
class SitesOfLattice {
 public:
  SitesOfLattice(E& executor, LatticeTask& task)
      : executor_(executor), task_(task), arrays_(executor), count_(task.nodes.count()) {}

  // Memory where bodies run, beyond what is there.
  static int64_t Bytes(const LatticeTask& task) {
    const int64_t count = task.nodes.count();
    constexpr int64_t kLattice = sizeof(Quaternion) + 2 * sizeof(Vec3d);
    const int64_t links = *task.links_there != nullptr ? 0 : UploadedArrays<E>::Bytes(task.links);
    return links + ResidentHullBytes<E>(task.hull, *task.resident) +
           BytesOfViewsThere<E>(task.nodes) + BytesOfViewsThere<E>(task.at_hull) +
           BytesToCome(task.expected.frames, *task.form_there.frames) +
           BytesToCome(task.expected.sizes, *task.form_there.sizes) +
           BytesToCome(task.closed, *task.form_there.increments) +
           Larger(Larger(PhaseSolve<E>::Bytes(count), SiteClustering<E>::CountBytes(count)),
                  count * kLattice + SiteClustering<E>::Bytes(count));
  }

  // False if it was stopped.
  bool Run() {
    Upload();
    FindScale();
    if (executor_.Stopped()) return false;
    return FindSites(SolvePhases());
  }

 private:
  template <class T>
  using Array = Buffer<E, T>;

  // The form of this trial, with cells that fit into thin walls.
  struct Form {
    Array<float> increments;
    Array<CellSteps> steps;
    Array<Quaternion> frames;
    Array<Vec3d> sizes;
    FormView View() { return {increments.View(), steps.View(), frames.View(), sizes.View()}; }
  };
  struct Demands {
    Array<float> increments, weights, targets;
    PhaseDemands demands;
  };

  void Upload() {
    hull_ = ResidentHull<E>(task_.hull, *task_.resident);
    nodes_ = ViewsThere(arrays_, task_.nodes);
    expected_ = {ArrayThere(task_.expected.frames, *task_.form_there.frames),
                 ArrayThere(task_.expected.sizes, *task_.form_there.sizes), task_.expected.spacing};
    at_hull_ = ViewsThere(arrays_, task_.at_hull);
    closed_ = ArrayThere(task_.closed, *task_.form_there.increments);
    rotations_ = arrays_.UploadArray(task_.rotations);
    links_ = LinksThere();
  }
  template <class T>
  static int64_t BytesToCome(ArrayView<const T> host, const ResidentSlot& slot) {
    return slot != nullptr ? 0 : host.size * static_cast<int64_t>(sizeof(T));
  }
  template <class T>
  static ArrayView<const T> ArrayThere(ArrayView<const T> host, ResidentSlot& slot) {
    return Resident<E>(slot,
                       [host](UploadedArrays<E>& arrays) { return arrays.UploadArray(host); });
  }
  NodeLinks LinksThere() {
    return Resident<E>(*task_.links_there, [this](UploadedArrays<E>& arrays) {
      NodeLinks there = task_.links;
      there.neighbours = {};
      there = arrays.Upload(there);
      const auto neighbours = arrays.template AddArray<int32_t>(task_.links.neighbours.size);
      arrays.executor().ForEach("find neighbours", count_,
                                FindAxisNeighboursBody{nodes_.keys, neighbours});
      there.neighbours = ReadOnly(neighbours);
      return there;
    });
  }

  Array<CellSteps> FindSteps() {
    Array<CellSteps> steps = executor_.template Alloc<CellSteps>(count_);
    executor_.ForEach("find steps", count_,
                      FindStepsBody{links_, expected_, closed_, steps.View()});
    return steps;
  }

  // The host takes the cube root: its last bits are the mathematics library's.
  void FindScale() {
    Array<CellSteps> steps = FindSteps();
    Array<double> partial = executor_.template Alloc<double>(SumBlocks(count_));
    executor_.ForEach("sum densities", partial.size(),
                      SumDensityBody{ReadOnly(steps.View()), partial.View()});
    std::vector<double> sums(static_cast<size_t>(partial.size()));
    executor_.CopyOut(partial, partial.size(), sums.data());
    scale_ = RefinementFor(task_.density, {sums.data(), partial.size()}, count_);
  }

  enum class With { kIncrements, kNoIncrements };
  Form MakeForm(With with) {
    const double denser = std::cbrt(task_.denser);
    Form form;
    form.steps = FindSteps();
    form.frames = executor_.template Alloc<Quaternion>(count_);
    form.sizes = executor_.template Alloc<Vec3d>(count_);
    executor_.ForEach("recover frames", count_, RecoverBody{expected_, scale_, form.View()});
    executor_.ForEach("make cells denser", count_, DenserBody{denser, form.View()});
    if (with == With::kIncrements) {
      form.increments = executor_.template Alloc<float>(kIncrements * count_);
      const ArrayView<float> increments = form.increments.View();
      executor_.ForEach("copy increments", increments.size, CopyNumbersBody{closed_, increments});
      executor_.ForEach("scale increments", increments.size,
                        ScaleIncrementsBody{scale_, increments});
      executor_.ForEach("scale increments", increments.size,
                        ScaleIncrementsBody{denser, increments});
    }
    Lower(form);
    return form;
  }

  void Lower(Form& form) {
    Array<Vec3d> lowerings = executor_.template Alloc<Vec3d>(at_hull_.count());
    Array<int32_t> place = executor_.template Alloc<int32_t>(count_);
    const WallLoweringOf question{at_hull_, ReadOnly(form.frames.View()),
                                  ReadOnly(form.sizes.View()), expected_.spacing};
    executor_.ForEach("measure walls", at_hull_.count(),
                      AskBody<WallLoweringOf>{hull_, question, lowerings.View()});
    executor_.ForEach("no node is at the hull", count_, NoPlaceBody{place.View()});
    executor_.ForEach("place nodes at the hull", at_hull_.count(),
                      PutPlaceBody{at_hull_.nodes, place.View()});
    executor_.ForEach(
        "lower cells", count_,
        LowerBody{links_, ReadOnly(place.View()), ReadOnly(lowerings.View()), form.View()});
  }

  Demands MakeDemands() {
    Form form = MakeForm(With::kIncrements);
    Demands made;
    made.weights = executor_.template Alloc<float>(3 * at_hull_.count());
    made.targets = executor_.template Alloc<float>(6 * at_hull_.count());
    executor_.ForEach(
        "find the hull's wishes", at_hull_.count(),
        FindWishesBody{at_hull_, nodes_, ReadOnly(form.frames.View()), ReadOnly(form.sizes.View()),
                       task_.course.hull_weight, made.weights.View(), made.targets.View()});
    made.increments = std::move(form.increments);
    made.demands = {ReadOnly(made.increments.View()),
                    {at_hull_.nodes, ReadOnly(made.weights.View()), ReadOnly(made.targets.View())}};
    return made;
  }

  // What the solves take is gone when this returns.
  Array<float> SolvePhases() {
    PhaseSolve<E> phases(executor_, task_.course, count_);
    return phases.Run(nodes_.keys, links_, [this] { return MakeDemands(); });
  }

  bool FindSites(Array<float> x) {
    Form form = MakeForm(With::kNoIncrements);
    Array<Vec3d> positions = executor_.template Alloc<Vec3d>(count_);
    executor_.ForEach("find positions", count_,
                      FindPositionBody{nodes_, ReadOnly(form.steps.View()), ReadOnly(x.View()),
                                       positions.View()});
    executor_.ForEach("project positions", at_hull_.count(),
                      ProjectToLayersBody{at_hull_, ReadOnly(form.frames.View()),
                                          ReadOnly(form.sizes.View()), positions.View()});
    x = {}, form.steps = {};
    const Box3d box = BoxOf(ReadOnly(positions.View()));
    if (executor_.Stopped()) return false;
    const LatticeView lattice{ReadOnly(form.frames.View()), ReadOnly(form.sizes.View()),
                              ReadOnly(positions.View())};
    SiteClustering<E> clustering(executor_, {lattice, nodes_, hull_}, rotations_);
    const Array<ClusterSite> clusters = clustering.FindClusters(box);
    Array<LatticeSite> sites = executor_.template Alloc<LatticeSite>(clusters.size());
    executor_.ForEach("put sites of the lattice", sites.size(),
                      PutLatticeSiteBody{lattice, clusters.View(), sites.View()});
    Array<VotedFaces> votes = clustering.Vote(clusters, box);
    form = {}, positions = {};
    return CopyOut(sites, SiteClustering<E>::Count(executor_, std::move(votes), sites.size()));
  }

  Box3d BoxOf(ArrayView<const Vec3d> points) {
    Array<Vec3d> low, high;
    ArrayView<const Vec3d> lows = points, highs = points;
    do {
      const int64_t groups = (lows.size + JoinBoxesBody::kPerGroup - 1) / JoinBoxesBody::kPerGroup;
      Array<Vec3d> joined_low = executor_.template Alloc<Vec3d>(groups);
      Array<Vec3d> joined_high = executor_.template Alloc<Vec3d>(groups);
      executor_.ForEach("join boxes", groups,
                        JoinBoxesBody{lows, highs, joined_low.View(), joined_high.View()});
      std::swap(low, joined_low), std::swap(high, joined_high);
      lows = ReadOnly(low.View()), highs = ReadOnly(high.View());
    } while (lows.size > 1);
    Box3d box;
    executor_.CopyOutLater(low, 1, &box.low);
    executor_.CopyOutLater(high, 1, &box.high);
    executor_.Synchronize();
    return box;
  }

  bool CopyOut(const Array<LatticeSite>& sites, const Array<VotedFaces>& voted) {
    std::vector<LatticeSite> host_sites(static_cast<size_t>(sites.size()));
    std::vector<VotedFaces> host_voted(static_cast<size_t>(voted.size()));
    executor_.CopyOutLater(sites, sites.size(), host_sites.data());
    executor_.CopyOutLater(voted, voted.size(), host_voted.data());
    executor_.Synchronize();
    if (executor_.Stopped()) return false;
    task_.sites = std::move(host_sites), task_.voted = std::move(host_voted);
    return true;
  }

  E& executor_;
  LatticeTask& task_;
  UploadedArrays<E> arrays_;
  int64_t count_;
  double scale_ = 1;
  HullView hull_;
  CellCentres nodes_;
  ExpectedView expected_;
  HullNodes at_hull_;
  ArrayView<const float> closed_;
  NodeLinks links_;
  ArrayView<const AxisRotation> rotations_;
};

}  // namespace amhex::fields
