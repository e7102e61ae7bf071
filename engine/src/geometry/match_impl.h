// Matching and merging (match_and_merge.h) with arrays where bodies run. Pairs are worked off as
// one after the other would be, in rounds (glue_in_turn.h).
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "exec/counted_list.h"
#include "exec/executor.h"
#include "exec/last_element.h"
#include "exec/uploaded_arrays.h"
#include "geometry/close_cuts.h"
#include "geometry/cut_search.h"
#include "geometry/glue_in_turn.h"
#include "geometry/match_task.h"

namespace amhex {

struct StartSetsBody {
  MergeView sets;
  AMHEX_HD void operator()(int64_t v) const {
    sets.Start(v);
    if (v < sets.matches.size) sets.matches[v] = -1;
  }
};

// Of every virtual vertex, the smallest that it is merged with.
struct SmallestMemberBody {
  MergeView sets;
  ArrayView<int32_t> smallest;
  AMHEX_HD void operator()(int64_t v) const {
    auto least = static_cast<int32_t>(v);
    sets.VisitMembers(least, [&least](int32_t member) { least = Smaller(least, member); });
    smallest[v] = least;
  }
};
// One element per virtual vertex and one more, which gets zero.
struct CountVertexBody {
  ArrayView<const int32_t> smallest;
  ArrayView<int32_t> count;
  AMHEX_HD void operator()(int64_t v) const {
    count[v] = v < smallest.size && smallest[v] == v ? 1 : 0;
  }
};
struct PutVertexBody {
  MergeView sets;
  ArrayView<const int32_t> smallest, id;
  ArrayView<int32_t> corner;  // [virtual vertex]
  ArrayView<Vec3d> vertices;
  AMHEX_HD void operator()(int64_t v) const {
    corner[v] = id[smallest[v]];
    if (smallest[v] != v) return;
    // The members' mean, summed by rising number.
    Vec3d sum;
    int32_t count = 0;
    for (auto member = static_cast<int32_t>(v); member >= 0; ++count) {
      sum += sets.cubes.VirtualVertex(member);
      int32_t next = -1;
      sets.VisitMembers(member, [&](int32_t other) {
        if (other > member && (next < 0 || other < next)) next = other;
      });
      member = next;
    }
    vertices[id[v]] = sum / count;
  }
};

// Memory where bodies run, but for what the sums and scans need.
template <class E>
int64_t MatchBytes(const MatchTask& task) {
  // Every cube in a lattice is the larger of three pairs; gaps and clusters add some.
  constexpr int64_t kPairsPerCube = 4;
  constexpr int64_t kPerVirtual = 3 * sizeof(int32_t) + 2 * sizeof(Vec3d) + sizeof(uint64_t);
  const int64_t cubes = task.search.cubes.centre.size;
  const int64_t pairs = kPairsPerCube * cubes;
  return UploadedArrays<E>::Bytes(task.search) + cubes * 6 * static_cast<int64_t>(sizeof(int32_t)) +
         cubes * 8 * kPerVirtual + SortPairsBytes<E>(pairs);
}

template <class E>
class MatchingOfCubes {
 public:
  MatchingOfCubes(E& executor, MatchTask& task)
      : executor_(executor),
        task_(task),
        arrays_(executor),
        count_(task.search.cubes.centre.size),
        parent_(executor.template Alloc<int32_t>(8 * count_)),
        size_(executor.template Alloc<int32_t>(8 * count_)),
        ring_next_(executor.template Alloc<int32_t>(8 * count_)),
        low_(executor.template Alloc<Vec3d>(8 * count_)),
        high_(executor.template Alloc<Vec3d>(8 * count_)),
        matches_(executor.template Alloc<int32_t>(6 * count_)),
        reserved_(executor.template Alloc<uint64_t>(8 * count_)) {}

  // False if it was stopped.
  bool Run() {
    const CandidateSearch search = arrays_.Upload(task_.search);
    sets_ = {search.cubes, parent_.View(), size_.View(),   ring_next_.View(),
             low_.View(),  high_.View(),   matches_.View()};
    executor_.ForEach("start merge sets", 8 * count_, StartSetsBody{sets_});
    const Buffer<E, FacePair> pairs = SortedFully(
        executor_, ListItems(executor_, "find face candidates", count_, search), count_);
    for (const Collapse collapse : kMatchPasses) {
      for (const double level : kMatchLevels) {
        if (executor_.Stopped()) return false;
        Glue({pairs.View(), level, collapse});
        CloseAllCuts({level + kCutMargin, collapse});
        if (task_.on_level) task_.on_level();
      }
    }
    return CopyOut();
  }

 private:
  int64_t Glue(const GlueRules& rules) {
    return GlueInTurn(executor_, sets_, rules, reserved_.View());
  }

  void CloseAllCuts(const CutRules& rules) {
    for (int round = 0; round < kMaxCutRounds && !executor_.Stopped(); ++round) {
      const Buffer<E, OpenEdge> edges = SortedEdges(
          executor_, ListItems(executor_, "list open edges", count_, OpenEdgeSearch{sets_}),
          8 * count_);
      const Buffer<E, FacePair> cuts =
          SortedByScore(executor_, ListItems(executor_, "find cuts", edges.size(),
                                             CutSearch{sets_.cubes, edges.View(), rules.max_gap}));
      if (Glue({cuts.View(), rules.max_gap, rules.collapse}) == 0) break;
    }
  }

  bool CopyOut() {
    Buffer<E, int32_t> smallest = executor_.template Alloc<int32_t>(8 * count_);
    Buffer<E, int32_t> id = executor_.template Alloc<int32_t>(8 * count_ + 1);
    Buffer<E, int32_t> corner = executor_.template Alloc<int32_t>(8 * count_);
    executor_.ForEach("find first members", 8 * count_, SmallestMemberBody{sets_, smallest.View()});
    executor_.ForEach("count vertices", 8 * count_ + 1,
                      CountVertexBody{ReadOnly(smallest.View()), id.View()});
    executor_.ExclusiveScan(id, 8 * count_ + 1);
    const int64_t vertex_count = LastElement(executor_, id);
    if (executor_.Stopped()) return false;
    Buffer<E, Vec3d> vertices = executor_.template Alloc<Vec3d>(vertex_count);
    executor_.ForEach("average vertices", 8 * count_,
                      PutVertexBody{sets_, ReadOnly(smallest.View()), ReadOnly(id.View()),
                                    corner.View(), vertices.View()});
    std::vector<Vec3d> host_vertices(static_cast<size_t>(vertex_count));
    std::vector<CellCorners> corners(static_cast<size_t>(count_));
    std::vector<std::array<int32_t, 6>> matches(static_cast<size_t>(count_));
    executor_.CopyOutLater(vertices, vertex_count, host_vertices.data());
    if (count_ > 0) {
      executor_.CopyOutLater(corner, 8 * count_, corners.data()->data());
      executor_.CopyOutLater(matches_, 6 * count_, matches.data()->data());
    }
    executor_.Synchronize();
    if (executor_.Stopped()) return false;
    task_.vertices = std::move(host_vertices);
    task_.corners = std::move(corners), task_.matches = std::move(matches);
    return true;
  }

  E& executor_;
  MatchTask& task_;
  UploadedArrays<E> arrays_;
  int64_t count_;
  Buffer<E, int32_t> parent_, size_, ring_next_;
  Buffer<E, Vec3d> low_, high_;
  Buffer<E, int32_t> matches_;
  Buffer<E, uint64_t> reserved_;  // [virtual vertex] the first pair that wants a set, at its root
  MergeView sets_;
};

}  // namespace amhex
