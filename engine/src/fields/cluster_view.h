// What clusters of positions are (site_clusters.h); usable where bodies run.
#pragma once

#include <cmath>
#include <cstdint>

#include "base/array_view.h"
#include "base/platform.h"
#include "fields/frame_math.h"
#include "fields/grid_keys.h"
#include "fields/point_rows.h"
#include "input/hull_view.h"

namespace amhex::fields {

// A cluster needs this share of the mass that all nodes of a cell give together.
inline constexpr double kMinMassShare = 0.12;
inline constexpr double kMinMass = kMinMassShare * kNodesPerEdge * kNodesPerEdge * kNodesPerEdge;
inline constexpr double kClusterBinSize = 0.5;  // edge lengths

// `d` in cells of the given frame and size.
AMHEX_HD inline Vec3d InCells(const AxisFrame& frame, const Vec3d& size, const Vec3d& d) {
  return {Dot(frame.axis[0], d) / size.x, Dot(frame.axis[1], d) / size.y,
          Dot(frame.axis[2], d) / size.z};
}

// The lattice that each node of the background grid sees. Views do not own.
struct LatticeView {
  ArrayView<const Quaternion> frames;
  ArrayView<const Vec3d> sizes;      // of cells along the frames' axes
  ArrayView<const Vec3d> positions;  // the lattice point that is nearest to the node

  template <class Visit>
  void VisitArrays(const Visit& visit) {
    visit(frames), visit(sizes), visit(positions);
  }
};

struct ClusterView {
  LatticeView lattice;
  PointRowsView index;  // of the positions

  // Kernel mass around a node's position, relative to what a cell of its size would hold.
  AMHEX_HD float Mass(int64_t node) const {
    const Vec3d& size = lattice.sizes[node];
    double mass = 0;
    VisitKernel(node, [&mass](int32_t, double r) { mass += 1 - r / kKernelRadius; });
    return static_cast<float>(mass / (size.x * size.y * size.z));
  }

  AMHEX_HD Vec3d Centre(int64_t node) const {
    Vec3d sum;
    int count = 0;
    VisitKernel(node, [&](int32_t j, double) {
      sum += lattice.positions[j];
      ++count;
    });
    return sum / count;
  }

  // All nodes whose position a cell at `centre` claims.
  template <class Visit>
  AMHEX_HD void VisitClaimed(int64_t node, const Vec3d& centre, const Visit& visit) const {
    // No two sites within this distance, in cells (maximum norm).
    constexpr double kSuppression = 0.6;
    const AxisFrame frame = ToFrame(lattice.frames[node]);
    const Vec3d& size = lattice.sizes[node];
    const double reach = kSuppression * Largest(size) * std::sqrt(3.0);
    index.VisitNear(centre, reach, [&](int32_t j) {
      const Vec3d d = InCells(frame, size, lattice.positions[j] - centre);
      const double distance = Larger(Larger(std::abs(d.x), std::abs(d.y)), std::abs(d.z));
      if (distance < kSuppression) visit(j);
    });
  }

  // Whether a site at `centre` stands inside and not too near to the hull; `place` is the node's
  // own, which is inside.
  AMHEX_HD bool IsWellInside(const HullView& hull, int64_t node, const Vec3d& place,
                             const Vec3d& centre) const {
    // Sites nearer to the hull than this share of their smallest extent are the layer outside.
    constexpr double kMinDepth = 0.2;
    // Where no hull comes between, both are on the same side, which is far cheaper to know.
    constexpr double kSlack = 1.01;
    const Vec3d& size = lattice.sizes[node];
    const double depth = kMinDepth * Smaller(Smaller(size.x, size.y), size.z);
    const double reach = Larger(depth, kSlack * Norm(centre - place));
    if (!hull.IsWithin(centre, reach)) return true;
    return !hull.IsWithin(centre, depth) && hull.IsInside(centre);
  }

 private:
  // Radius of the kernel within which nodes agree, in cells.
  static constexpr double kKernelRadius = 0.3;

  AMHEX_HD static double Largest(const Vec3d& v) { return Larger(Larger(v.x, v.y), v.z); }

  // visit(j, distance in cells) for all positions in the kernel, the node's own among them.
  template <class Visit>
  AMHEX_HD void VisitKernel(int64_t node, const Visit& visit) const {
    const AxisFrame frame = ToFrame(lattice.frames[node]);
    const Vec3d& size = lattice.sizes[node];
    const Vec3d& centre = lattice.positions[node];
    index.VisitNear(centre, kKernelRadius * Largest(size), [&](int32_t j) {
      const double r = Norm(InCells(frame, size, lattice.positions[j] - centre));
      if (r < kKernelRadius) visit(j, r);
    });
  }
};

}  // namespace amhex::fields
