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

// Half-spaces, four at a time.
class PlaneTable {
 public:
  explicit PlaneTable(const std::vector<KernelPlane>& planes)
      : blocks_((planes.size() + kHalfLanes - 1) / kHalfLanes) {
    for (size_t k = 0; k < kHalfLanes * blocks_.size(); ++k) {
      // What fills the last block is never the nearest.
      constexpr KernelPlane kFar{{1, 0, 0}, {-1e300, 0, 0}};
      const KernelPlane& plane = k < planes.size() ? planes[k] : kFar;
      blocks_[k / kHalfLanes].normal.Set(k % kHalfLanes, plane.normal);
      blocks_[k / kHalfLanes].point.Set(k % kHalfLanes, plane.point);
    }
  }

  // The first of the planes with the least distance to p; `depth` is that distance.
  size_t Nearest(const Vec3d& p, double* depth) const {
    HalfLanes least = HalfLanes{} + 1e300;
    HalfMask at{};
    RunWithWidestVectors([&] {
      for (size_t b = 0; b < blocks_.size(); ++b) {
        const HalfLanes distance = blocks_[b].normal.Dot(blocks_[b].point.Towards(p));
        const HalfMask is_less = distance < least;
        least = is_less ? distance : least;
        at = is_less ? HalfMask{} + static_cast<int64_t>(b) : at;
      }
    });
    size_t nearest = 0;
    *depth = 1e300;
    for (int lane = 0; lane < kHalfLanes; ++lane) {
      const size_t k = static_cast<size_t>(at[lane]) * kHalfLanes + lane;
      if (least[lane] > *depth || (least[lane] == *depth && k > nearest)) continue;
      *depth = least[lane];
      nearest = k;
    }
    return nearest;
  }

 private:
  struct Block {
    VectorsOf<kHalfLanes> normal, point;
  };
  std::vector<Block> blocks_;
};

// What no point's least distance to the planes exceeds, by some of the planes. The distance to one
// of them is no less than the least one, and so is any mean of such distances, of which the slopes
// cancel where the planes stand against each other.
class DepthBound {
 public:
  // The plane that is nearest to p. Earlier ones come to count less: of 0.7 to 1 this fading took
  // the fewest steps, two fifths of what the last plane alone took.
  void Add(const Vec3d& normal, const Vec3d& p, double depth) {
    constexpr double kFading = 0.9;
    weight_ = kFading * weight_ + 1;
    slope_ = slope_ * kFading + normal;
    at_origin_ = kFading * at_origin_ + depth - Dot(normal, p);
  }
  // Of all points within this of p.
  double Within(double distance, const Vec3d& p) const {
    return (at_origin_ + Dot(slope_, p) + Norm(slope_) * distance) / weight_;
  }

 private:
  double weight_ = 0;
  Vec3d slope_;
  double at_origin_ = 0;
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

  // The least quality with this apex; where that is not above `enough`, which is above -1, some
  // value that is not.
  double Minimum(const Vec3d& apex, double enough) {
    double minimum = 1;
    RunWithWidestVectors([&] {
      if (enough < 0 ? IsPoor<true>(apex, enough) : IsPoor<false>(apex, enough)) {
        minimum = enough;
        return;
      }
      for (size_t b = 0; b < count() && minimum > enough; ++b) {
        const HalfLanes quality = QualityIn(b, apex);
        for (int lane = 0; lane < kHalfLanes; ++lane) {
          if (quality[lane] < minimum) minimum = quality[lane];
        }
      }
    });
    return minimum;
  }

 private:
  using Vectors = VectorsOf<kHalfLanes>;
  // Quality is the determinant over the square root.
  struct Terms {
    HalfLanes determinant, squared_lengths;
  };

  // Corners of the faces.
  struct BaseBlock {
    Vectors place, cross;
    HalfLanes squared_lengths;

    AMHEX_LANES_INLINE Terms At(const Vec3d& apex) const {
      const Vectors arm = place.Towards(apex);
      return {arm.Dot(cross), squared_lengths * arm.Dot(arm)};
    }
  };
  // The fourth corner of a tetrahedron.
  struct ApexBlock {
    std::array<Vectors, 3> corner;

    AMHEX_LANES_INLINE Terms At(const Vec3d& apex) const {
      const Vectors next = corner[1].From(apex), previous = corner[0].From(apex);
      const Vectors third = corner[2].From(apex);
      return {third.Dot(next.Cross(previous)),
              next.Dot(next) * previous.Dot(previous) * third.Dot(third)};
    }
  };

  size_t count() const { return at_base_.size() + at_apex_.size(); }
  AMHEX_LANES_INLINE Terms TermsIn(size_t block, const Vec3d& apex) const {
    return block < at_base_.size() ? at_base_[block].At(apex)
                                   : at_apex_[block - at_base_.size()].At(apex);
  }
  AMHEX_LANES_INLINE HalfLanes QualityIn(size_t block, const Vec3d& apex) const {
    const Terms terms = TermsIn(block, apex);
    const HalfLanes length = SquareRoot(terms.squared_lengths);
    return length > kTinyLength ? terms.determinant / length : HalfLanes{} - 1.0;
  }

  // Whether a corner's quality is not above `enough`, and so clearly that its square tells: most
  // apices that are tried end here, without a root or a quotient. Lengths too small to count tell
  // nothing wrong, as the quality is -1 there.
  template <bool kIsNegative>
  AMHEX_LANES_INLINE bool IsPoor(const Vec3d& apex, double enough) {
    constexpr double kRounding = 1e-12;  // some ten roundings are 1e-15
    const double bound = enough * enough * (kIsNegative ? 1 + kRounding : 1 - kRounding);
    // What was poor last time is likely to be so again.
    for (size_t i = 0, b = poor_; i < count(); ++i) {
      const Terms terms = TermsIn(b, apex);
      const HalfLanes excess =
          terms.determinant * terms.determinant - bound * terms.squared_lengths;
      const auto turned = reinterpret_cast<HalfMask>(terms.determinant);
      const HalfMask poor = kIsNegative ? turned & reinterpret_cast<HalfMask>(-excess)
                                        : turned | reinterpret_cast<HalfMask>(excess);
      if (((poor[0] | poor[1]) | (poor[2] | poor[3])) < 0) {
        poor_ = b;
        return true;
      }
      b = b + 1 < count() ? b + 1 : 0;
    }
    return false;
  }

  // Each fills the rest of its block too: repeated corners change no minimum.
  void AddAtBase(size_t index, const Vec3d& place, const Vec3d& cross, double squared_lengths) {
    if (index % kHalfLanes == 0) at_base_.emplace_back();
    for (int lane = static_cast<int>(index % kHalfLanes); lane < kHalfLanes; ++lane) {
      at_base_.back().place.Set(lane, place);
      at_base_.back().cross.Set(lane, cross);
      at_base_.back().squared_lengths[lane] = squared_lengths;
    }
  }
  void AddAtApex(size_t index, const std::array<Vec3d, 3>& corner) {
    if (index % kHalfLanes == 0) at_apex_.emplace_back();
    for (int lane = static_cast<int>(index % kHalfLanes); lane < kHalfLanes; ++lane) {
      for (int j = 0; j < 3; ++j) at_apex_.back().corner[j].Set(lane, corner[j]);
    }
  }

  std::vector<BaseBlock> at_base_;
  std::vector<ApexBlock> at_apex_;
  size_t poor_ = 0;  // block
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
  constexpr double kTravelPerStep = 1 / (1 - kKernelStepDecay);
  constexpr double kSlack = 1e-6;  // for rounding
  const PlaneTable table(planes);
  DepthBound bound;
  KernelPoint best{start, -1e300};
  Vec3d p = start;
  double step = kKernelFirstStep;
  for (int i = 0; i < kKernelSteps; ++i) {
    double depth = 1e300;
    const size_t nearest = table.Nearest(p, &depth);
    if (depth > best.depth) best = {p, depth};
    if (best.depth < hopeless) {
      bound.Add(planes[nearest].normal, p, depth);
      if (bound.Within(step * kTravelPerStep, p) < hopeless - kSlack) break;
    }
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
