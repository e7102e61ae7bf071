#include "closure/star_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/vector_lanes.h"
#include "optimize/cell_quality.h"

namespace amhex {
namespace {

// Steepest ascent of the smallest plane distance: steps shrink geometrically from kFirstStep, so
// that the search can travel about kFirstStep / (1 - kStepDecay) edge lengths.
constexpr int kKernelSteps = 64;
constexpr double kKernelFirstStep = 0.3;
constexpr double kKernelStepDecay = 0.92;
constexpr double kSmallestApexStep = 0.01;
// Stars below this are not judged to the end.
constexpr double kHopelessQuality = -0.9;
constexpr double kTinyLength = 1e-30;  // edge lengths cubed

// The six axis directions and the eight diagonals.
const std::array<Vec3d, 14>& SearchDirections() {
  static const std::array<Vec3d, 14> kDirections = [] {
    std::array<Vec3d, 14> d{};
    for (int i = 0; i < 6; ++i) d[i][i / 2] = i % 2 == 0 ? 1.0 : -1.0;
    for (int i = 0; i < 8; ++i) {
      d[6 + i] = Normalized(Vec3d{i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0});
    }
    return d;
  }();
  return kDirections;
}

double CornerQuality(const Vec3d& next, const Vec3d& previous, const Vec3d& apex) {
  const double length = std::sqrt(SquaredNorm(next) * SquaredNorm(previous) * SquaredNorm(apex));
  return length > kTinyLength ? Determinant(apex, next, previous) / length : -1.0;
}

// Half-spaces, eight at a time.
class PlaneTable {
 public:
  explicit PlaneTable(const std::vector<KernelPlane>& planes) : blocks_(LaneBlocks(planes.size())) {
    for (size_t k = 0; k < kLanes * blocks_.size(); ++k) {
      // What fills the last block is never the nearest.
      constexpr KernelPlane kFar{{1, 0, 0}, {-1e300, 0, 0}};
      const KernelPlane& plane = k < planes.size() ? planes[k] : kFar;
      blocks_[k / kLanes].normal.Set(k % kLanes, plane.normal);
      blocks_[k / kLanes].point.Set(k % kLanes, plane.point);
    }
  }

  // The first of the planes with the least distance to p; `depth` is that distance.
  size_t Nearest(const Vec3d& p, double* depth) const {
    DoubleLanes least = DoubleLanes{} + 1e300;
    LaneMask at{};
    RunWithWidestVectors([&] {
      for (size_t b = 0; b < blocks_.size(); ++b) {
        const DoubleLanes distance = blocks_[b].normal.Dot(blocks_[b].point.Towards(p));
        const LaneMask is_less = distance < least;
        least = is_less ? distance : least;
        at = is_less ? LaneMask{} + static_cast<int64_t>(b) : at;
      }
    });
    size_t nearest = 0;
    *depth = 1e300;
    for (int lane = 0; lane < kLanes; ++lane) {
      const size_t k = static_cast<size_t>(at[lane]) * kLanes + lane;
      if (least[lane] > *depth || (least[lane] == *depth && k > nearest)) continue;
      *depth = least[lane];
      nearest = k;
    }
    return nearest;
  }

 private:
  struct Block {
    VectorLanes normal, point;
  };
  std::vector<Block> blocks_;
};

// The corners of the cells between faces and an apex, prepared for many apices.
class StarCorners {
 public:
  StarCorners(const std::vector<CellFace>& faces, const std::vector<Vec3d>& x) {
    size_t corners = 0, triangles = 0;
    for (const CellFace& face : faces) {
      for (int j = 0; j < face.count; ++j) {
        const Vec3d& a = x[face.v[j]];
        const Vec3d next = x[face.v[(j + 1) % face.count]] - a;
        const Vec3d previous = x[face.v[(j + face.count - 1) % face.count]] - a;
        AddAtBase(corners++, a, Cross(next, previous), SquaredNorm(next) * SquaredNorm(previous));
      }
      if (face.count == 3) AddAtApex(triangles++, {x[face.v[0]], x[face.v[1]], x[face.v[2]]});
    }
  }

  // The least quality with this apex; where that is not above `enough`, some value that is not.
  double Minimum(const Vec3d& apex, double enough) {
    double minimum = 1;
    RunWithWidestVectors([&] {
      // What was worst last time is likely to be so again.
      const size_t count = at_base_.size() + at_apex_.size();
      for (size_t i = 0, b = worst_; i < count && minimum > enough; ++i) {
        const DoubleLanes quality = b < at_base_.size()
                                        ? at_base_[b].Quality(apex)
                                        : at_apex_[b - at_base_.size()].Quality(apex);
        for (int lane = 0; lane < kLanes; ++lane) {
          if (quality[lane] < minimum) minimum = quality[lane], worst_ = b;
        }
        b = b + 1 < count ? b + 1 : 0;
      }
    });
    return minimum;
  }

 private:
  AMHEX_LANES_INLINE static DoubleLanes Quotient(const DoubleLanes& determinant,
                                                 const DoubleLanes& squared_lengths) {
    const DoubleLanes length = SquareRoot(squared_lengths);
    return length > kTinyLength ? determinant / length : DoubleLanes{} - 1.0;
  }

  // Corners of the faces.
  struct BaseBlock {
    VectorLanes place, cross;
    DoubleLanes squared_lengths;

    AMHEX_LANES_INLINE DoubleLanes Quality(const Vec3d& apex) const {
      const VectorLanes arm = place.Towards(apex);
      return Quotient(arm.Dot(cross), squared_lengths * arm.Dot(arm));
    }
  };
  // The fourth corner of a tetrahedron.
  struct ApexBlock {
    std::array<VectorLanes, 3> corner;

    AMHEX_LANES_INLINE DoubleLanes Quality(const Vec3d& apex) const {
      const VectorLanes next = corner[1].From(apex), previous = corner[0].From(apex);
      const VectorLanes third = corner[2].From(apex);
      return Quotient(third.Dot(next.Cross(previous)),
                      next.Dot(next) * previous.Dot(previous) * third.Dot(third));
    }
  };

  // Each fills the rest of its block too: repeated corners change no minimum.
  void AddAtBase(size_t index, const Vec3d& place, const Vec3d& cross, double squared_lengths) {
    if (index % kLanes == 0) at_base_.emplace_back();
    for (int lane = static_cast<int>(index % kLanes); lane < kLanes; ++lane) {
      at_base_.back().place.Set(lane, place);
      at_base_.back().cross.Set(lane, cross);
      at_base_.back().squared_lengths[lane] = squared_lengths;
    }
  }
  void AddAtApex(size_t index, const std::array<Vec3d, 3>& corner) {
    if (index % kLanes == 0) at_apex_.emplace_back();
    for (int lane = static_cast<int>(index % kLanes); lane < kLanes; ++lane) {
      for (int j = 0; j < 3; ++j) at_apex_.back().corner[j].Set(lane, corner[j]);
    }
  }

  std::vector<BaseBlock> at_base_;
  std::vector<ApexBlock> at_apex_;
  size_t worst_ = 0;  // block
};

double TriangleSolidAngle(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const double la = Norm(a), lb = Norm(b), lc = Norm(c);
  const double denominator = la * lb * lc + Dot(a, b) * lc + Dot(b, c) * la + Dot(c, a) * lb;
  return -2 * std::atan2(Determinant(a, b, c), denominator);
}

}  // namespace

double StarQuality(const CellFace& face, const Vec3d& apex, const std::vector<Vec3d>& x,
                   double enough) {
  double quality = 1;
  for (int j = 0; j < face.count && quality > enough; ++j) {
    const Vec3d& a = x[face.v[j]];
    const Vec3d next = x[face.v[(j + 1) % face.count]] - a;
    const Vec3d previous = x[face.v[(j + face.count - 1) % face.count]] - a;
    quality = std::min(quality, CornerQuality(next, previous, apex - a));
  }
  if (face.count == 3 && quality > enough) {
    quality = std::min(
        quality, CornerQuality(x[face.v[1]] - apex, x[face.v[0]] - apex, x[face.v[2]] - apex));
  }
  return quality;
}

double MinStarQuality(const std::vector<CellFace>& faces, const Vec3d& apex,
                      const std::vector<Vec3d>& vertices) {
  double quality = 1;
  for (const CellFace& face : faces) {
    quality = std::min(quality, StarQuality(face, apex, vertices));
    if (quality < kHopelessQuality) break;
  }
  return quality;
}

double StarFoldMargin(const CellFace& face, const Vec3d& apex, const std::vector<Vec3d>& vertices) {
  constexpr int32_t kApex = -2;
  const CellFace out = Reversed(face);
  const CellCorners corners = face.count == 4
                                  ? MakePyramid(out.v, kApex)
                                  : MakeTetrahedronOn({out.v[0], out.v[1], out.v[2]}, kApex);
  std::array<Vec3d, 8> positions;
  for (int slot = 0; slot < 8; ++slot) {
    positions[slot] = corners[slot] == kApex ? apex : vertices[corners[slot]];
  }
  return FoldMargin(*FindCellPattern(corners), positions);
}

void AppendKernelPlanes(const CellFace& face, const std::vector<Vec3d>& x,
                        std::vector<KernelPlane>* planes) {
  const int triangles = face.count == 4 ? 4 : 1;
  for (int j = 0; j < triangles; ++j) {
    const Vec3d& a = x[face.v[j]];
    const Vec3d& b = x[face.v[(j + 1) % face.count]];
    const Vec3d& c = x[face.v[(j + 2) % face.count]];
    planes->push_back({Normalized(Cross(b - a, c - a)), (a + b + c) / 3.0});
  }
}

KernelPoint FindKernel(const std::vector<KernelPlane>& planes, const Vec3d& start,
                       double hopeless) {
  // The depth of a point changes by no more than the point moves. The slack is for rounding.
  constexpr double kTravelPerStep = 1 / (1 - kKernelStepDecay);
  constexpr double kSlack = 1e-6;
  const PlaneTable table(planes);
  KernelPoint best{start, -1e300};
  Vec3d p = start;
  double step = kKernelFirstStep;
  for (int i = 0; i < kKernelSteps; ++i) {
    double depth = 1e300;
    const size_t nearest = table.Nearest(p, &depth);
    if (depth > best.depth) best = {p, depth};
    if (best.depth < hopeless && depth + step * kTravelPerStep < hopeless - kSlack) break;
    p += planes[nearest].normal * step;
    step *= kKernelStepDecay;
  }
  return best;
}

double ImproveApex(const std::vector<CellFace>& faces, const std::vector<Vec3d>& vertices,
                   double first_step, Vec3d* apex) {
  double quality = MinStarQuality(faces, *apex, vertices);
  StarCorners corners(faces, vertices);
  double step = first_step;
  while (step > kSmallestApexStep) {
    Vec3d best = *apex;
    double best_quality = quality;
    for (const Vec3d& direction : SearchDirections()) {
      const Vec3d candidate = *apex + direction * step;
      const double q = best_quality < kHopelessQuality ? MinStarQuality(faces, candidate, vertices)
                                                       : corners.Minimum(candidate, best_quality);
      if (q > best_quality) best_quality = q, best = candidate;
    }
    if (best_quality > quality + 1e-6) {
      quality = best_quality;
      *apex = best;
    } else {
      step *= 0.5;
    }
  }
  return quality;
}

double SolidAngle(const std::vector<CellFace>& faces, const Vec3d& apex,
                  const std::vector<Vec3d>& x) {
  double sum = 0;
  for (const CellFace& face : faces) {
    const Vec3d a = x[face.v[0]] - apex, b = x[face.v[1]] - apex, c = x[face.v[2]] - apex;
    sum += TriangleSolidAngle(a, b, c);
    if (face.count == 4) sum += TriangleSolidAngle(a, c, x[face.v[3]] - apex);
  }
  return sum;
}

}  // namespace amhex
