// The Voronoi diagram of section 4.1: every lattice point goes to the nearest site of its own side
// of the hull under the site's Chebyshev metric; ties go to the smaller id.
//
// One element is one tile of the lattice for one side. Sites are culled twice, exactly: for the
// tile and for each of its blocks a site is dropped when even its lower bound over the cube lies
// above another's upper bound. Points are never stored: each block's owners go straight into the
// cells' integer sums.
#pragma once

#include <cstdint>

#include "graph/bin_grid.h"
#include "relax/barrier_view.h"
#include "relax/label_candidates.h"

namespace amhex {

inline constexpr int32_t kNoOwner = -1;
inline constexpr float kSquareRootOfThree = 1.7320508f;

struct LabelTileBody {
  BarrierView barrier;
  ArrayView<const LabelItem> items;
  BinGrid bins;                        // of the sites
  ArrayView<const SiteMetric> metric;  // [site_count]
  float largest_size = 1.0f;           // of any site along any axis, edge lengths
  bool wants_second_moments = false;
  ArrayView<CellMoments> moments;  // [site_count], zero before
  ArrayView<int32_t> labels;       // [item_count][256] owners, or empty when not wanted

  // The cube of a tile's points and what bounds the search for their owners.
  struct Search {
    LatticePoint base;
    Vec3f centre;
    float half_width = 0;
    float limit = 0;  // no owner is farther than this, in cell sizes
    int32_t is_inside = 0;
    // Every owner lies within this distance of the cube.
    float reach = 0;
  };

  AMHEX_HD void operator()(int64_t index) const {
    const LabelItem item = items[index];
    Search search = Begin(item);
    FindReach(search);
    LabelCandidates candidates;
    const bool fits = Collect(search, candidates);
    if (fits) {
      candidates.SortById();
      candidates.Load(metric.data);
    }
    for (int block = 0; block < kTileBlocks; ++block) {
      const uint32_t points = PointsOf(item, block);
      const LatticePoint offset = BlockInTile(block);
      const LatticePoint base = {search.base.x + offset.x, search.base.y + offset.y,
                                 search.base.z + offset.z};
      int32_t* block_labels =
          labels.empty() ? nullptr : &labels[index * kTilePoints + block * kBlockPoints];
      if (block_labels != nullptr) {
        for (int p = 0; p < kBlockPoints; ++p) block_labels[p] = kNoOwner;
      }
      if (points == 0) continue;
      if (fits) {
        LabelBlock(search, candidates, base, points, block_labels);
      } else {
        LabelBlockByScan(search, base, points, block_labels);
      }
    }
  }

  AMHEX_HD Search Begin(const LabelItem& item) const {
    Search search;
    const double spacing = barrier.lattice.spacing;
    search.base = barrier.lattice.TileOrigin(item.tile);
    // Points span coordinates 0..7 of the tile.
    constexpr double kMiddle = 0.5 * (kTileWidth - 1);
    search.centre =
        ToFloat(Vec3d{(search.base.x + kMiddle) * spacing, (search.base.y + kMiddle) * spacing,
                      (search.base.z + kMiddle) * spacing});
    search.half_width = static_cast<float>(kMiddle * spacing);
    search.limit = item.is_inside != 0 ? kUnboundedReach : kOutsideReach;
    search.is_inside = item.is_inside;
    return search;
  }

  AMHEX_HD uint32_t PointsOf(const LabelItem& item, int block) const {
    if (item.mask < 0) return ~0u;
    const uint32_t inside =
        barrier.inside_mask[static_cast<int64_t>(item.mask) * kTileBlocks + block];
    return item.is_inside != 0 ? inside : ~inside;
  }

  // Widens the search until some site bounds the distance of all points from above, or all sites
  // have been seen. A Chebyshev distance d spans at most sqrt(3) * size * d in space.
  AMHEX_HD void FindReach(Search& search) const {
    const float whole_domain =
        bins.bin_size *
        static_cast<float>(Larger(bins.count_x, Larger(bins.count_y, bins.count_z)));
    for (float reach = bins.bin_size;; reach *= 2.0f) {
      float bound = search.limit;
      VisitNear(bins, search.centre, search.half_width + reach, [&](int32_t id) {
        const SiteMetric& site = metric[id];
        if (site.is_inside != search.is_inside) return;
        const float upper = BoundsOverCube(site, search.centre, search.half_width).upper;
        if (upper < bound) bound = upper;
      });
      if (bound < kUnboundedReach) {
        search.limit = search.is_inside != 0 ? bound + kCullSlack : kOutsideReach;
        search.reach = kSquareRootOfThree * largest_size * (bound + kCullSlack);
        return;
      }
      if (reach > whole_domain) {
        search.reach = 0;
        return;
      }
    }
  }

  // Gathers the sites that may own a point of the tile; false if there are too many.
  AMHEX_HD bool Collect(const Search& search, LabelCandidates& candidates) const {
    const float bound = search.reach / (kSquareRootOfThree * largest_size) + kCullSlack;
    bool fits = true;
    VisitNear(bins, search.centre, search.half_width + search.reach, [&](int32_t id) {
      const SiteMetric& site = metric[id];
      if (!fits || site.is_inside != search.is_inside) return;
      if (BoundsOverCube(site, search.centre, search.half_width).lower > bound) return;
      if (candidates.count == kCandidateCapacity) {
        fits = false;
        return;
      }
      candidates.id[candidates.count++] = id;
    });
    return fits;
  }

  AMHEX_HD void LabelBlock(const Search& search, const LabelCandidates& candidates,
                           const LatticePoint& base, uint32_t points, int32_t* block_labels) const {
    float lower[kCandidateCapacity];
    float upper[kCandidateCapacity];
    constexpr double kMiddle = 0.5 * (kBlockWidth - 1);
    const double spacing = barrier.lattice.spacing;
    const Vec3f centre = ToFloat(Vec3d{(base.x + kMiddle) * spacing, (base.y + kMiddle) * spacing,
                                       (base.z + kMiddle) * spacing});
    BoundCandidates(candidates, centre, static_cast<float>(kMiddle * spacing), lower, upper);
    float bound = search.limit;
    for (int k = 0; k < candidates.count; ++k) bound = Smaller(bound, upper[k]);
    int32_t chosen[kCandidateCapacity];
    int chosen_count = 0;
    for (int k = 0; k < candidates.count; ++k) {
      if (lower[k] <= bound + kCullSlack) chosen[chosen_count++] = k;
    }
    const bool is_single = chosen_count == 1 && search.is_inside != 0;
    uint32_t owned[kCandidateCapacity];
    if (is_single) {
      owned[0] = ~0u;
    } else {
      const float limit = search.is_inside != 0 ? kUnboundedReach : kOutsideReach;
      OwnPoints(candidates, chosen, chosen_count, base, spacing, limit, owned);
    }
    for (int i = 0; i < chosen_count; ++i) {
      Assign(candidates.id[chosen[i]], owned[i] & points, base, block_labels);
    }
  }

  // The same without candidates: every near site for every point.
  AMHEX_HD void LabelBlockByScan(const Search& search, const LatticePoint& base, uint32_t points,
                                 int32_t* block_labels) const {
    for (int p = 0; p < kBlockPoints; ++p) {
      if (((points >> p) & 1u) == 0) continue;
      const LatticePoint q = PointInBlock(p);
      const Vec3f position =
          ToFloat(barrier.lattice.PositionOf({base.x + q.x, base.y + q.y, base.z + q.z}));
      float nearest = search.is_inside != 0 ? kUnboundedReach : kOutsideReach;
      int32_t owner = kNoOwner;
      VisitNear(bins, search.centre, search.half_width + search.reach, [&](int32_t id) {
        if (metric[id].is_inside != search.is_inside) return;
        const float distance = ChebyshevDistance(metric[id], position);
        if (distance < nearest || (distance == nearest && owner != kNoOwner && id < owner)) {
          nearest = distance;
          owner = id;
        }
      });
      if (owner != kNoOwner) Assign(owner, 1u << p, base, block_labels);
    }
  }

  AMHEX_HD void Assign(int32_t site, uint32_t owned, const LatticePoint& base,
                       int32_t* block_labels) const {
    if (owned == 0) return;
    AddFirstMoments(owned, base, moments[site]);
    if (wants_second_moments) AddSecondMoments(owned, base, moments[site]);
    if (block_labels == nullptr) return;
    for (int p = 0; p < kBlockPoints; ++p) {
      if (((owned >> p) & 1u) != 0) block_labels[p] = site;
    }
  }
};

}  // namespace amhex
