#include "fields/face_links.h"

#include <oneapi/tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "fields/point_index.h"
#include "fields/site_clusters.h"

namespace amhex::fields {
namespace {

// A node belongs to the nearest site within this distance, in cells.
constexpr double kClaimRadius = 0.45;
constexpr int kMinVotes = 2;
constexpr double kBinSize = 1.0;  // edge lengths

std::vector<int32_t> NearestSites(const LatticeForm& form, const std::vector<Vec3d>& positions,
                                  const Sites& sites, const RunContext& run) {
  const PointIndex index(sites.position, kBinSize);
  std::vector<int32_t> nearest(positions.size(), -1);
  ForEach(run, static_cast<int64_t>(positions.size()), [&](int64_t i) {
    const AxisFrame frame = ToFrame(form.frames[i]);
    const Vec3d& size = form.sizes[i];
    double best = kClaimRadius;
    const double reach = kClaimRadius * std::max({size.x, size.y, size.z});
    index.VisitNear(positions[i], reach, [&](int32_t s) {
      const double r = Norm(InCells(frame, size, sites.position[s] - positions[i]));
      if (r < best || (r == best && s < nearest[i])) best = r, nearest[i] = s;
    });
  });
  return nearest;
}

std::array<int32_t, 3> Rounded(const Vec3d& v) {
  return {static_cast<int32_t>(std::lround(v.x)), static_cast<int32_t>(std::lround(v.y)),
          static_cast<int32_t>(std::lround(v.z))};
}

// Number 0..5 of the site's direction (sites.h) nearest to `d`.
uint8_t DirectionOf(const AxisFrame& frame, const Vec3d& d) {
  const NearestAxis nearest = FindNearestAxis(frame, d);
  return static_cast<uint8_t>(2 * nearest.axis + (nearest.sign > 0 ? 1 : 0));
}

// The face pair that the edge from node i to node j votes for; votes = 0 if none.
FaceLink VoteOf(const BackgroundGrid& grid, const LatticeForm& form,
                const std::vector<Vec3d>& positions, const Sites& sites,
                const std::vector<int32_t>& site_of_node, int64_t i, int64_t j) {
  const int32_t a = site_of_node[i], b = site_of_node[j];
  if (a < 0 || b < 0 || a == b) return {};
  const LatticeTransition step = TransitionBetween(grid, form, positions, i, j);
  int axis = -1, length = 0;
  for (int k = 0; k < 3; ++k) {
    if (step.shift[k] != 0) axis = k, length += std::abs(step.shift[k]);
  }
  if (length != 1) return {};
  const double sign = step.shift[axis];
  const Vec3d from_a = ToFrame(form.frames[i]).axis[axis] * sign;
  // (R x)[axis] = sign * x[source]: the same axis as j names it.
  const Vec3d from_b =
      ToFrame(form.frames[j]).axis[step.rotation.source[axis]] * (-sign * step.rotation.sign[axis]);
  const uint8_t direction_a = DirectionOf(sites.frame[a], from_a);
  const uint8_t direction_b = DirectionOf(sites.frame[b], from_b);
  return a < b ? FaceLink{a, b, direction_a, direction_b, 1}
               : FaceLink{b, a, direction_b, direction_a, 1};
}

auto OrderOf(const FaceLink& l) {
  return std::tuple(l.site_a, l.direction_a, l.site_b, l.direction_b);
}

std::vector<FaceLink> CountVotes(std::vector<FaceLink> votes) {
  oneapi::tbb::parallel_sort(votes.begin(), votes.end(), [](const FaceLink& a, const FaceLink& b) {
    return OrderOf(a) < OrderOf(b);
  });
  std::vector<FaceLink> links;
  for (size_t first = 0; first < votes.size();) {
    size_t last = first;
    while (last < votes.size() && OrderOf(votes[last]) == OrderOf(votes[first])) ++last;
    if (last - first >= kMinVotes) {
      links.push_back(votes[first]);
      links.back().votes = static_cast<int32_t>(last - first);
    }
    first = last;
  }
  return links;
}

}  // namespace

LatticeTransition TransitionBetween(const BackgroundGrid& grid, const LatticeForm& form,
                                    const std::vector<Vec3d>& positions, int64_t i, int64_t j) {
  LatticeTransition step;
  step.rotation = kAxisRotations[MatchCode(form.frames[i], form.frames[j])];
  const AxisFrame frame_i = ToFrame(form.frames[i]), frame_j = ToFrame(form.frames[j]);
  const Vec3d middle = (grid.Position(i) + grid.Position(j)) * 0.5;
  // One lattice point near the middle of the edge, named in both lattices.
  const auto in_i = Rounded(InCells(frame_i, form.sizes[i], middle - positions[i]));
  Vec3d common = positions[i];
  for (int a = 0; a < 3; ++a) common += frame_i.axis[a] * (in_i[a] * form.sizes[i][a]);
  const auto in_j = Rounded(InCells(frame_j, form.sizes[j], common - positions[j]));
  for (int a = 0; a < 3; ++a) {
    step.shift[a] = in_i[a] - step.rotation.sign[a] * in_j[step.rotation.source[a]];
  }
  return step;
}

std::vector<FaceLink> VoteFaceLinks(const BackgroundGrid& grid, const LatticeForm& form,
                                    const std::vector<Vec3d>& positions, const Sites& sites,
                                    const RunContext& run) {
  const std::vector<int32_t> site_of_node = NearestSites(form, positions, sites, run);
  // In slices, so that memory stays far below one vote per edge.
  constexpr int64_t kSlice = int64_t{1} << 20;
  std::vector<std::array<FaceLink, kForwardCount>> ballot;
  std::vector<FaceLink> votes;
  for (int64_t begin = 0; begin < grid.count(); begin += kSlice) {
    const int64_t size = std::min(kSlice, grid.count() - begin);
    ballot.assign(size, {});
    ForEach(run, size, [&](int64_t c) {
      for (int k = 0; k < kForwardCount; ++k) {
        const int32_t j = grid.fine().neighbours[begin + c][k];
        if (j >= 0) {
          ballot[c][k] = VoteOf(grid, form, positions, sites, site_of_node, begin + c, j);
        }
      }
    });
    if (run.ShouldStop()) return {};
    for (const auto& node : ballot) {
      for (const FaceLink& vote : node) {
        if (vote.votes > 0) votes.push_back(vote);
      }
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
