#include "demo/shapes.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace amhex::client {
namespace {

// Bracket dimensions in millimetres. The base lies on z = 0, the flange stands at low x.
constexpr double kBaseHalfX = 50, kBaseHalfY = 30, kBaseHeight = 12, kBaseCornerRadius = 8;
constexpr double kFlangeThickness = 12, kFlangeHeight = 60, kFlangeCornerRadius = 12;
constexpr double kRibHalfThickness = 6, kRibReachX = 24, kRibReachZ = 48;
constexpr double kPlateFillet = 8, kRibFillet = 4;
constexpr double kBaseHoleRadius = 7, kBaseHoleX = 30, kBaseHoleY = 16;
constexpr double kFlangeHoleRadius = 6, kFlangeHoleY = 17, kFlangeHoleZ = 42;
constexpr double kRibHoleRadius = 5, kRibHoleX = -28, kRibHoleZ = 22;

// Rectangle of half sizes a, b with rounded corners, in the plane.
double RoundedRectangle(double x, double y, double a, double b, double radius) {
  const double dx = std::abs(x) - a + radius, dy = std::abs(y) - b + radius;
  return std::min(std::max(dx, dy), 0.0) + std::hypot(std::max(dx, 0.0), std::max(dy, 0.0)) -
         radius;
}

// Intersection of a plane figure with a slab, both as distances.
double Extrude(double figure, double slab) {
  return std::min(std::max(figure, slab), 0.0) +
         std::hypot(std::max(figure, 0.0), std::max(slab, 0.0));
}

// Union with a fillet of the given radius in the inner edge.
double FilletUnion(double a, double b, double radius) {
  const double u = std::max(radius - a, 0.0), v = std::max(radius - b, 0.0);
  return std::max(radius, std::min(a, b)) - std::hypot(u, v);
}

double Cylinder(double u, double v, double radius) { return std::hypot(u, v) - radius; }

double Plates(const Vec3d& p) {
  const double base = Extrude(RoundedRectangle(p.x, p.y, kBaseHalfX, kBaseHalfY, kBaseCornerRadius),
                              std::abs(p.z - kBaseHeight / 2) - kBaseHeight / 2);
  // The flange's figure reaches below the base so that only its upper corners are round.
  const double flange_low = -kFlangeCornerRadius;
  const double flange_middle = (kFlangeHeight + flange_low) / 2;
  const double flange_x = -kBaseHalfX + kFlangeThickness / 2;
  double flange = Extrude(RoundedRectangle(p.y, p.z - flange_middle, kBaseHalfY,
                                           kFlangeHeight - flange_middle, kFlangeCornerRadius),
                          std::abs(p.x - flange_x) - kFlangeThickness / 2);
  // Where faces of both lie in one plane the fillet would bulge; the outline cuts that off, and
  // rounds the flange's upright edges like those of the base.
  const double outline = RoundedRectangle(p.x, p.y, kBaseHalfX, kBaseHalfY, kBaseCornerRadius);
  return std::max({FilletUnion(base, flange, kPlateFillet), outline, -p.z});
}

double Rib(const Vec3d& p) {
  // The slanted face runs from (kRibReachX, 0) on the base up to (-kBaseHalfX, kRibReachZ).
  const double run = kRibReachX + kBaseHalfX, rise = kRibReachZ;
  const double length = std::hypot(run, rise);
  const double slant = ((p.x - kRibReachX) * rise + p.z * run) / length;
  const double back = -kBaseHalfX + kFlangeThickness / 2 - p.x;
  const double bottom = kBaseHeight / 2 - p.z;
  return std::max({slant, back, bottom, std::abs(p.y) - kRibHalfThickness});
}

double Bracket(const Vec3d& p) {
  double d = FilletUnion(Plates(p), Rib(p), kRibFillet);
  const double side_y = std::abs(p.y);
  d = std::max(d, -Cylinder(p.x - kBaseHoleX, side_y - kBaseHoleY, kBaseHoleRadius));
  // The flange holes end in mid air.
  const double flange_hole =
      std::max(Cylinder(side_y - kFlangeHoleY, p.z - kFlangeHoleZ, kFlangeHoleRadius), p.x);
  d = std::max(d, -flange_hole);
  return std::max(d, -Cylinder(p.x - kRibHoleX, p.z - kRibHoleZ, kRibHoleRadius));
}

double Cube(const Vec3d& p) {
  constexpr double kHalf = 0.5;
  const Vec3d q = {std::abs(p.x) - kHalf, std::abs(p.y) - kHalf, std::abs(p.z) - kHalf};
  const Vec3d outside = ComponentMax(q, Vec3d{});
  return std::min(std::max({q.x, q.y, q.z}), 0.0) + Norm(outside);
}

double Torus(const Vec3d& p) {
  constexpr double kRingRadius = 0.5, kTubeRadius = 0.2;
  return std::hypot(std::hypot(p.x, p.y) - kRingRadius, p.z) - kTubeRadius;
}

double Sphere(const Vec3d& p) {
  constexpr double kRadius = 0.5;
  return Norm(p) - kRadius;
}

Box3d Box(const Vec3d& low, const Vec3d& high) {
  Box3d box;
  box.Extend(low);
  box.Extend(high);
  return box;
}

}  // namespace

std::vector<std::string> ShapeNames() { return {"bracket", "sphere", "cube", "torus"}; }

absl::StatusOr<Shape> MakeShape(const std::string& name) {
  if (name == "bracket") {
    return Shape{name, &Bracket,
                 Box({-kBaseHalfX, -kBaseHalfY, 0}, {kBaseHalfX, kBaseHalfY, kFlangeHeight})};
  }
  if (name == "sphere") return Shape{name, &Sphere, Box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5})};
  if (name == "cube") return Shape{name, &Cube, Box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5})};
  if (name == "torus") return Shape{name, &Torus, Box({-0.7, -0.7, -0.2}, {0.7, 0.7, 0.2})};
  return absl::InvalidArgumentError(absl::StrCat(
      "there is no shape called \"", name, "\"; known are ", absl::StrJoin(ShapeNames(), ", ")));
}

Vec3d NormalAt(const Shape& shape, const Vec3d& p) {
  constexpr double kStepPerDiagonal = 1e-6;
  const double step = kStepPerDiagonal * shape.box.Diagonal();
  Vec3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3d before = p, after = p;
    before[axis] -= step;
    after[axis] += step;
    gradient[axis] = shape.distance(after) - shape.distance(before);
  }
  return Normalized(gradient);
}

}  // namespace amhex::client
