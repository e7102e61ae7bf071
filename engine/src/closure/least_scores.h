// The best of many candidates whose scores cost much and have lower bounds that cost little: only
// those are scored whose bound leaves a chance.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <numeric>
#include <utility>
#include <vector>

namespace amhex {

// Indices of the `width` least scores, in their order, of equal ones the earlier first.
// score_some(indices, most, scores): the scores of `indices`; of those above `most`, any that is
// above it. No score is below its bound. `batch` of them are asked for at a time.
template <class ScoreSome>
std::vector<size_t> LeastScores(const std::vector<double>& bounds, size_t width, size_t batch,
                                const ScoreSome& score_some) {
  std::vector<size_t> order(bounds.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return bounds[a] < bounds[b]; });
  using Scored = std::pair<double, size_t>;
  std::vector<Scored> least;
  double most = std::numeric_limits<double>::max();
  for (size_t begin = 0; begin < order.size() && bounds[order[begin]] <= most; begin += batch) {
    const size_t end = std::min(begin + batch, order.size());
    const std::vector<size_t> next(order.begin() + static_cast<std::ptrdiff_t>(begin),
                                   order.begin() + static_cast<std::ptrdiff_t>(end));
    std::vector<double> scores(next.size());
    score_some(next, most, &scores);
    for (size_t i = 0; i < next.size(); ++i) least.emplace_back(scores[i], next[i]);
    std::sort(least.begin(), least.end());
    if (least.size() < width) continue;
    least.resize(width);
    if (width > 0) most = least.back().first;
  }
  std::vector<size_t> indices;
  indices.reserve(least.size());
  for (const Scored& scored : least) indices.push_back(scored.second);
  return indices;
}

}  // namespace amhex
