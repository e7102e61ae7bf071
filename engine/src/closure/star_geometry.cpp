#include "closure/star_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace amhex {
namespace {

// Steepest ascent of the smallest plane distance: steps shrink geometrically from kFirstStep, so
// that the search can travel about kFirstStep / (1 - kStepDecay) edge lengths.
constexpr int kKernelSteps = 64;
constexpr double kKernelFirstStep = 0.3;
constexpr double kKernelStepDecay = 0.92;
constexpr double kSmallestApexStep = 0.01;

// The six axis directions and the eight diagonals.
const std::array<Vec3d, 14>& SearchDirections() {
  static const std::array<Vec3d, 14> directions = [] {
    std::array<Vec3d, 14> d{};
    for (int i = 0; i < 6; ++i) d[i][i / 2] = i % 2 == 0 ? 1.0 : -1.0;
    for (int i = 0; i < 8; ++i) {
      d[6 + i] = Normalized(Vec3d{i & 1 ? 1.0 : -1.0, i & 2 ? 1.0 : -1.0, i & 4 ? 1.0 : -1.0});
    }
    return d;
  }();
  return directions;
}

double CornerQuality(const Vec3d& next, const Vec3d& previous, const Vec3d& apex) {
  const double length = std::sqrt(SquaredNorm(next) * SquaredNorm(previous) * SquaredNorm(apex));
  return length > 1e-30 ? Determinant(apex, next, previous) / length : -1.0;
}

double TriangleSolidAngle(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  const double la = Norm(a), lb = Norm(b), lc = Norm(c);
  const double denominator = la * lb * lc + Dot(a, b) * lc + Dot(b, c) * la + Dot(c, a) * lb;
  return -2 * std::atan2(Determinant(a, b, c), denominator);
}

}  // namespace

double StarQuality(const CellFace& face, const Vec3d& apex, const std::vector<Vec3d>& x) {
  double quality = 1;
  for (int j = 0; j < face.count; ++j) {
    const Vec3d& a = x[face.v[j]];
    const Vec3d next = x[face.v[(j + 1) % face.count]] - a;
    const Vec3d previous = x[face.v[(j + face.count - 1) % face.count]] - a;
    quality = std::min(quality, CornerQuality(next, previous, apex - a));
  }
  if (face.count == 3) {
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
    if (quality < -0.9) break;
  }
  return quality;
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

KernelPoint FindKernel(const std::vector<KernelPlane>& planes, const Vec3d& start) {
  KernelPoint best{start, -1e300};
  Vec3d p = start;
  double step = kKernelFirstStep;
  for (int i = 0; i < kKernelSteps; ++i) {
    double depth = 1e300;
    size_t nearest = 0;
    for (size_t k = 0; k < planes.size(); ++k) {
      const double d = Dot(planes[k].normal, p - planes[k].point);
      if (d < depth) depth = d, nearest = k;
    }
    if (depth > best.depth) best = {p, depth};
    p += planes[nearest].normal * step;
    step *= kKernelStepDecay;
  }
  return best;
}

double ImproveApex(const std::vector<CellFace>& faces, const std::vector<Vec3d>& vertices,
                   double first_step, Vec3d* apex) {
  double quality = MinStarQuality(faces, *apex, vertices);
  double step = first_step;
  while (step > kSmallestApexStep) {
    Vec3d best = *apex;
    double best_quality = quality;
    for (const Vec3d& direction : SearchDirections()) {
      const Vec3d candidate = *apex + direction * step;
      const double q = MinStarQuality(faces, candidate, vertices);
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
