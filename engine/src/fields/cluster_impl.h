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
#include "exec/sorted_items.h"
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

// The sites of clusters as those who vote for their faces see them.
struct PutSiteBody {
  ArrayView<const Quaternion> frames;  // of nodes
  ArrayView<const ClusterSite> sites;
  ArrayView<Vec3d> position;
  ArrayView<AxisFrame> frame;
  AMHEX_HD void operator()(int64_t s) const {
    position[s] = sites[s].centre;
    frame[s] = ToFrame(frames[sites[s].node]);
  }
};

// Key of votes for sorting.
struct VotedFaceKey {
  bool is_of_a = false;
  AMHEX_HD uint32_t operator()(const VotedFaces& faces) const {
    return is_of_a ? faces.face_a : faces.face_b;
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
    const int64_t clusters =
        RowsBytes(count, task.rows) + E::SortBytes(count) +
        Larger(count * (kPairs + kOfNode), count * kOfRank + ChooseInTurnBytes(count));
    // Votes before and after a sort, and what it takes.
    constexpr int64_t kOfVote = 2 * sizeof(VotedFaces) + kPairs;
    const int64_t votes = count * 2 * static_cast<int64_t>(sizeof(int32_t)) +
                          kVotesPerNode * count * kOfVote + E::SortBytes(kVotesPerNode * count);
    return ResidentHullBytes<E>(task.hull, *task.resident) +
           UploadedArrays<E>::Bytes(task.lattice) + BytesOfViewsThere<E>(task.nodes) +
           Larger(clusters, votes);
  }

  // False if it was stopped.
  bool Run() {
    hull_ = ResidentHull<E>(task_.hull, *task_.resident);
    places_ = ViewsThere(arrays_, task_.nodes);
    lattice_ = arrays_.Upload(task_.lattice);
    rotations_ = Uploaded(executor_, task_.rotations.data, task_.rotations.size);
    const Buffer<E, ClusterSite> sites = FindClusters();
    const Buffer<E, VotedFaces> voted = Vote(sites);
    return CopyOut(sites, voted);
  }

 private:
  Buffer<E, ClusterSite> FindClusters() {
    BuiltRows<E> rows = BuildRows(executor_, task_.rows, lattice_.positions);
    const ClusterView clusters{lattice_, rows.View()};
    return Choose(clusters, RankNodes(clusters));
  }

  Buffer<E, int32_t> RankNodes(const ClusterView& clusters) {
    const int64_t count = task_.nodes.count();
    Buffer<E, float> mass = executor_.template Alloc<float>(count);
    executor_.ForEach("take the mass of nodes", count, MassBody{clusters, mass.View()});
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

  Buffer<E, ClusterSite> Choose(const ClusterView& clusters, const Buffer<E, int32_t>& by_rank) {
    const int64_t count = by_rank.size();
    Buffer<E, int32_t> rank = executor_.template Alloc<int32_t>(task_.nodes.count());
    Buffer<E, Vec3d> centre = executor_.template Alloc<Vec3d>(count);
    Buffer<E, ChoiceState> state = executor_.template Alloc<ChoiceState>(count);
    const RankedNodes ranked{by_rank.View(), rank.View(), centre.View(), state.View()};
    executor_.ForEach("no node has a rank", rank.size(), NoRankBody{rank.View()});
    executor_.ForEach("find centres of clusters", count,
                      RankBody{clusters, hull_, places_, ranked});
    ChooseInTurn(executor_, ClusterClaims{clusters, ranked}, state.View());
    return ListItems(executor_, "list clusters", count, ChosenSearch{ranked});
  }

  Buffer<E, VotedFaces> Vote(const Buffer<E, ClusterSite>& sites) {
    const int64_t nodes = task_.nodes.count();
    Buffer<E, Vec3d> position = executor_.template Alloc<Vec3d>(sites.size());
    Buffer<E, AxisFrame> frame = executor_.template Alloc<AxisFrame>(sites.size());
    Buffer<E, int32_t> nearest = executor_.template Alloc<int32_t>(nodes);
    executor_.ForEach("put sites", sites.size(),
                      PutSiteBody{lattice_.frames, sites.View(), position.View(), frame.View()});
    BuiltRows<E> rows = BuildRows(executor_, task_.site_rows, ReadOnly(position.View()));
    executor_.ForEach(
        "find the nearest sites", nodes,
        NearestSiteBody{lattice_, rows.View(), ReadOnly(position.View()), nearest.View()});
    const LatticeSteps steps{lattice_, places_, ReadOnly(rotations_.View())};
    const VoteSearch search{steps, {}, ReadOnly(frame.View()), ReadOnly(nearest.View())};
    return Counted(ListItems(executor_, "vote for faces", nodes, search), sites.size());
  }

  Buffer<E, VotedFaces> Counted(Buffer<E, VotedFaces> votes, int64_t site_count) {
    const auto largest =
        static_cast<uint32_t>(Larger(kDirectionCount * site_count - 1, int64_t{0}));
    votes = SortedBy<E>(executor_, votes, VotedFaceKey{false}, largest);
    votes = SortedBy<E>(executor_, votes, VotedFaceKey{true}, largest);
    return ListItems(executor_, "count votes", votes.size(),
                     CountVotesSearch{ReadOnly(votes.View())});
  }

  bool CopyOut(const Buffer<E, ClusterSite>& sites, const Buffer<E, VotedFaces>& voted) {
    std::vector<ClusterSite> host_sites(static_cast<size_t>(sites.size()));
    std::vector<VotedFaces> host_voted(static_cast<size_t>(voted.size()));
    executor_.CopyOutLater(sites, sites.size(), host_sites.data());
    executor_.CopyOutLater(voted, voted.size(), host_voted.data());
    executor_.Synchronize();
    if (executor_.Stopped()) return false;
    task_.sites = std::move(host_sites), task_.voted = std::move(host_voted);
    return true;
  }

  // Of what memory is set aside for; half of the edges ahead lead to another site.
  static constexpr int64_t kVotesPerNode = 4;

  E& executor_;
  ClusterTask& task_;
  UploadedArrays<E> arrays_;
  HullView hull_;
  CellCentres places_;
  LatticeView lattice_;
  Buffer<E, AxisRotation> rotations_;
};

}  // namespace amhex::fields
