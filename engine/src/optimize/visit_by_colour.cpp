#include "optimize/visit_by_colour.h"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <atomic>
#include <utility>
#include <vector>

namespace amhex {
namespace {

using oneapi::tbb::blocked_range;
using oneapi::tbb::parallel_for;

// Visits between two looks at the stop flag: some milliseconds of work.
constexpr size_t kVisitsPerPoll = 64;
// Visits that are worth a task: some ten microseconds each.
constexpr size_t kVisitsPerTask = 2;
constexpr size_t kAsksPerTask = 2048;
// A cluster of more vertices is shared by several threads.
constexpr size_t kLargeCluster = 64;
// Of more vertices than one in so many hardly any are clusters by themselves.
constexpr size_t kVerticesPerClustered = 4;

// In the order of their colours, and of each colour in that of their numbers.
using Ordered = std::vector<int32_t>;

class Visits {
 public:
  Visits(const VertexNeighbourhoods& neighbourhoods, const RunContext& run,
         const std::function<void(int32_t)>& visit)
      : neighbourhoods_(neighbourhoods), run_(run), visit_(visit) {}

  // Those wanted, colour by colour.
  void ByColour(const std::vector<Ordered>& colours) {
    for (const Ordered& colour : colours) {
      if (has_stopped_.load(std::memory_order_relaxed)) return;
      if (colour.size() <= kVisitsPerTask) {
        InTurn(colour.data(), colour.data() + colour.size());
        continue;
      }
      parallel_for(blocked_range<size_t>(0, colour.size(), kVisitsPerTask),
                   [&](const blocked_range<size_t>& range) {
                     InTurn(colour.data() + range.begin(), colour.data() + range.end());
                   });
    }
  }

  // The same. Small clusters that share no cell with others are visited side by side.
  void ByCluster(const std::vector<Ordered>& colours) {
    std::vector<Ordered> small, large(colours.size());
    const std::vector<int32_t> cluster_of = FindClusters(colours, &small);
    for (size_t i = 0; i < colours.size(); ++i) {
      for (const int32_t v : colours[i]) {
        const int32_t cluster = cluster_of[v];
        (cluster >= 0 ? small[cluster] : large[i]).push_back(v);
      }
    }
    ByColour(large);
    parallel_for(size_t{0}, small.size(),
                 [&](size_t i) { InTurn(small[i].data(), small[i].data() + small[i].size()); });
  }

  absl::Status status() const { return has_stopped_.load() ? run_.CheckStop() : absl::OkStatus(); }

 private:
  void InTurn(const int32_t* begin, const int32_t* end) {
    for (const int32_t* v = begin; v < end; ++v) {
      if (static_cast<size_t>(v - begin) % kVisitsPerPoll == 0 && run_.ShouldStop()) {
        has_stopped_.store(true, std::memory_order_relaxed);
        return;
      }
      visit_(*v);
    }
  }

  // [vertex] the number of its cluster, which `small` gets an empty list for; -1 in large ones.
  std::vector<int32_t> FindClusters(const std::vector<Ordered>& colours,
                                    std::vector<Ordered>* small) const {
    std::vector<int32_t> parent(neighbourhoods_.cells.begin.size() - 1, -1);
    std::vector<int32_t> size(parent.size(), 1);
    const auto root_of = [&](int32_t v) {
      while (parent[v] != v) v = parent[v] = parent[parent[v]];
      return v;
    };
    std::vector<int32_t> vertex_of(neighbourhoods_.patterns.size(), -1);  // [cell]
    for (const Ordered& colour : colours) {
      for (const int32_t v : colour) {
        parent[v] = v;
        for (const int32_t c : neighbourhoods_.cells[v]) {
          if (vertex_of[c] < 0) vertex_of[c] = v;
          int32_t a = root_of(v), b = root_of(vertex_of[c]);
          if (a == b) continue;
          if (size[a] < size[b]) std::swap(a, b);
          parent[b] = a;
          size[a] += size[b];
        }
      }
    }
    std::vector<int32_t> number(parent.size(), -1);
    for (const Ordered& colour : colours) {
      for (const int32_t v : colour) {
        const int32_t root = root_of(v);
        if (static_cast<size_t>(size[root]) > kLargeCluster) continue;
        if (number[root] < 0) {
          number[root] = static_cast<int32_t>(small->size());
          small->emplace_back();
        }
        number[v] = number[root];
      }
    }
    return number;
  }

  const VertexNeighbourhoods& neighbourhoods_;
  const RunContext& run_;
  const std::function<void(int32_t)>& visit_;
  std::atomic<bool> has_stopped_{false};
};

}  // namespace

absl::Status VisitByColour(const VertexNeighbourhoods& neighbourhoods, const RunContext& run,
                           const std::function<bool(int32_t)>& wants,
                           const std::function<void(int32_t)>& visit) {
  const size_t vertex_count = neighbourhoods.cells.begin.size() - 1;
  std::vector<uint8_t> is_wanted(vertex_count, 0);
  parallel_for(blocked_range<size_t>(0, vertex_count, kAsksPerTask),
               [&](const blocked_range<size_t>& range) {
                 for (size_t v = range.begin(); v < range.end(); ++v) {
                   is_wanted[v] = wants(static_cast<int32_t>(v)) ? 1 : 0;
                 }
               });
  std::vector<Ordered> wanted;
  size_t count = 0;
  for (const Ordered& colour : neighbourhoods.colours) {
    Ordered& of_colour = wanted.emplace_back();
    for (const int32_t v : colour) {
      if (is_wanted[v] != 0) of_colour.push_back(v);
    }
    count += of_colour.size();
  }
  Visits visits(neighbourhoods, run, visit);
  if (count * kVerticesPerClustered > vertex_count) {
    visits.ByColour(wanted);
  } else {
    visits.ByCluster(wanted);
  }
  return visits.status();
}

}  // namespace amhex
