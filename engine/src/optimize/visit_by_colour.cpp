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

// Those that are wanted, in the order of their numbers.
Ordered Wanted(const std::vector<int32_t>& among, const std::function<bool(int32_t)>& wants) {
  std::vector<uint8_t> is_wanted(among.size());
  parallel_for(blocked_range<size_t>(0, among.size(), kAsksPerTask),
               [&](const blocked_range<size_t>& range) {
                 for (size_t i = range.begin(); i < range.end(); ++i) {
                   is_wanted[i] = wants(among[i]) ? 1 : 0;
                 }
               });
  Ordered wanted;
  for (size_t i = 0; i < among.size(); ++i) {
    if (is_wanted[i] != 0) wanted.push_back(among[i]);
  }
  return wanted;
}

// The vertices by their clusters: those that share a cell are in one.
class Clusters {
 public:
  Clusters(const VertexNeighbourhoods& neighbourhoods, const Ordered& vertices,
           VisitScratch& scratch)
      : parent_(vertices.size()), size_(vertices.size(), 1) {
    std::vector<int32_t>& visitor_of_cell = scratch.visitor_of_cell;
    visitor_of_cell.resize(neighbourhoods.patterns.size(), -1);
    for (size_t i = 0; i < vertices.size(); ++i) {
      parent_[i] = static_cast<int32_t>(i);
      for (const int32_t c : neighbourhoods.cells[vertices[i]]) {
        if (visitor_of_cell[c] < 0) visitor_of_cell[c] = static_cast<int32_t>(i);
        Join(static_cast<int32_t>(i), visitor_of_cell[c]);
      }
    }
    for (const int32_t v : vertices) {
      for (const int32_t c : neighbourhoods.cells[v]) visitor_of_cell[c] = -1;
    }
  }

  // Of the i-th vertex.
  int32_t RootOf(int32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  bool IsLarge(int32_t root) const { return static_cast<size_t>(size_[root]) > kLargeCluster; }

 private:
  void Join(int32_t i, int32_t k) {
    int32_t a = RootOf(i), b = RootOf(k);
    if (a == b) return;
    if (size_[a] < size_[b]) std::swap(a, b);
    parent_[b] = a;
    size_[a] += size_[b];
  }

  std::vector<int32_t> parent_, size_;
};

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
  void ByCluster(const std::vector<Ordered>& colours, VisitScratch& scratch) {
    Ordered vertices;
    for (const Ordered& colour : colours) {
      vertices.insert(vertices.end(), colour.begin(), colour.end());
    }
    Clusters clusters(neighbourhoods_, vertices, scratch);
    std::vector<Ordered> small, large(colours.size());
    std::vector<int32_t> number(vertices.size(), -1);  // [root] of a small cluster
    int32_t place = 0;
    for (size_t k = 0; k < colours.size(); ++k) {
      for (const int32_t v : colours[k]) {
        const int32_t root = clusters.RootOf(place++);
        if (clusters.IsLarge(root)) {
          large[k].push_back(v);
          continue;
        }
        if (number[root] < 0) {
          number[root] = static_cast<int32_t>(small.size());
          small.emplace_back();
        }
        small[number[root]].push_back(v);
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

  const VertexNeighbourhoods& neighbourhoods_;
  const RunContext& run_;
  const std::function<void(int32_t)>& visit_;
  std::atomic<bool> has_stopped_{false};
};

}  // namespace

absl::Status VisitByColour(const VertexNeighbourhoods& neighbourhoods,
                           const std::vector<int32_t>& among, const RunContext& run,
                           const std::function<bool(int32_t)>& wants,
                           const std::function<void(int32_t)>& visit, VisitScratch& scratch) {
  const Ordered wanted = Wanted(among, wants);
  std::vector<Ordered> by_colour(neighbourhoods.colours.size());
  for (const int32_t v : wanted) {
    const int32_t colour = neighbourhoods.colour_of[v];
    if (colour >= 0) by_colour[colour].push_back(v);
  }
  Visits visits(neighbourhoods, run, visit);
  if (wanted.size() * kVerticesPerClustered > neighbourhoods.colour_of.size()) {
    visits.ByColour(by_colour);
  } else {
    visits.ByCluster(by_colour, scratch);
  }
  return visits.status();
}

}  // namespace amhex
