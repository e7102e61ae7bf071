#include "optimize/hexahedra_in_lanes.h"

#include "optimize/energy_lanes.h"
#include "optimize/fold_margin_lanes.h"

namespace amhex {
namespace {

// A hexahedron as seen from the vertex at one of its slots: the edges of the corner there, in its
// order, and the corner at the far end of each.
struct SeenFromSlot {
  double own_sign;
  std::array<uint8_t, 3> far_slot;
  // The edges that follow the one to the vertex around the far corner, and their sign.
  std::array<uint8_t, 3> next, after;
  std::array<double, 3> far_sign;
  // Which of the three it is whose far corner the pattern lists first, second, third.
  std::array<int64_t, 3> in_order;
  int64_t moved_corners;  // bits
};

SeenFromSlot SeeFrom(const CellPattern& hexahedron, int slot) {
  SeenFromSlot seen{};
  const CellPattern::Corner& own = hexahedron.corner[slot];
  seen.own_sign = own.sign;
  seen.moved_corners = hexahedron.corners_at[slot];
  int listed = 0;
  for (int i = 0; i < hexahedron.corner_count; ++i) {
    if (i == slot || (seen.moved_corners >> i & 1) == 0) continue;
    const CellPattern::Corner& far = hexahedron.corner[i];
    for (int o = 0; o < 3; ++o) {
      const int e = own.edge[o];
      const bool leads_away = hexahedron.edge_slots[e][0] == slot;
      if (hexahedron.edge_slots[e][leads_away ? 1 : 0] != i) continue;
      const int at = far.edge[0] == e ? 0 : (far.edge[1] == e ? 1 : 2);
      seen.far_slot[o] = static_cast<uint8_t>(i);
      seen.next[o] = far.edge[(at + 1) % 3];
      seen.after[o] = far.edge[(at + 2) % 3];
      seen.far_sign[o] = leads_away ? far.sign : -far.sign;
      seen.own_sign *= leads_away ? 1 : -1;
      seen.in_order[listed++] = o;
    }
  }
  return seen;
}

// Corner i of the pattern of a hexahedron is that at slot i.
std::array<SeenFromSlot, 8> SeeFromAll(const CellPattern& hexahedron) {
  std::array<SeenFromSlot, 8> seen;
  for (int slot = 0; slot < 8; ++slot) seen[slot] = SeeFrom(hexahedron, slot);
  return seen;
}

const SeenFromSlot& SeenFrom(const CellPattern& hexahedron, int slot) {
  static const std::array<SeenFromSlot, 8> kSeen = SeeFromAll(hexahedron);
  return kSeen[slot];
}

}  // namespace

void HexahedraInLanes::Add(const PlacementView& placement, int32_t vertex, int32_t cell) {
  const int lane = count_++;
  pattern_ = &placement.PatternOf(cell);
  const CellCorners& corners = placement.cells[cell];
  for (int slot = 0; slot < 8; ++slot) {
    corner_[slot].Set(lane, placement.vertices[corners[slot]]);
    if (corners[slot] == vertex) slot_[lane] = slot;
  }
}

void HexahedraInLanes::Settle() {
  // Lanes without a cell repeat the first one's and are never looked at.
  for (int lane = count_; lane < kWidth; ++lane) {
    slot_[lane] = slot_[0];
    for (Vectors& corner : corner_) corner.Set(lane, corner.At(0));
  }
  for (int lane = 0; lane < kWidth; ++lane) {
    const SeenFromSlot& seen = SeenFrom(*pattern_, slot_[lane]);
    own_sign_[lane] = seen.own_sign;
    for (int o = 0; o < 3; ++o) {
      far_end_[o].Set(lane, corner_[seen.far_slot[o]].At(lane));
      edge_in_order_[o][lane] = seen.in_order[o];
    }
  }
  RunWithWidestVectors([this] { SettleInLanes(); });
}

inline void HexahedraInLanes::SettleInLanes() {
  std::array<Vectors, 12> direction;
  for (int e = 0; e < 12; ++e) {
    const auto& slots = pattern_->edge_slots[e];
    const Vectors along = corner_[slots[1]] - corner_[slots[0]];
    const Numbers length = SquareRoot(along.Dot(along));
    const HalfMask is_long = length > 0;
    direction[e] = {is_long ? along.x / length : along.x, is_long ? along.y / length : along.y,
                    is_long ? along.z / length : along.z};
  }
  HalfMask moved_corners;
  std::array<Vectors, 3> next, after;
  Numbers far_sign[3];
  for (int lane = 0; lane < kWidth; ++lane) {
    const SeenFromSlot& seen = SeenFrom(*pattern_, slot_[lane]);
    moved_corners[lane] = seen.moved_corners;
    for (int o = 0; o < 3; ++o) {
      next[o].Set(lane, direction[seen.next[o]].At(lane));
      after[o].Set(lane, direction[seen.after[o]].At(lane));
      far_sign[o][lane] = seen.far_sign[o];
    }
  }
  for (int o = 0; o < 3; ++o) far_normal_[o] = next[o].Cross(after[o]) * far_sign[o];
  fixed_minimum_ = Numbers{} + 1;
  fixed_deficits_ = Numbers{};
  for (int i = 0; i < 8; ++i) {
    const CellPattern::Corner& corner = pattern_->corner[i];
    const Numbers jacobian =
        corner.sign * Determinant(direction[corner.edge[0]], direction[corner.edge[1]],
                                  direction[corner.edge[2]]);
    const HalfMask is_fixed = (moved_corners >> i & 1) == 0;
    fixed_minimum_ = (is_fixed & (jacobian < fixed_minimum_)) ? jacobian : fixed_minimum_;
    const Numbers power = SquaredTimes(1 - jacobian, penalty_.sharpness);
    fixed_deficits_ = is_fixed ? fixed_deficits_ + power : fixed_deficits_;
  }
}

// Of what there is at the far ends of the own corner's edges, the i-th in the order of the pattern.
AMHEX_LANES_INLINE HexahedraInLanes::Numbers HexahedraInLanes::InOrder(int i, const Numbers& a,
                                                                       const Numbers& b,
                                                                       const Numbers& c) const {
  const Numbers b_or_c = edge_in_order_[i] == 1 ? b : c;
  return edge_in_order_[i] == 0 ? a : b_or_c;
}
AMHEX_LANES_INLINE HexahedraInLanes::Vectors HexahedraInLanes::InOrder(int i, const Vectors& a,
                                                                       const Vectors& b,
                                                                       const Vectors& c) const {
  return {InOrder(i, a.x, b.x, c.x), InOrder(i, a.y, b.y, c.y), InOrder(i, a.z, b.z, c.z)};
}

void HexahedraInLanes::Score(const Vec3d& position) {
  RunWithWidestVectors([&] { ScoreInLanes(position); });
}

inline void HexahedraInLanes::ScoreInLanes(const Vec3d& position) {
  Numbers far[3];
  for (int o = 0; o < 3; ++o) {
    const Vectors along = far_end_[o].From(position);
    const Numbers length = SquareRoot(along.Dot(along));
    edge_[o].inverse_length = length > 0 ? 1 / length : Numbers{};
    edge_[o].direction = along * edge_[o].inverse_length;
    far[o] = far_normal_[o].Dot(edge_[o].direction);
  }
  for (int i = 0; i < 3; ++i) jacobian_[i] = InOrder(i, far[0], far[1], far[2]);
  jacobian_[3] =
      own_sign_ * Determinant(edge_[0].direction, edge_[1].direction, edge_[2].direction);
  minimum_ = fixed_minimum_;
  deficits_ = fixed_deficits_;
  for (int i = 0; i < kMoved; ++i) {
    const Numbers& jacobian = jacobian_[i];
    // As for single cells, not-a-number lowers the minimum too.
    const Numbers lower = jacobian != jacobian ? Numbers{} - 1 : jacobian;
    minimum_ = jacobian >= minimum_ ? minimum_ : lower;
    if (penalty_.kind == EnergyKind::kMinima) {
      deficits_ += SquaredTimes(1 - jacobian, penalty_.sharpness);
    } else {
      energy_[i] = CornerEnergy(jacobian, penalty_);
    }
  }
  if (penalty_.kind == EnergyKind::kMinima) energy_[0] = RootedTimes(deficits_, penalty_.sharpness);
}

double HexahedraInLanes::WorstFoldMargin(const Vec3d& position) const {
  double worst = 0;
  RunWithWidestVectors([&] { worst = MarginInLanes(position); });
  return worst;
}

inline double HexahedraInLanes::MarginInLanes(const Vec3d& position) const {
  FourCells corner = corner_;
  for (int lane = 0; lane < kWidth; ++lane) corner[slot_[lane]].Set(lane, position);
  const Numbers margin = FoldMarginsOf(*pattern_, corner);
  double worst = 1;
  for (int lane = 0; lane < kWidth; ++lane) worst = margin[lane] < worst ? margin[lane] : worst;
  return worst;
}

void HexahedraInLanes::Model() {
  if (penalty_.kind == EnergyKind::kMinima) {
    RunWithWidestVectors([this] { ModelOfMinima(); });
  } else {
    RunWithWidestVectors([this] { ModelOfCorners(); });
  }
}

AMHEX_LANES_INLINE CornerModel<HexahedraInLanes::Vectors> HexahedraInLanes::ModelOf(
    int corner) const {
  if (corner == 3) return {own_sign_, edge_[0], edge_[1], edge_[2]};
  const auto& [a, b, c] = edge_;
  const Edge edge{InOrder(corner, a.direction, b.direction, c.direction),
                  InOrder(corner, a.inverse_length, b.inverse_length, c.inverse_length)};
  return {InOrder(corner, far_normal_[0], far_normal_[1], far_normal_[2]), edge};
}

inline void HexahedraInLanes::ModelOfCorners() {
  for (int i = 0; i < kMoved; ++i) {
    const SlopeLanes slopes = CornerSlopes(jacobian_[i], penalty_);
    model_[i] = ModelLanes{};
    ModelOf(i).AddTo(model_[i], slopes.first, slopes.second);
  }
}

// As LocalCells::AddMinimum.
inline void HexahedraInLanes::ModelOfMinima() {
  constexpr double kPerfect = 1e-6;
  constexpr double kNegligibleShare = 1e-30;
  const Numbers bound = RootedTimes(deficits_, penalty_.sharpness);
  const Numbers curve = ((1 << penalty_.sharpness) - 1) / bound;
  ModelLanes own{};
  for (int i = 0; i < kMoved; ++i) {
    const Numbers share = (1 - jacobian_[i]) / bound;
    const Numbers power = SquaredTimes(share, penalty_.sharpness);
    const HalfMask counts = power > kNegligibleShare;
    const Numbers slope = power / share;
    ModelLanes sum = own;
    ModelOf(i).AddTo(sum, -slope, curve * (slope / share));
    const auto keep = [&](Vectors& kept, const Vectors& with) {
      for (int a = 0; a < 3; ++a) kept[a] = counts ? with[a] : kept[a];
    };
    keep(own.gradient, sum.gradient);
    for (int a = 0; a < 3; ++a) keep(own.hessian[a], sum.hessian[a]);
  }
  const HalfMask is_imperfect = bound > kPerfect;
  const auto part = [&](const Vectors& of) {
    Vectors kept;
    for (int a = 0; a < 3; ++a) kept[a] = is_imperfect ? of[a] : Numbers{};
    return kept;
  };
  for (int a = 0; a < 3; ++a) {
    const Numbers steep = curve * own.gradient[a];
    model_[0].hessian[a] = part(own.hessian[a] - own.gradient * steep);
  }
  model_[0].gradient = part(own.gradient);
}

void HexahedraInLanes::AddModel(int lane, EnergyModel& model) const {
  for (int i = 0; i < ParcelCount(); ++i) {
    model.gradient += model_[i].gradient.At(lane);
    for (int a = 0; a < 3; ++a) model.hessian[a] += model_[i].hessian[a].At(lane);
  }
}

}  // namespace amhex
