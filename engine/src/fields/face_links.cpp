#include "fields/face_links.h"

#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cstdint>

#include "base/array_view_of.h"
#include "fields/point_index.h"

namespace amhex::fields {
namespace {

constexpr double kBinSize = 1.0;  // edge lengths

LatticeSteps StepsOf(const BackgroundGrid& grid, const LatticeForm& form,
                     const std::vector<Vec3d>& positions) {
  return {{ArrayViewOf(form.frames), ArrayViewOf(form.sizes), ArrayViewOf(positions)},
          grid.Cells(),
          {kAxisRotations.data(), kRotationCount}};
}

std::vector<int32_t> NearestSites(const LatticeView& lattice, const Sites& sites,
                                  const RunContext& run) {
  const PointIndex index(sites.position, kBinSize);
  std::vector<int32_t> nearest(lattice.positions.size);
  ForEach(run, lattice.positions.size,
          NearestSiteBody{lattice,
                          index.view(),
                          ArrayViewOf(sites.position),
                          {nearest.data(), lattice.positions.size}});
  return nearest;
}

// What the edges ahead of one node vote for.
struct Ballot {
  std::array<VotedFaces, kForwardCount> votes;
  int count = 0;
};

std::vector<VotedFaces> CountVotes(std::vector<VotedFaces> votes) {
  oneapi::tbb::parallel_sort(
      votes.begin(), votes.end(), [](const VotedFaces& a, const VotedFaces& b) {
        return a.face_a != b.face_a ? a.face_a < b.face_a : a.face_b < b.face_b;
      });
  std::vector<VotedFaces> counted;
  const CountVotesSearch search{ArrayViewOf(votes)};
  for (int64_t i = 0; i < search.votes.size; ++i) {
    search.VisitItems(i, [&counted](const VotedFaces& faces) { counted.push_back(faces); });
  }
  return counted;
}

}  // namespace

LatticeTransition TransitionBetween(const BackgroundGrid& grid, const LatticeForm& form,
                                    const std::vector<Vec3d>& positions, int64_t i, int64_t j) {
  return StepsOf(grid, form, positions).Between(i, j);
}

std::vector<FaceLink> LinksOf(const std::vector<VotedFaces>& voted) {
  std::vector<FaceLink> links;
  links.reserve(voted.size());
  for (const VotedFaces& faces : voted) {
    links.push_back({static_cast<int32_t>(faces.face_a / kDirectionCount),
                     static_cast<int32_t>(faces.face_b / kDirectionCount),
                     static_cast<uint8_t>(faces.face_a % kDirectionCount),
                     static_cast<uint8_t>(faces.face_b % kDirectionCount), faces.votes});
  }
  return links;
}

std::vector<VotedFaces> VoteFaces(const BackgroundGrid& grid, const LatticeForm& form,
                                  const std::vector<Vec3d>& positions, const Sites& sites,
                                  const RunContext& run) {
  const LatticeSteps steps = StepsOf(grid, form, positions);
  const std::vector<int32_t> site_of_node = NearestSites(steps.lattice, sites, run);
  const VoteSearch search{steps,
                          {grid.fine().neighbours.data()->data(), kNeighbourCount * grid.count()},
                          ArrayViewOf(sites.frame),
                          ArrayViewOf(site_of_node)};
  // In slices, so that memory stays far below one vote per edge.
  constexpr int64_t kSlice = int64_t{1} << 20;
  std::vector<Ballot> ballots;
  std::vector<VotedFaces> votes;
  for (int64_t begin = 0; begin < grid.count(); begin += kSlice) {
    const int64_t size = std::min(kSlice, grid.count() - begin);
    ballots.assign(size, {});
    ForEach(run, size, [&](int64_t c) {
      search.VisitItems(begin + c, [&ballot = ballots[c]](const VotedFaces& vote) {
        ballot.votes[ballot.count++] = vote;
      });
    });
    if (run.ShouldStop()) return {};
    for (const Ballot& node : ballots) {
      votes.insert(votes.end(), node.votes.begin(), node.votes.begin() + node.count);
    }
  }
  return CountVotes(std::move(votes));
}

FieldDefects CountDefects(const BackgroundGrid& grid, const LatticeForm& form,
                          const std::vector<Vec3d>& positions, const RunContext& run) {
  const GridLevel& level = grid.fine();
  std::vector<std::array<uint8_t, 3>> kind(grid.count());  // 0 none, 1 closed, 2, 3 defects
  ForEach(run, grid.count(), [&](int64_t i) {
    for (int d = 0; d < 3; ++d) {
      const int e = (d + 1) % 3;
      const int32_t a = level.neighbours[i][d], b = level.neighbours[i][e];
      if (a < 0 || b < 0 || level.neighbours[a][e] < 0) continue;
      const std::array<int64_t, 5> loop{i, a, level.neighbours[a][e], b, i};
      AxisRotation rotation;
      std::array<int32_t, 3> shift{};
      for (int s = 0; s < 4; ++s) {
        const LatticeTransition step =
            TransitionBetween(grid, form, positions, loop[s], loop[s + 1]);
        for (int k = 0; k < 3; ++k) {
          shift[k] += rotation.sign[k] * step.shift[rotation.source[k]];
        }
        rotation = Compose(rotation, step.rotation);
      }
      kind[i][d] = rotation != AxisRotation{}                 ? 2
                   : shift != std::array<int32_t, 3>{0, 0, 0} ? 3
                                                              : 1;
    }
  });
  FieldDefects defects;
  for (const auto& node : kind) {
    for (const uint8_t k : node) {
      defects.square_count += k != 0 ? 1 : 0;
      defects.singular += k == 2 ? 1 : 0;
      defects.dislocated += k == 3 ? 1 : 0;
    }
  }
  return defects;
}

}  // namespace amhex::fields
