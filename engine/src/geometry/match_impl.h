// The search of match_task.h with arrays where bodies run: candidates are counted, then listed.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "exec/executor.h"
#include "exec/last_element.h"
#include "exec/uploaded_arrays.h"
#include "geometry/match_task.h"

namespace amhex {

// One element per cube and one more, which gets zero.
struct CountCandidatesBody {
  CandidateSearch search;
  ArrayView<int32_t> count;
  AMHEX_HD void operator()(int64_t a) const {
    int32_t found = 0;
    if (a < search.cubes.centre.size) {
      search.VisitCandidates(static_cast<int32_t>(a), [&](const FaceCandidate&) { ++found; });
    }
    count[a] = found;
  }
};

struct ListCandidatesBody {
  CandidateSearch search;
  ArrayView<const int32_t> first;  // [cube] where its candidates go
  ArrayView<FaceCandidate> candidates;
  AMHEX_HD void operator()(int64_t a) const {
    int64_t place = first[a];
    search.VisitCandidates(static_cast<int32_t>(a), [&](const FaceCandidate& candidate) {
      candidates[place] = candidate;
      ++place;
    });
  }
};

// Memory where bodies run, but for what the sums and scans need.
template <class E>
int64_t MatchBytes(const MatchTask& task) {
  // Every cube in a lattice is the larger of three pairs; gaps and clusters add some.
  constexpr int64_t kCandidatesPerCube = 4;
  constexpr int64_t kPerCube = sizeof(int32_t) + kCandidatesPerCube * sizeof(FaceCandidate);
  return UploadedArrays<E>::Bytes(task.search) + kPerCube * task.search.cubes.centre.size;
}

// False if it was stopped.
template <class E>
bool FindCandidates(E& executor, MatchTask& task) {
  const int64_t count = task.search.cubes.centre.size;
  UploadedArrays<E> arrays(executor);
  const CandidateSearch search = arrays.Upload(task.search);
  Buffer<E, int32_t> first = executor.template Alloc<int32_t>(count + 1);
  executor.ForEach("count face candidates", count + 1, CountCandidatesBody{search, first.View()});
  executor.ExclusiveScan(first, count + 1);
  const int64_t total = LastElement(executor, first);
  if (executor.Stopped()) return false;
  Buffer<E, FaceCandidate> found = executor.template Alloc<FaceCandidate>(total);
  executor.ForEach("list face candidates", count,
                   ListCandidatesBody{search, ReadOnly(first.View()), found.View()});
  std::vector<FaceCandidate> candidates(static_cast<size_t>(total));
  executor.CopyOut(found, total, candidates.data());
  if (executor.Stopped()) return false;
  task.candidates = std::move(candidates);
  return true;
}

}  // namespace amhex
