// The clustering of site_clusters.h with arrays where bodies run: the same sites as one choice
// after the other, in rounds. In each a node is chosen if no node that is heavier, still undecided,
// would claim it.
#pragma once

#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

#include "exec/choose_in_turn.h"
#include "exec/counted_list.h"
#include "exec/executor.h"
#include "exec/resident_arrays.h"
#include "exec/uploaded_arrays.h"
#include "fields/cluster_task.h"
#include "fields/point_rows_impl.h"
#include "input/hull_batch_impl.h"

namespace amhex::fields {

struct MassBody {
  ClusterView clusters;
  ArrayView<float> mass;
  AMHEX_HD void operator()(int64_t node) const { mass[node] = clusters.Mass(node); }
};

struct HeavySearch {
  using Item = int32_t;
  ArrayView<const float> mass;
  float least = 0;
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t node, const Visit& visit) const {
    if (mass[node] >= least) visit(static_cast<int32_t>(node));
  }
};

// Heavier ones first; masses are positive.
struct KeyByMassBody {
  ArrayView<const float> mass;
  ArrayView<const int32_t> heavy;
  ArrayView<uint32_t> key;
  ArrayView<int32_t> id;
  AMHEX_HD void operator()(int64_t i) const {
    id[i] = heavy[i];
    key[i] = ~std::bit_cast<uint32_t>(mass[heavy[i]]);
  }
};

// Heavy nodes by their rank.
struct RankedNodes {
  ArrayView<const int32_t> node;  // by rank
  ArrayView<int32_t> rank;        // by node; -1: not heavy
  ArrayView<Vec3d> centre;
  ArrayView<ChoiceState> state;
};

// Of positions, for choosing in turn.
struct ClusterClaims {
  ClusterView clusters;
  RankedNodes ranked;
  template <class Visit>
  AMHEX_HD void VisitClaimed(int32_t r, const Visit& visit) const {
    clusters.VisitClaimed(ranked.node[r], ranked.centre[r], [&](int32_t j) {
      if (ranked.rank[j] >= 0) visit(ranked.rank[j]);
    });
  }
};

struct NoRankBody {
  ArrayView<int32_t> rank;
  AMHEX_HD void operator()(int64_t node) const { rank[node] = -1; }
};
struct RankBody {
  ClusterView clusters;
  HullView hull;
  CellCentres places;
  RankedNodes ranked;
  AMHEX_HD void operator()(int64_t r) const {
    const int32_t node = ranked.node[r];
    ranked.rank[node] = static_cast<int32_t>(r);
    const Vec3d centre = clusters.Centre(node);
    ranked.centre[r] = centre;
    ranked.state[r] = clusters.IsWellInside(hull, node, places[node], centre)
                          ? ChoiceState::kUndecided
                          : ChoiceState::kOut;
  }
};

struct ChosenSearch {
  using Item = ClusterSite;
  RankedNodes ranked;
  template <class Visit>
  AMHEX_HD void VisitItems(int64_t r, const Visit& visit) const {
    if (ranked.state[r] != ChoiceState::kChosen) return;
    visit(ClusterSite{ranked.node[r], ranked.centre[r]});
  }
};

template <class E>
class SiteClustering {
 public:
  SiteClustering(E& executor, ClusterTask& task)
      : executor_(executor), task_(task), arrays_(executor) {}

  // Memory where bodies run, as if every node were heavy.
  static int64_t Bytes(const ClusterTask& task) {
    const int64_t count = task.nodes.count();
    constexpr int64_t kPairs = 2 * (sizeof(uint32_t) + sizeof(int32_t));
    constexpr int64_t kOfNode = sizeof(float) + sizeof(int32_t);  // mass, and the heavy ones
    constexpr int64_t kOfRank = sizeof(int32_t) * 2 + sizeof(Vec3d) + sizeof(ChoiceState);
    return ResidentHullBytes<E>(task.hull, *task.resident) +
           UploadedArrays<E>::Bytes(task.lattice) + BytesOfViewsThere<E>(task.nodes) +
           RowsBytes(count, task.rows) + E::SortBytes(count) +
           Larger(count * (kPairs + kOfNode), count * kOfRank + ChooseInTurnBytes(count));
  }

  // False if it was stopped.
  bool Run() {
    hull_ = ResidentHull<E>(task_.hull, *task_.resident);
    places_ = ViewsThere(arrays_, task_.nodes);
    const LatticeView lattice = arrays_.Upload(task_.lattice);
    rows_ = BuildRows(executor_, task_.rows, lattice.positions);
    clusters_ = {lattice, rows_.View()};
    const Buffer<E, int32_t> by_rank = RankNodes();
    if (executor_.Stopped()) return false;
    return Choose(by_rank);
  }

 private:
  Buffer<E, int32_t> RankNodes() {
    const int64_t count = task_.nodes.count();
    Buffer<E, float> mass = executor_.template Alloc<float>(count);
    executor_.ForEach("take the mass of nodes", count, MassBody{clusters_, mass.View()});
    const Buffer<E, int32_t> heavy = ListItems(
        executor_, "list heavy nodes", count, HeavySearch{ReadOnly(mass.View()), task_.least_mass});
    KeyedIds<E> pairs{executor_.template Alloc<uint32_t>(heavy.size()),
                      executor_.template Alloc<int32_t>(heavy.size())};
    KeyedIds<E> sorted{executor_.template Alloc<uint32_t>(heavy.size()),
                       executor_.template Alloc<int32_t>(heavy.size())};
    executor_.ForEach(
        "key nodes by mass", heavy.size(),
        KeyByMassBody{ReadOnly(mass.View()), heavy.View(), pairs.key.View(), pairs.id.View()});
    executor_.SortByKey(pairs, heavy.size(), ~uint32_t{0}, sorted);
    return std::move(sorted.id);
  }

  bool Choose(const Buffer<E, int32_t>& by_rank) {
    const int64_t count = by_rank.size();
    Buffer<E, int32_t> rank = executor_.template Alloc<int32_t>(task_.nodes.count());
    Buffer<E, Vec3d> centre = executor_.template Alloc<Vec3d>(count);
    Buffer<E, ChoiceState> state = executor_.template Alloc<ChoiceState>(count);
    const RankedNodes ranked{by_rank.View(), rank.View(), centre.View(), state.View()};
    executor_.ForEach("no node has a rank", rank.size(), NoRankBody{rank.View()});
    executor_.ForEach("find centres of clusters", count,
                      RankBody{clusters_, hull_, places_, ranked});
    ChooseInTurn(executor_, ClusterClaims{clusters_, ranked}, state.View());
    return CopyOut(ranked);
  }

  bool CopyOut(const RankedNodes& ranked) {
    const Buffer<E, ClusterSite> chosen =
        ListItems(executor_, "list clusters", ranked.node.size, ChosenSearch{ranked});
    std::vector<ClusterSite> sites(static_cast<size_t>(chosen.size()));
    executor_.CopyOut(chosen, chosen.size(), sites.data());
    if (executor_.Stopped()) return false;
    task_.sites = std::move(sites);
    return true;
  }

  E& executor_;
  ClusterTask& task_;
  UploadedArrays<E> arrays_;
  HullView hull_;
  CellCentres places_;
  BuiltRows<E> rows_;
  ClusterView clusters_;
};

}  // namespace amhex::fields
