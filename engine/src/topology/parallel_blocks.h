// Parallel loops over blocks of indices whose results are joined in index order.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "amhex/run_context.h"

namespace amhex {

// Calls body(begin, end) on consecutive blocks of [0, count), from several threads, and skips
// blocks not yet begun once the run should stop. Returns the run's status.
template <class Body>
absl::Status ForEachBlock(int64_t count, int64_t block_size, const RunContext& context,
                          const Body& body) {
  const int64_t block_count = (count + block_size - 1) / block_size;
  tbb::parallel_for(int64_t{0}, block_count, [&](int64_t block) {
    if (context.ShouldStop()) return;
    const int64_t begin = block * block_size;
    body(begin, std::min(count, begin + block_size));
  });
  return context.CheckStop();
}

// Calls body(begin, end, results) likewise; every block fills its own list, and the lists are
// joined in block order, so the outcome does not depend on the number of threads.
template <class Result, class Body>
absl::Status CollectFromBlocks(int64_t count, int64_t block_size, const RunContext& context,
                               std::vector<Result>* joined, const Body& body) {
  const int64_t block_count = (count + block_size - 1) / block_size;
  std::vector<std::vector<Result>> lists(static_cast<size_t>(block_count));
  absl::Status status = ForEachBlock(count, block_size, context, [&](int64_t begin, int64_t end) {
    body(begin, end, &lists[static_cast<size_t>(begin / block_size)]);
  });
  if (!status.ok()) return status;
  size_t total = joined->size();
  for (const auto& list : lists) total += list.size();
  joined->reserve(total);
  for (auto& list : lists) {
    joined->insert(joined->end(), list.begin(), list.end());
    std::vector<Result>().swap(list);
  }
  return absl::OkStatus();
}

// The items of a search (exec/counted_list.h) over elements 0 .. count-1 likewise.
template <class Search>
absl::Status CollectItems(int64_t count, int64_t block_size, const RunContext& context,
                          const Search& search, std::vector<typename Search::Item>* items) {
  using Item = typename Search::Item;
  return CollectFromBlocks(count, block_size, context, items,
                           [&search](int64_t begin, int64_t end, std::vector<Item>* found) {
                             for (int64_t element = begin; element < end; ++element) {
                               search.VisitItems(
                                   element, [found](const Item& item) { found->push_back(item); });
                             }
                           });
}

}  // namespace amhex
