// The law of scoring only what has a chance: the same as scoring everything.
#include "closure/least_scores.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace amhex {
namespace {

TEST(LeastScores, AreThoseOfAllCandidatesScored) {
  std::minstd_rand random(7);
  size_t scored = 0, candidates = 0;
  for (int round = 0; round < 2000; ++round) {
    const size_t count = random() % 40, width = random() % 6, batch = 1 + random() % 17;
    std::vector<double> bounds, scores;
    for (size_t i = 0; i < count; ++i) {
      bounds.push_back(static_cast<double>(random() % 20));  // many equal ones
      scores.push_back(bounds.back() + static_cast<double>(random() % 12));
    }
    std::vector<size_t> expected(count);
    for (size_t i = 0; i < count; ++i) expected[i] = i;
    std::stable_sort(expected.begin(), expected.end(),
                     [&](size_t a, size_t b) { return scores[a] < scores[b]; });
    expected.resize(std::min(width, count));
    const auto score = [&](const std::vector<size_t>& some, double most,
                           std::vector<double>* found) {
      for (size_t i = 0; i < some.size(); ++i) {
        // Of what is beyond the most that counts, anything beyond it will do.
        (*found)[i] = scores[some[i]] > most ? most + 1 : scores[some[i]];
      }
      scored += some.size();
    };
    EXPECT_EQ(LeastScores(bounds, width, batch, score), expected) << round;
    candidates += count;
  }
  EXPECT_LT(scored, candidates * 3 / 4);
}

}  // namespace
}  // namespace amhex
