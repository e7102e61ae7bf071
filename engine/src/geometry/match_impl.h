// The search of match_task.h with arrays where bodies run: candidates are counted, then listed.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "exec/counted_list.h"
#include "exec/executor.h"
#include "exec/uploaded_arrays.h"
#include "geometry/match_task.h"

namespace amhex {

// Memory where bodies run, but for what the sums and scans need.
template <class E>
int64_t MatchBytes(const MatchTask& task) {
  // Every cube in a lattice is the larger of three pairs; gaps and clusters add some.
  constexpr int64_t kCandidatesPerCube = 4;
  const int64_t cube_count = task.search.cubes.centre.size;
  return UploadedArrays<E>::Bytes(task.search) +
         ListItemsBytes<CandidateSearch>(cube_count, kCandidatesPerCube * cube_count);
}

// False if it was stopped.
template <class E>
bool FindCandidates(E& executor, MatchTask& task) {
  const int64_t count = task.search.cubes.centre.size;
  UploadedArrays<E> arrays(executor);
  const CandidateSearch search = arrays.Upload(task.search);
  const Buffer<E, FaceCandidate> found = ListItems(executor, "find face candidates", count, search);
  if (executor.Stopped()) return false;
  std::vector<FaceCandidate> candidates(static_cast<size_t>(found.size()));
  executor.CopyOut(found, found.size(), candidates.data());
  if (executor.Stopped()) return false;
  task.candidates = std::move(candidates);
  return true;
}

}  // namespace amhex
