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
#include "relax/cell_moments.h"
#include "relax/label_candidates.h"

namespace amhex {

inline constexpr int32_t kNoOwner = -1;
inline constexpr float kSquareRootOfThree = 1.7320508f;
// First guess of how far from a tile its owners lie, in their own sizes: enough nearly always.
inline constexpr float kFirstReach = 1.75f;

struct LabelTileBody {
  BarrierView barrier;
  ArrayView<const LabelItem> items;
  BinGrid bins;                        // of the sites
  ArrayView<const SiteMetric> metric;  // [site_count] by slot of the bins
  float largest_size = 1.0f;           // of any site along any axis, edge lengths
  bool wants_second_moments = false;
  // Second moments are added up of cells that others claim so often, if there are such; of all
  // where these are empty.
  ArrayView<const int64_t> cluster_count;  // [1] 0: no cell is split
  ArrayView<const int32_t> claim_count;    // [site_count]
  int32_t split_limit = 0;
  ArrayView<CellMoments> moments;  // [site_count], zero before
  ArrayView<int32_t> labels;       // [item_count][256] owners, or empty when not wanted

  // The cube of a tile's points and the search for their owners.
  struct Search {
    LatticePoint base;
    Vec3f centre;          // lattice coordinates
    float half_width = 0;  // the same
    int32_t is_inside = 0;
    float limit = 0;  // owners are nearer than this, in cell sizes
    float reach = 0;  // and within this distance of the cube in space, in their own largest size
    float block_bound[kTileBlocks];  // upper bound of the owners' distances, in cell sizes
  };

  AMHEX_HD void operator()(int64_t index) const {
#if defined(__CUDA_ARCH__)
    Label(index);
#else
    LabelWith(WidestVectors(), index);
#endif
  }

  // The same labels at any width; the machine must have it.
  AMHEX_HD void LabelWith(VectorWidth width, int64_t index) const {
    switch (width) {
      case VectorWidth::k512:
        return Label512(*this, index);
      case VectorWidth::k256:
        return Label256(*this, index);
      case VectorWidth::kBaseline:
        return LabelBaseline(*this, index);
    }
  }
  AMHEX_VECTORS_512 AMHEX_HD static void Label512(const LabelTileBody& body, int64_t index) {
    body.Label(index);
  }
  AMHEX_VECTORS_256 AMHEX_HD static void Label256(const LabelTileBody& body, int64_t index) {
    body.Label(index);
  }
  AMHEX_HD static void LabelBaseline(const LabelTileBody& body, int64_t index) {
    body.Label(index);
  }

  AMHEX_HD void Label(int64_t index) const {
    const LabelItem item = items[index];
    Search search = Begin(item);
    LabelCandidates candidates;
    const bool fits = Gather(search, candidates);
    for (int block = 0; block < kTileBlocks; ++block) {
      int32_t* block_labels =
          labels.empty() ? nullptr : &labels[index * kTilePoints + int64_t{block} * kBlockPoints];
      if (block_labels != nullptr) {
        for (int p = 0; p < kBlockPoints; ++p) block_labels[p] = kNoOwner;
      }
      const uint32_t points = PointsOf(item, block);
      if (points == 0) continue;
      if (fits) {
        LabelBlock(search, candidates, block, points, block_labels);
      } else {
        LabelBlockByScan(search, block, points, block_labels);
      }
    }
  }

  AMHEX_HD bool WantsSecondMoments() const {
    return wants_second_moments && (cluster_count.empty() || cluster_count[0] > 0);
  }
  AMHEX_HD bool MayBeSplit(int32_t site) const {
    return claim_count.empty() || claim_count[site] >= split_limit;
  }
  AMHEX_HD LatticePoint BlockBase(const Search& search, int block) const {
    const LatticePoint offset = BlockInTile(block);
    return {search.base.x + offset.x, search.base.y + offset.y, search.base.z + offset.z};
  }

  AMHEX_HD Search Begin(const LabelItem& item) const {
    Search search;
    search.base = barrier.lattice.TileOrigin(item.tile);
    search.centre = CentreOfCube(search.base, kTileHalfWidth);
    search.half_width = kTileHalfWidth;
    search.is_inside = item.is_inside;
    search.limit = item.is_inside != 0 ? kUnboundedReach : kOutsideReach;
    return search;
  }

  AMHEX_HD uint32_t PointsOf(const LabelItem& item, int block) const {
    if (item.mask < 0) return ~0u;
    const uint32_t inside =
        barrier.inside_mask[static_cast<int64_t>(item.mask) * kTileBlocks + block];
    return item.is_inside != 0 ? inside : ~inside;
  }

  // How far in space a site at Chebyshev distance `bound` can be, in its largest size.
  AMHEX_HD float ReachOf(float bound) const { return kSquareRootOfThree * (bound + kCullSlack); }
  AMHEX_HD float Spacing() const { return static_cast<float>(barrier.lattice.spacing); }
  // Half width of the cube that holds every site within reach, edge lengths as the bins have them.
  AMHEX_HD float SearchRadius(const Search& search) const {
    return (search.half_width + search.reach * CoveringSize(largest_size, Spacing())) * Spacing();
  }
  AMHEX_HD bool HasSeenAll(const Search& search) const {
    const int32_t longest = Larger(bins.count_x, Larger(bins.count_y, bins.count_z));
    return search.reach * largest_size > bins.bin_size * static_cast<float>(longest);
  }
  // Whether a site is of the tile's side and near enough to its cube.
  AMHEX_HD bool IsWithinReach(const Search& search, const SiteMetric& site) const {
    const float reach = search.reach * site.Size();
    const float dx = Larger(AbsoluteValue(site.x - search.centre.x) - search.half_width, 0.0f);
    const float dy = Larger(AbsoluteValue(site.y - search.centre.y) - search.half_width, 0.0f);
    const float dz = Larger(AbsoluteValue(site.z - search.centre.z) - search.half_width, 0.0f);
    return dx * dx + dy * dy + dz * dz <= reach * reach && site.IsOfSide(search.is_inside);
  }

  // Collects every site that may own a point of the tile, by id; false if there are too many.
  // Widens the search until some site bounds the distances from above, or all have been seen.
  AMHEX_HD bool Gather(Search& search, LabelCandidates& candidates) const {
    search.reach = kFirstReach;
    while (true) {
      bool fits = CollectWithin(search, candidates);
      const float bound = LargestBound(search);
      const float needed = ReachOf(bound);
      if (needed <= search.reach || HasSeenAll(search)) {
        if (!fits) fits = CollectBelow(bound + kCullSlack, search, candidates);
        if (fits) Cull(search, bound, candidates);
        return fits;
      }
      search.reach = bound < kUnboundedReach ? needed : 2 * search.reach;
    }
  }

  // The sites of this side within reach of the tile, and every block's bound by all of them; false
  // if some had no place.
  AMHEX_HD bool CollectWithin(Search& search, LabelCandidates& candidates) const {
    bool fits = true;
    candidates.count = 0;
    for (float& bound : search.block_bound) bound = search.limit;
    VisitSlotsNear(bins, search.centre * Spacing(), SearchRadius(search), [&](int64_t slot) {
      if (!IsWithinReach(search, metric[slot])) return;
      if (candidates.count == kCandidateCapacity) {
        fits = false;
        LowerBounds(search, candidates);
        candidates.count = 0;
      }
      candidates.slot[candidates.count++] = static_cast<int32_t>(slot);
    });
    LowerBounds(search, candidates);
    return fits;
  }

  // Of those only the ones whose lower bound over the tile does not exceed `limit`.
  AMHEX_HD bool CollectBelow(float limit, const Search& search, LabelCandidates& candidates) const {
    bool fits = true;
    candidates.count = 0;
    VisitSlotsNear(bins, search.centre * Spacing(), SearchRadius(search), [&](int64_t slot) {
      const SiteMetric& site = metric[slot];
      if (!fits || !IsWithinReach(search, site)) return;
      if (BoundsOverCube(site, search.centre, search.half_width).lower > limit) return;
      fits = candidates.count < kCandidateCapacity;
      if (fits) candidates.slot[candidates.count++] = static_cast<int32_t>(slot);
    });
    if (fits) candidates.Load(metric.data);
    return fits;
  }

  // Of every block's distances, by these candidates.
  AMHEX_HD void LowerBounds(Search& search, LabelCandidates& candidates) const {
    candidates.Load(metric.data);
    for (int block = 0; block < kTileBlocks; ++block) {
      const Vec3f centre = CentreOfCube(BlockBase(search, block), kBlockHalfWidth);
      const float upper = SmallestUpperBound(candidates, centre, kBlockHalfWidth);
      search.block_bound[block] = Smaller(upper, search.block_bound[block]);
    }
  }
  AMHEX_HD float LargestBound(const Search& search) const {
    float largest = 0;
    for (const float bound : search.block_bound) largest = Larger(largest, bound);
    return largest;
  }

  AMHEX_HD void Cull(const Search& search, float bound, LabelCandidates& candidates) const {
    int32_t chosen[kCandidateCapacity];
    candidates.count =
        ChooseCandidates(candidates, search.centre, search.half_width, bound + kCullSlack, chosen);
    for (int k = 0; k < candidates.count; ++k) {
      candidates.slot[k] = candidates.slot[chosen[k]];
      candidates.id[k] = bins.ids[candidates.slot[k]];
    }
    candidates.SortById();
    candidates.Load(metric.data);
  }

  AMHEX_HD void LabelBlock(const Search& search, const LabelCandidates& candidates, int block,
                           uint32_t points, int32_t* block_labels) const {
    const LatticePoint base = BlockBase(search, block);
    const Vec3f centre = CentreOfCube(base, kBlockHalfWidth);
    int32_t chosen[kCandidateCapacity];
    const int chosen_count = ChooseCandidates(candidates, centre, kBlockHalfWidth,
                                              search.block_bound[block] + kCullSlack, chosen);
    uint32_t owned[kCandidateCapacity];
    if (chosen_count == 1 && search.is_inside != 0) {
      owned[0] = ~0u;
    } else {
      OwnPoints(candidates, chosen, chosen_count, centre, search.limit, owned);
    }
    for (int i = 0; i < chosen_count; ++i) {
      Assign(candidates.id[chosen[i]], owned[i] & points, base, block_labels);
    }
  }

  // The same without candidates.
  AMHEX_HD void LabelBlockByScan(const Search& search, int block, uint32_t points,
                                 int32_t* block_labels) const {
    const LatticePoint base = BlockBase(search, block);
    const Vec3f centre = CentreOfCube(base, kBlockHalfWidth);
    for (int p = 0; p < kBlockPoints; ++p) {
      if (((points >> p) & 1u) == 0) continue;
      const int32_t owner = OwnerByScan(search, centre, StepFromCentre(p));
      if (owner != kNoOwner) Assign(owner, 1u << p, base, block_labels);
    }
  }

  // The nearest of all sites near the tile to the point this far from the centre of its block.
  AMHEX_HD int32_t OwnerByScan(const Search& search, const Vec3f& centre, const Vec3f& step) const {
    float nearest = search.limit;
    int32_t owner = kNoOwner;
    VisitSlotsNear(bins, search.centre * Spacing(), SearchRadius(search), [&](int64_t slot) {
      if (!metric[slot].IsOfSide(search.is_inside)) return;
      const float distance = ChebyshevDistance(metric[slot], centre, step);
      const int32_t id = bins.ids[slot];
      if (distance < nearest || (distance == nearest && owner != kNoOwner && id < owner)) {
        nearest = distance;
        owner = id;
      }
    });
    return owner;
  }

  AMHEX_HD void Assign(int32_t site, uint32_t owned, const LatticePoint& base,
                       int32_t* block_labels) const {
    if (owned == 0) return;
    AddFirstMoments(owned, base, moments[site]);
    if (WantsSecondMoments() && MayBeSplit(site)) AddSecondMoments(owned, base, moments[site]);
    if (block_labels == nullptr) return;
    for (int p = 0; p < kBlockPoints; ++p) {
      if (((owned >> p) & 1u) != 0) block_labels[p] = site;
    }
  }
};

}  // namespace amhex
