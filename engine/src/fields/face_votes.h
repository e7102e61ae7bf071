// How background edges vote for pairs of cube faces (face_links.h); usable where bodies run.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

#include "base/array_view.h"
#include "fields/cluster_view.h"
#include "fields/find_neighbours.h"
#include "fields/grid_keys.h"
#include "fields/match_code.h"
#include "fields/nearest_axis.h"
#include "fields/octahedral_group.h"
#include "fields/point_rows.h"

namespace amhex::fields {

// The lattice of neighbour j continues that of i as x_i = rotation x_j + shift (in cells).
struct LatticeTransition {
  AxisRotation rotation;
  std::array<int32_t, 3> shift{};
};

// Two faces, numbered 6 * site + direction (sites.h), and how many edges want them glued.
struct VotedFaces {
  uint32_t face_a = 0;  // of the lower site
  uint32_t face_b = 0;
  int32_t votes = 0;
};

// Lattices side by side.
struct LatticeSteps {
  LatticeView lattice;
  CellCentres nodes;
  ArrayView<const AxisRotation> rotations;  // kAxisRotations

  AMHEX_HD LatticeTransition Between(int64_t i, int64_t j) const {
    LatticeTransition step;
    step.rotation = rotations[MatchCode(lattice.frames[i], lattice.frames[j])];
    const AxisFrame frame_i = ToFrame(lattice.frames[i]), frame_j = ToFrame(lattice.frames[j]);
    const Vec3d &at_i = lattice.positions[i], &at_j = lattice.positions[j];
    const Vec3d &size_i = lattice.sizes[i], &size_j = lattice.sizes[j];
    const Vec3d middle = (nodes[i] + nodes[j]) * 0.5;
    // One lattice point near the middle of the edge, named in both lattices.
    const auto in_i = Rounded(InCells(frame_i, size_i, middle - at_i));
    Vec3d common = at_i;
    for (int a = 0; a < 3; ++a) common += frame_i.axis[a] * (in_i[a] * size_i[a]);
    const auto in_j = Rounded(InCells(frame_j, size_j, common - at_j));
    for (int a = 0; a < 3; ++a) {
      step.shift[a] = in_i[a] - step.rotation.sign[a] * in_j[step.rotation.source[a]];
    }
    return step;
  }

 private:
  AMHEX_HD static std::array<int32_t, 3> Rounded(const Vec3d& v) {
    return {static_cast<int32_t>(std::lround(v.x)), static_cast<int32_t>(std::lround(v.y)),
            static_cast<int32_t>(std::lround(v.z))};
  }
};

// One element per node: the nearest site within kClaimRadius, or -1.
struct NearestSiteBody {
  LatticeView lattice;
  PointRowsView index;  // of the sites' positions
  ArrayView<const Vec3d> site_position;
  ArrayView<int32_t> nearest;

  AMHEX_HD void operator()(int64_t i) const {
    constexpr double kClaimRadius = 0.45;  // in cells
    const AxisFrame frame = ToFrame(lattice.frames[i]);
    const Vec3d& size = lattice.sizes[i];
    double best = kClaimRadius;
    int32_t site = -1;
    const double reach = kClaimRadius * Larger(Larger(size.x, size.y), size.z);
    index.VisitNear(lattice.positions[i], reach, [&](int32_t s) {
      const double r = Norm(InCells(frame, size, site_position[s] - lattice.positions[i]));
      if (r < best || (r == best && s < site)) best = r, site = s;
    });
    nearest[i] = site;
  }
};

// One element per node: what its edges ahead vote for, one vote each.
struct VoteSearch {
  using Item = VotedFaces;
  LatticeSteps steps;
  ArrayView<const int32_t> neighbours;  // [node][18]; empty: they are looked for among the cells
  ArrayView<const AxisFrame> site_frame;
  ArrayView<const int32_t> site_of_node;

  template <class Visit>
  AMHEX_HD void VisitItems(int64_t i, const Visit& visit) const {
    if (site_of_node[i] < 0) return;
    for (int k = 0; k < kForwardCount; ++k) {
      const int32_t j = neighbours.empty() ? NeighbourOfNode(steps.nodes.keys, i, k)
                                           : neighbours[i * kNeighbourCount + k];
      if (j >= 0) VisitVote(i, j, visit);
    }
  }

 private:
  template <class Visit>
  AMHEX_HD void VisitVote(int64_t i, int64_t j, const Visit& visit) const {
    const int32_t a = site_of_node[i], b = site_of_node[j];
    if (b < 0 || a == b) return;
    const LatticeTransition step = steps.Between(i, j);
    int axis = -1, length = 0;
    for (int k = 0; k < 3; ++k) {
      if (step.shift[k] != 0) axis = k, length += std::abs(step.shift[k]);
    }
    if (length != 1) return;
    const double sign = step.shift[axis];
    const Vec3d from_a = ToFrame(steps.lattice.frames[i]).axis[axis] * sign;
    // (R x)[axis] = sign * x[source]: the same axis as j names it.
    const Vec3d from_b = ToFrame(steps.lattice.frames[j]).axis[step.rotation.source[axis]] *
                         (-sign * step.rotation.sign[axis]);
    const uint32_t face_a = FaceOf(a, from_a), face_b = FaceOf(b, from_b);
    visit(a < b ? VotedFaces{face_a, face_b, 1} : VotedFaces{face_b, face_a, 1});
  }
  // The site's face whose direction is nearest to `d`.
  AMHEX_HD uint32_t FaceOf(int32_t site, const Vec3d& d) const {
    const NearestAxis nearest = FindNearestAxis(site_frame[site], d);
    const int direction = 2 * nearest.axis + (nearest.sign > 0 ? 1 : 0);
    return static_cast<uint32_t>(kDirectionCount) * static_cast<uint32_t>(site) +
           static_cast<uint32_t>(direction);
  }
};

// One element per vote, of votes that are sorted by their faces: those with at least kMinVotes.
struct CountVotesSearch {
  using Item = VotedFaces;
  ArrayView<const VotedFaces> votes;

  template <class Visit>
  AMHEX_HD void VisitItems(int64_t first, const Visit& visit) const {
    constexpr int32_t kMinVotes = 2;
    if (first > 0 && AreEqual(first - 1, first)) return;
    int64_t last = first + 1;
    while (last < votes.size && AreEqual(first, last)) ++last;
    const auto count = static_cast<int32_t>(last - first);
    if (count >= kMinVotes) visit(VotedFaces{votes[first].face_a, votes[first].face_b, count});
  }

 private:
  AMHEX_HD bool AreEqual(int64_t i, int64_t j) const {
    return votes[i].face_a == votes[j].face_a && votes[i].face_b == votes[j].face_b;
  }
};

}  // namespace amhex::fields
