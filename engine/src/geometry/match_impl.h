// Matching and merging (match_and_merge.h) with arrays where bodies run. Pairs are worked off as
// one after the other would be, in rounds (glue_in_turn.h).
#pragma once

#include <array>
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
#include "geometry/label_hull_impl.h"
#include "geometry/match_task.h"
#include "input/hull_batch_impl.h"

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
  const int64_t hull =
      task.resident == nullptr ? 0 : ResidentHullBytes<E>(task.hull, *task.resident);
  return hull + UploadedArrays<E>::Bytes(task.search) +
         cubes * 6 * static_cast<int64_t>(sizeof(int32_t)) + cubes * 8 * kPerVirtual +
         SortPairsBytes<E>(pairs);
}

template <class E>
class MatchingOfCubes {
  using FaceMatches = std::array<int32_t, 6>;

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
        matches_(executor.template Alloc<FaceMatches>(count_)),
        reserved_(executor.template Alloc<uint64_t>(8 * count_)) {}

  // False if it was stopped.
  bool Run() {
    CandidateSearch search = arrays_.Upload(task_.search);
    if (task_.resident != nullptr) {
      search.cubes.hull = ResidentHull<E>(task_.hull, *task_.resident);
    }
    sets_ = {search.cubes, parent_.View(), size_.View(),           ring_next_.View(),
             low_.View(),  high_.View(),   Flat<int32_t>(matches_)};
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
    Merged merged;
    merged.corners = executor_.template Alloc<CellCorners>(count_);
    executor_.ForEach("find first members", 8 * count_, SmallestMemberBody{sets_, smallest.View()});
    executor_.ForEach("count vertices", 8 * count_ + 1,
                      CountVertexBody{ReadOnly(smallest.View()), id.View()});
    executor_.ExclusiveScan(id, 8 * count_ + 1);
    const int64_t vertex_count = LastElement(executor_, id);
    if (executor_.Stopped()) return false;
    merged.vertices = executor_.template Alloc<Vec3d>(vertex_count);
    executor_.ForEach("average vertices", 8 * count_,
                      PutVertexBody{sets_, ReadOnly(smallest.View()), ReadOnly(id.View()),
                                    Flat<int32_t>(merged.corners), merged.vertices.View()});
    if (task_.resident != nullptr) Label(merged);
    return Download(merged);
  }

  // What comes of it.
  struct Merged {
    Buffer<E, Vec3d> vertices;
    Buffer<E, CellCorners> corners;
    Buffer<E, uint8_t> hull_faces, on_hull;
  };

  void Label(Merged& merged) {
    merged.hull_faces = executor_.template Alloc<uint8_t>(count_);
    merged.on_hull = executor_.template Alloc<uint8_t>(merged.vertices.size());
    LabelHull(executor_, ResidentHull<E>(task_.hull, *task_.resident),
              {sets_.cubes, ReadOnly(merged.vertices.View()), ReadOnly(merged.corners.View()),
               ReadOnly(matches_.View())},
              {merged.hull_faces.View(), merged.on_hull.View()}, merged.vertices.View());
  }

  bool Download(const Merged& merged) {
    MatchTask done;
    DownloadLater(merged.vertices, done.vertices);
    DownloadLater(merged.corners, done.corners);
    DownloadLater(matches_, done.matches);
    DownloadLater(merged.hull_faces, done.hull_faces);
    DownloadLater(merged.on_hull, done.on_hull);
    executor_.Synchronize();
    if (executor_.Stopped()) return false;
    task_.vertices = std::move(done.vertices);
    task_.corners = std::move(done.corners), task_.matches = std::move(done.matches);
    task_.hull_faces = std::move(done.hull_faces), task_.on_hull = std::move(done.on_hull);
    return true;
  }
  // The host has it once it has synchronized.
  template <class T>
  void DownloadLater(const Buffer<E, T>& buffer, std::vector<T>& host) {
    host.resize(static_cast<size_t>(buffer.size()));
    executor_.CopyOutLater(buffer, buffer.size(), host.data());
  }
  // Arrays of numbers, one number at a time.
  template <class T, class Array>
  static ArrayView<T> Flat(Buffer<E, Array>& buffer) {
    constexpr int64_t kLength = sizeof(Array) / sizeof(T);
    return {reinterpret_cast<T*>(buffer.View().data), kLength * buffer.size()};
  }

  E& executor_;
  MatchTask& task_;
  UploadedArrays<E> arrays_;
  int64_t count_;
  Buffer<E, int32_t> parent_, size_, ring_next_;
  Buffer<E, Vec3d> low_, high_;
  Buffer<E, FaceMatches> matches_;
  Buffer<E, uint64_t> reserved_;  // [virtual vertex] the first pair that wants a set, at its root
  MergeView sets_;
};

}  // namespace amhex
