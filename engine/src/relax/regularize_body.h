// The new centre of every site: eq. 3, c = (1 - w) c_g + w c_N6, in a form that is stable.
//
// deviates: the plain mean of six neighbours (c_N6) has a checkerboard mode of eigenvalue -1 when
// all sites move at once. Here neighbour j predicts where i should be from its own position, frame
// and size; a face at the hull predicts a site half a cell below it; and c_g joins the mean with
// weight 1 of k + 1. The step is damped as w grows.
#pragma once

#include <cstdint>

#include "base/quat.h"
#include "graph/bin_grid.h"
#include "relax/barrier_view.h"
#include "relax/cell_moments.h"
#include "relax/link_body.h"

namespace amhex {

// A hull sample counts for a face that looks along its normal within acos(0.8) = 37 degrees.
inline constexpr float kHullFaceAlignment = 0.8f;
// The hull is looked for this far from the expected face centre, edge lengths.
inline constexpr float kHullFaceReach = 1.0f;
// Of the step at w = 1 this share is kept back.
inline constexpr double kDamping = 0.25;
// No site moves farther in one iteration, edge lengths.
inline constexpr double kLargestStep = 0.5;
// Movements are summed in these units, so that the sum is exact.
inline constexpr double kMovementUnit = 1.0 / (1 << 24);

struct RegularizeBody {
  BarrierView barrier;
  ArrayView<const double> weight_at;     // [iteration_count] w of eq. 4
  ArrayView<const int64_t> iteration;    // [1]
  ArrayView<const Vec3d> position;       // [site_count] domain frame, before
  ArrayView<const Quatf> orientation;    // [site_count]
  ArrayView<const Vec3f> size;           // [site_count]
  ArrayView<const int32_t> is_inside;    // [site_count]
  ArrayView<const CellMoments> moments;  // [site_count]
  ArrayView<const int32_t> links;        // [site_count][6]
  BinGrid sample_bins;
  ArrayView<const Vec3f> sample_position;  // [sample_count] domain frame
  ArrayView<const Vec3f> sample_normal;    // [sample_count]
  ArrayView<Vec3d> moved;                  // [site_count] after
  ArrayView<int64_t> movement;             // [site_count] in kMovementUnit

  AMHEX_HD void operator()(int64_t site) const {
    const Vec3d start = position[site];
    const double weight = weight_at[iteration[0]];
    Vec3d centre = CellCentre(site);
    if (weight > 0) {
      centre = centre * (1.0 - weight) + NeighbourCentre(site, centre) * weight;
    }
    Vec3d step = (centre - start) * (1.0 - kDamping * weight);
    const double length = sqrt(Dot(step, step));
    if (length > kLargestStep) step *= kLargestStep / length;
    const Vec3d end = KeptOnItsSide(site, start, step);
    moved[site] = end;
    movement[site] = static_cast<int64_t>(sqrt(SquaredNorm(end - start)) / kMovementUnit);
  }

  // c_g; a cell without a lattice point stays where it is.
  AMHEX_HD Vec3d CellCentre(int64_t site) const {
    const CellMoments& m = moments[site];
    if (m.count == 0) return position[site];
    const double scale = barrier.lattice.spacing / static_cast<double>(m.count);
    return {static_cast<double>(m.x) * scale, static_cast<double>(m.y) * scale,
            static_cast<double>(m.z) * scale};
  }

  // c_N6: the mean of all predictions and of c_g itself.
  AMHEX_HD Vec3d NeighbourCentre(int64_t site, const Vec3d& cell_centre) const {
    Vec3d sum = cell_centre;
    int count = 1;
    for (int direction = 0; direction < kAxisDirectionCount; ++direction) {
      const int32_t link = links[site * kAxisDirectionCount + direction];
      const float half = 0.5f * size[site][direction / 2];
      const Vec3d own_face = ToDouble(DirectionOf(orientation[site], direction) * half);
      if (link >= 0) {
        const int32_t other = link / kAxisDirectionCount;
        const int back = link % kAxisDirectionCount;
        const float other_half = 0.5f * size[other][back / 2];
        sum += position[other] + ToDouble(DirectionOf(orientation[other], back) * other_half) -
               own_face;
        ++count;
      } else if (link == kHullFace) {
        Vec3d predicted;
        if (PredictFromHull(site, own_face, predicted)) {
          sum += predicted;
          ++count;
        }
      }
    }
    return sum / static_cast<double>(count);
  }

  // Half a cell below the plane of the sample nearest to the face, along the face's direction.
  AMHEX_HD bool PredictFromHull(int64_t site, const Vec3d& own_face, Vec3d& predicted) const {
    if (sample_bins.ids.empty()) return false;
    const Vec3d start = position[site];
    const double half = sqrt(Dot(own_face, own_face));
    const Vec3d direction = own_face / half;
    const Vec3f face_centre = ToFloat(start + own_face);
    const Vec3f outward = ToFloat(is_inside[site] != 0 ? direction : -direction);
    float nearest = kHullFaceReach * kHullFaceReach;
    int32_t best = kNoNode;
    VisitNear(sample_bins, face_centre, kHullFaceReach, [&](int32_t sample) {
      const float d = SquaredDistance(sample_position[sample], face_centre);
      if (d > nearest || (d == nearest && sample > best)) return;
      if (Dot(sample_normal[sample], outward) <= kHullFaceAlignment) return;
      nearest = d;
      best = sample;
    });
    if (best == kNoNode) return false;
    const Vec3d normal = ToDouble(sample_normal[best]);
    const double depth =
        Dot(normal, ToDouble(sample_position[best]) - start) / Dot(normal, direction);
    predicted = start + direction * (depth - half);
    return true;
  }

  // Sites never change sides: a step across the hull is halved once, then refused.
  AMHEX_HD Vec3d KeptOnItsSide(int64_t site, const Vec3d& start, const Vec3d& step) const {
    const bool side = is_inside[site] != 0;
    if (barrier.IsInside(start + step) == side) return start + step;
    const Vec3d half_way = start + step * 0.5;
    return barrier.IsInside(half_way) == side ? half_way : start;
  }
};

}  // namespace amhex
