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
#include "exec/sorted_items.h"
#include "fields/cluster_input.h"
#include "fields/point_rows_impl.h"

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

// Of arrays that are where bodies run.
template <class E>
class SiteClustering {
 public:
  // `rotations` are kAxisRotations.
  SiteClustering(E& executor, const ClusterInput& input, ArrayView<const AxisRotation> rotations)
      : executor_(executor), input_(input), rotations_(rotations) {}

  // Memory where bodies run besides the lattice, as if every node were heavy, and but for the rows
  // of points.
  static int64_t Bytes(int64_t count) {
    constexpr int64_t kPairs = 2 * (sizeof(uint32_t) + sizeof(int32_t));
    constexpr int64_t kOfNode = sizeof(float) + sizeof(int32_t);  // mass, and the heavy ones
    constexpr int64_t kOfRank = sizeof(int32_t) * 2 + sizeof(Vec3d) + sizeof(ChoiceState);
    constexpr int64_t kOfVotes = 2 * sizeof(int32_t) + kVotesPerNode * sizeof(VotedFaces);
    const int64_t clusters =
        count * static_cast<int64_t>(sizeof(RowItem)) + E::SortBytes(count) +
        Larger(count * (kPairs + kOfNode), count * kOfRank + ChooseInTurnBytes(count));
    return Larger(clusters, count * kOfVotes);
  }
  // For counting votes, when the lattice may be gone.
  static int64_t CountBytes(int64_t count) {
    constexpr int64_t kOfVote = 2 * (sizeof(VotedFaces) + sizeof(uint32_t) + sizeof(int32_t));
    return kVotesPerNode * count * kOfVote + E::SortBytes(kVotesPerNode * count);
  }

  // By falling mass; `box` holds all positions.
  Buffer<E, ClusterSite> FindClusters(const Box3d& box) {
    BuiltRows<E> rows =
        BuildRows(executor_, ShapeOfRows(box, input_.nodes.count(), kClusterBinSize),
                  input_.lattice.positions);
    const ClusterView clusters{input_.lattice, rows.View()};
    return Choose(clusters, RankNodes(clusters));
  }

  // Which faces the edges of the grid want glued (face_links.h), one vote each.
  Buffer<E, VotedFaces> Vote(const Buffer<E, ClusterSite>& sites, Box3d box) {
    // Means of what is in the box may lie outside by rounding.
    constexpr Vec3d kRoom{0.5, 0.5, 0.5};
    box = {box.low - kRoom, box.high + kRoom};
    const int64_t nodes = input_.nodes.count();
    Buffer<E, Vec3d> position = executor_.template Alloc<Vec3d>(sites.size());
    Buffer<E, AxisFrame> frame = executor_.template Alloc<AxisFrame>(sites.size());
    Buffer<E, int32_t> nearest = executor_.template Alloc<int32_t>(nodes);
    executor_.ForEach(
        "put sites", sites.size(),
        PutSiteBody{input_.lattice.frames, sites.View(), position.View(), frame.View()});
    BuiltRows<E> rows = BuildRows(executor_, ShapeOfRows(box, sites.size(), kSiteBinSize),
                                  ReadOnly(position.View()));
    executor_.ForEach(
        "find the nearest sites", nodes,
        NearestSiteBody{input_.lattice, rows.View(), ReadOnly(position.View()), nearest.View()});
    const LatticeSteps steps{input_.lattice, input_.nodes, rotations_};
    const VoteSearch search{steps, {}, ReadOnly(frame.View()), ReadOnly(nearest.View())};
    return ListItems(executor_, "vote for faces", nodes, search);
  }

  // Those that are many enough.
  static Buffer<E, VotedFaces> Count(E& executor, Buffer<E, VotedFaces> votes, int64_t site_count) {
    const auto largest =
        static_cast<uint32_t>(Larger(kDirectionCount * site_count - 1, int64_t{0}));
    votes = SortedBy<E>(executor, votes, VotedFaceKey{false}, largest);
    votes = SortedBy<E>(executor, votes, VotedFaceKey{true}, largest);
    return ListItems(executor, "count votes", votes.size(),
                     CountVotesSearch{ReadOnly(votes.View())});
  }

 private:
  Buffer<E, int32_t> RankNodes(const ClusterView& clusters) {
    const int64_t count = input_.nodes.count();
    Buffer<E, float> mass = executor_.template Alloc<float>(count);
    executor_.ForEach("take the mass of nodes", count, MassBody{clusters, mass.View()});
    const Buffer<E, int32_t> heavy =
        ListItems(executor_, "list heavy nodes", count,
                  HeavySearch{ReadOnly(mass.View()), static_cast<float>(kMinMass)});
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
    Buffer<E, int32_t> rank = executor_.template Alloc<int32_t>(input_.nodes.count());
    Buffer<E, Vec3d> centre = executor_.template Alloc<Vec3d>(count);
    Buffer<E, ChoiceState> state = executor_.template Alloc<ChoiceState>(count);
    const RankedNodes ranked{by_rank.View(), rank.View(), centre.View(), state.View()};
    executor_.ForEach("no node has a rank", rank.size(), NoRankBody{rank.View()});
    executor_.ForEach("find centres of clusters", count,
                      RankBody{clusters, input_.hull, input_.nodes, ranked});
    ChooseInTurn(executor_, ClusterClaims{clusters, ranked}, state.View());
    return ListItems(executor_, "list clusters", count, ChosenSearch{ranked});
  }

  // Of what memory is set aside for; half of the edges ahead lead to another site.
  static constexpr int64_t kVotesPerNode = 4;

  E& executor_;
  ClusterInput input_;
  ArrayView<const AxisRotation> rotations_;
};

}  // namespace amhex::fields
