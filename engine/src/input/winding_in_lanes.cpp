#include "input/winding_in_lanes.h"

#include <algorithm>
#include <numbers>

#include "base/vector_lanes.h"
#include "base/widest_vectors.h"
#include "input/triangle_math.h"

namespace amhex {
namespace {

static_assert(kPointsAtOnce == kLanes && kLanes == 8, "lanes are told apart by the bits of a byte");

// Of eight points in registers of kCount lanes.
template <int kCount>
class Walkers {
 public:
  AMHEX_LANES_INLINE Walkers(const Vec3d* points, int count) : sum_{} {
    for (int lane = 0; lane < kLanes; ++lane) {
      places_[lane / kCount].Set(lane % kCount, points[std::min(lane, count - 1)]);
    }
  }
  // Those of `lanes` that are far from the dipole, which is added to their sums.
  AMHEX_LANES_INLINE uint32_t AddFar(const HullDipole& dipole, uint32_t lanes) {
    uint32_t far = 0;
    for (int part = 0; part < kParts; ++part) {
      const uint32_t own = lanes >> (kCount * part) & kAll;
      const VectorsOf<kCount> to_centre = places_[part].Towards(dipole.centre);
      const Numbers squared = to_centre.Dot(to_centre);
      const Mask is_far = (squared > dipole.far_squared) & MaskOf(own);
      const uint32_t bits = BitsOf(is_far);
      if (bits == 0) continue;
      far |= bits << (kCount * part);
      const Numbers angle = FarSolidAngle(dipole, to_centre, squared, SquareRoot(squared));
      sum_[part] = is_far ? sum_[part] + angle : sum_[part];
    }
    return far;
  }
  AMHEX_LANES_INLINE void Add(int lane, double angle) {
    sum_[lane / kCount][lane % kCount] += angle;
  }
  AMHEX_LANES_INLINE double SumOf(int lane) const { return sum_[lane / kCount][lane % kCount]; }

 private:
  static constexpr int kParts = kLanes / kCount;
  static constexpr uint32_t kAll = (1U << kCount) - 1;
  using Numbers = typename LanesOf<kCount>::Doubles;
  using Mask = typename LanesOf<kCount>::Mask;

  AMHEX_LANES_INLINE static Mask MaskOf(uint32_t bits) {
    Mask own;
    for (int lane = 0; lane < kCount; ++lane) own[lane] = int64_t{1} << lane;
    return (own & static_cast<int64_t>(bits)) != 0;
  }

  VectorsOf<kCount> places_[kParts];
  Numbers sum_[kParts];
};

// Every point walks the hierarchy as HullView::WindingBySolidAngles does, all of them together: in
// the order of the nodes, so that each one's sum has the same terms in the same order.
template <int kCount>
AMHEX_LANES_INLINE void Walk(const HullView& hull, const Vec3d* points, int count,
                             double* solid_angle) {
  Walkers<kCount> walkers(points, count);
  struct Waiting {
    int32_t node;
    uint32_t lanes;
  };
  Waiting stack[kHullStackSize];
  int size = 1;
  stack[0] = {0, (1U << count) - 1};
  while (size > 0) {
    const Waiting entry = stack[--size];
    const uint32_t near = entry.lanes & ~walkers.AddFar(hull.dipoles.data[entry.node], entry.lanes);
    if (near == 0) continue;
    const HullNode& node = hull.nodes.data[entry.node];
    if (node.right >= 0) {
      stack[size++] = {node.right, near};
      stack[size++] = {entry.node + 1, near};
      continue;
    }
    for (int32_t i = node.begin; i < node.end; ++i) {
      const HullTriangle& t = hull.triangles.data[i];
      for (uint32_t left = near; left != 0; left &= left - 1) {
        const int lane = LowestBit(left);
        walkers.Add(lane, SolidAngle(points[lane], t.a, t.b, t.c));
      }
    }
  }
  for (int lane = 0; lane < kLanes; ++lane) solid_angle[lane] = walkers.SumOf(lane);
}

}  // namespace

std::array<double, kPointsAtOnce> WindingNumbers(const HullView& hull, const Vec3d* points,
                                                 int count) {
  std::array<double, kPointsAtOnce> winding{};
  if (count == 0 || hull.nodes.empty()) return winding;
  // Those whose crossings do not tell.
  std::array<Vec3d, kPointsAtOnce> asked;
  std::array<int, kPointsAtOnce> index_of_asked;
  int asked_count = 0;
  for (int i = 0; i < count; ++i) {
    int32_t crossings = 0;
    if (hull.CountCrossings(points[i], crossings)) {
      winding[i] = crossings;
    } else {
      asked[asked_count] = points[i];
      index_of_asked[asked_count++] = i;
    }
  }
  // Lanes are worth it from a few points on.
  constexpr int kFewestForLanes = 3;
  if (asked_count < kFewestForLanes) {
    for (int k = 0; k < asked_count; ++k) {
      winding[index_of_asked[k]] = hull.WindingBySolidAngles(asked[k]);
    }
    return winding;
  }
  std::array<double, kPointsAtOnce> solid_angle;
  RunInLanes(
      [&](auto lanes) { Walk<lanes()>(hull, asked.data(), asked_count, solid_angle.data()); });
  for (int k = 0; k < asked_count; ++k) {
    winding[index_of_asked[k]] = solid_angle[k] / (4 * std::numbers::pi);
  }
  return winding;
}

}  // namespace amhex
