#include "optimize/joint_place.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/sort_unique.h"
#include "optimize/constrain.h"
#include "optimize/move_judge.h"
#include "optimize/survey_cell.h"

namespace amhex {
namespace {

constexpr double kLongestMove = 0.2;  // of a vertex at once, edge lengths
// More corners are not fitted at once; those that lack most are. Likewise of what is guarded.
constexpr size_t kMostRows = 300;
// Corners this far above what is wanted may come to lack by a step, so the fit sees them.
constexpr double kSeenAbove = 0.15;
// What moves of single vertices may do as well (move_judge): how far the corners of hull faces may
// turn from the hull (cosine), and how far from it their middles may be.
constexpr double kMinNormalAgreement = 0.3;
constexpr double kFreeSag = 0.14;
// What must not be broken is fitted too where it is near: by so much more than need be, and with
// such a weight, that what a step leaves of it does not break it.
struct Guard {
  double near;
  double margin;
  double weight;
};
constexpr Guard kJacobianGuard = {0.1, 0.002, 10};
constexpr Guard kSagGuard = {0.1, 0.004, 10};  // edge lengths
constexpr Guard kAgreementGuard = {0.3, 0.01, 10};
constexpr Guard kFoldGuard = {kNearFolding, 0.002, 20};
// A few guards weigh little against many corners and distances, and a shorter step breaks them
// by less, but breaks them. Each time that guards are to hold more firmly they weigh so much more.
constexpr double kFirmer = 8;
constexpr double kMostFirmness = 64;
constexpr double kStuckShare = 1e-3;      // of a move that is wanted, done: it is not moved at all
constexpr double kDifferenceStep = 1e-5;  // edge lengths

void Append(ArrayView<const int32_t> items, std::vector<int32_t>* list) {
  list->insert(list->end(), items.data, items.data + items.size);
}

void KeepWorst(std::vector<HingeRow>* rows) {
  std::stable_sort(rows->begin(), rows->end(),
                   [](const HingeRow& a, const HingeRow& b) { return a.lack > b.lack; });
  if (rows->size() > kMostRows) rows->resize(kMostRows);
}

}  // namespace

JointPlace::JointPlace(Placement& placement)
    : view_(ViewOf(placement)), point_of_(static_cast<size_t>(view_.vertices.size), -1) {}

JointPlace::Extent JointPlace::ExtentOf(const std::vector<int32_t>& poor) {
  Collect(poor);
  Extent extent{moving_, Seen()};
  Forget();
  return extent;
}

void JointPlace::Enter(const std::vector<int32_t>& poor) {
  is_loose_ = false;
  Collect(poor);
  start_ = Judge(0);
}

void JointPlace::EnterLoosely(const std::vector<int32_t>& cells, double floor) {
  is_loose_ = true;
  Collect(cells);
  faces_.clear();
  start_ = Judge(0);
  start_.least = std::min(start_.least, floor);
}

bool JointPlace::GuardMoreFirmly() {
  if (firmness_ >= kMostFirmness) return false;
  firmness_ *= kFirmer;
  return true;
}

void JointPlace::Collect(const std::vector<int32_t>& poor) {
  firmness_ = 1;
  std::vector<int32_t> vertices;
  const auto add_vertices_of = [&](int64_t c) {
    vertices.insert(vertices.end(), view_.cells[c].begin(), view_.cells[c].end());
  };
  for (const int32_t c : poor) add_vertices_of(c);
  SortUnique(vertices);
  for (size_t i = 0, count = vertices.size(); i < count; ++i) {
    const ArrayView<const int32_t> cells = view_.cells_at[vertices[i]];
    for (int64_t k = 0; k < cells.size; ++k) add_vertices_of(cells[k]);
  }
  SortUnique(vertices);
  moving_.clear(), cells_.clear(), faces_.clear();
  for (const int32_t v : vertices) {
    const Constraint kind = view_.constraints[v].kind;
    if (kind == Constraint::kFixed || kind == Constraint::kCorner) continue;
    point_of_[v] = static_cast<int32_t>(moving_.size());
    moving_.push_back(v);
    Append(view_.cells_at[v], &cells_);
    Append(view_.hull_faces_at[v], &faces_);
  }
  SortUnique(cells_);
  SortUnique(faces_);
}

// Where it may be; anywhere if it may leave the hull.
VertexConstraint JointPlace::ConstraintOf(int32_t vertex) const {
  const VertexConstraint& constraint = view_.constraints[vertex];
  if (!is_loose_) return constraint;
  const bool is_on_crease = constraint.kind == Constraint::kCrease &&
                            Norm(FootOf(view_, vertex).point - view_.vertices[vertex]) < kOnFeature;
  return is_on_crease ? constraint : VertexConstraint();
}

void JointPlace::Leave() {
  for (const int32_t c : cells_) SurveyCell(view_, c);
  Forget();
}

void JointPlace::Forget() {
  for (const int32_t v : moving_) point_of_[v] = -1;
}

PlaceJudgement JointPlace::Judge(double wanted) const {
  PlaceJudgement result;
  for (const int32_t c : cells_) {
    const CellPattern& pattern = view_.PatternOf(c);
    const CellPositions positions = PositionsOf(c);
    CornerJacobians jacobians;
    ScaledJacobians(pattern, positions, jacobians);
    for (int i = 0; i < pattern.corner_count; ++i) {
      const double jacobian = std::isfinite(jacobians[i]) ? jacobians[i] : -1.0;
      const double lack = std::max(0.0, wanted - jacobian);
      result.lack += lack * lack;
      result.least = std::min(result.least, jacobian);
    }
    result.fold_margin.push_back(FoldMargin(pattern, positions));
  }
  for (const int32_t v : moving_) {
    result.agreement.push_back(WorstNormalAgreement(view_, v, view_.vertices[v]));
  }
  const HullView& hull = view_.features.hull;
  for (const int32_t f : faces_) {
    const Vec3d middle = MiddleOf(f);
    result.sag.push_back(hull.IsWithin(middle, kFreeSag) ? 0 : hull.Closest(middle).distance);
  }
  return result;
}

double JointPlace::LackOfCells() const {
  double lack = 0;
  for (const int32_t c : cells_) {
    const CellPattern& pattern = view_.PatternOf(c);
    CornerJacobians jacobians;
    ScaledJacobians(pattern, PositionsOf(c), jacobians);
    lack += 1 - *std::min_element(jacobians.begin(), jacobians.begin() + pattern.corner_count);
  }
  return lack;
}

bool JointPlace::IsPermitted(const PlaceJudgement& then) const {
  if (then.least < start_.least) return false;
  for (size_t i = 0; i < cells_.size(); ++i) {
    if (then.fold_margin[i] <= 0 && then.fold_margin[i] < start_.fold_margin[i]) return false;
  }
  for (size_t i = 0; i < moving_.size(); ++i) {
    if (then.agreement[i] < LeastAgreement(i)) return false;
  }
  for (size_t i = 0; i < faces_.size(); ++i) {
    if (then.sag[i] > start_.sag[i]) return false;
  }
  return true;
}

double JointPlace::LeastAgreement(size_t vertex) const {
  return std::min(kMinNormalAgreement, start_.agreement[vertex]);
}

Vec3d JointPlace::MiddleOf(int32_t face) const {
  constexpr int32_t kNoVertex = -1;
  return MiddleOfFace(view_, face, kNoVertex, {});
}

CellPositions JointPlace::PositionsOf(int32_t cell) const {
  CellPositions positions;
  for (int slot = 0; slot < 8; ++slot) positions[slot] = view_.vertices[view_.cells[cell][slot]];
  return positions;
}

std::vector<int32_t> JointPlace::Seen() const {
  std::vector<int32_t> seen;
  for (const int32_t c : cells_) {
    seen.insert(seen.end(), view_.cells[c].begin(), view_.cells[c].end());
  }
  SortUnique(seen);
  return seen;
}

std::vector<Vec3d> JointPlace::Positions() const {
  std::vector<Vec3d> positions;
  for (const int32_t v : moving_) positions.push_back(view_.vertices[v]);
  return positions;
}

void JointPlace::MoveBack(const std::vector<Vec3d>& positions) {
  for (size_t i = 0; i < moving_.size(); ++i) view_.vertices[moving_[i]] = positions[i];
}

HingeFit JointPlace::FitHere(const PlaceJudgement& now, double wanted,
                             const std::vector<VertexRow>& others) {
  freedoms_.clear();
  for (const int32_t v : moving_) {
    const Vec3d& p = view_.vertices[v];
    const VertexConstraint constraint = ConstraintOf(v);
    const ConstrainedPoint at =
        constraint.kind == Constraint::kFree ? ConstrainedPoint{p, {}, {}} : FootOf(view_, v);
    freedoms_.push_back({constraint, AxesAt(constraint, at), at.point, p - at.point});
  }
  Rows rows, guards;
  for (const int32_t c : cells_) AppendCorners(c, wanted, &rows, &guards);
  for (size_t i = 0; i < cells_.size(); ++i) {
    if (now.fold_margin[i] < LeastMargin(i) + kFoldGuard.near) {
      AppendFoldGuard(cells_[i], now.fold_margin[i], LeastMargin(i), &guards);
    }
  }
  for (size_t i = 0; i < moving_.size(); ++i) {
    if (now.agreement[i] < LeastAgreement(i) + kAgreementGuard.near) {
      AppendAgreementGuard(moving_[i], now.agreement[i], LeastAgreement(i), &guards);
    }
  }
  for (size_t i = 0; i < faces_.size(); ++i) {
    AppendSagGuard(faces_[i], std::max(kFreeSag, start_.sag[i]), &guards);
  }
  KeepWorst(&rows);
  KeepWorst(&guards);
  for (HingeRow& guard : guards) {
    guard.lack *= firmness_;
    for (HingeRow::Slope& slope : guard.slopes) slope.fall *= firmness_;
  }
  for (const VertexRow& other : others) {
    guards.push_back({other.lack, {}});
    for (const VertexRow::Slope& slope : other.slopes) {
      AppendSlope(slope.vertex, slope.fall, &guards.back());
    }
  }
  rows.insert(rows.end(), guards.begin(), guards.end());
  return HingeFit(std::move(rows), static_cast<int64_t>(moving_.size()));
}

void JointPlace::AppendCorners(int32_t c, double wanted, Rows* rows, Rows* guards) const {
  const CellPattern& pattern = view_.PatternOf(c);
  const CellPositions positions = PositionsOf(c);
  std::array<Vec3d, 12> direction;
  std::array<double, 12> inverse_length;
  for (int e = 0; e < pattern.edge_count; ++e) {
    const auto& slots = pattern.edge_slots[e];
    const Vec3d along = positions[slots[1]] - positions[slots[0]];
    const double length = Norm(along);
    inverse_length[e] = length > 0 ? 1 / length : 0.0;
    direction[e] = along * inverse_length[e];
  }
  for (int i = 0; i < pattern.corner_count; ++i) {
    const CellPattern::Corner& corner = pattern.corner[i];
    const Vec3d &u = direction[corner.edge[0]], &v = direction[corner.edge[1]],
                &w = direction[corner.edge[2]];
    const std::array<Vec3d, 3> normal = {Cross(v, w) * corner.sign, Cross(w, u) * corner.sign,
                                         Cross(u, v) * corner.sign};
    const double jacobian = Dot(normal[0], u);
    if (!(jacobian < wanted + kSeenAbove)) continue;
    HingeRow& row = rows->emplace_back();
    row.lack = wanted - jacobian;
    Vec3d of_own;  // what the corner's own vertex does
    for (int k = 0; k < 3; ++k) {
      const int e = corner.edge[k];
      const auto& slots = pattern.edge_slots[e];
      const bool leads_away = view_.cells[c][slots[0]] == view_.cells[c][corner.slot];
      const Vec3d of_far = (normal[k] - direction[e] * jacobian) *
                           (leads_away ? inverse_length[e] : -inverse_length[e]);
      AppendSlope(view_.cells[c][slots[leads_away ? 1 : 0]], of_far, &row);
      of_own -= of_far;
    }
    AppendSlope(view_.cells[c][corner.slot], of_own, &row);
    if (jacobian >= start_.least + kJacobianGuard.near) continue;
    HingeRow& guard = guards->emplace_back(row);
    guard.lack = (start_.least + kJacobianGuard.margin - jacobian) * kJacobianGuard.weight;
    for (HingeRow::Slope& slope : guard.slopes) slope.fall = slope.fall * kJacobianGuard.weight;
  }
}

void JointPlace::AppendSagGuard(int32_t f, double most, Rows* rows) const {
  const CellFace& face = view_.hull_faces[f];
  const Vec3d middle = MiddleOf(f);
  if (view_.features.hull.IsWithin(middle, most - kSagGuard.near)) return;
  const HullPoint nearest = view_.features.hull.Closest(middle);
  const Vec3d away = Normalized(middle - nearest.point);
  HingeRow& row = rows->emplace_back();
  row.lack = (nearest.distance - most + kSagGuard.margin) * kSagGuard.weight;
  for (int j = 0; j < face.count; ++j) {
    AppendSlope(face.v[j], away * (-kSagGuard.weight / face.count), &row);
  }
}

void JointPlace::AppendAgreementGuard(int32_t v, double now, double least, Rows* rows) {
  HingeRow& row = rows->emplace_back();
  row.lack = (least + kAgreementGuard.margin - now) * kAgreementGuard.weight;
  std::vector<int32_t> corners;
  const ArrayView<const int32_t> faces = view_.hull_faces_at[v];
  for (int64_t k = 0; k < faces.size; ++k) {
    const CellFace& face = view_.hull_faces[faces[k]];
    corners.insert(corners.end(), face.v.begin(), face.v.begin() + face.count);
  }
  SortUnique(corners);
  AppendDifferences(corners, kAgreementGuard.weight, &row,
                    [&] { return WorstNormalAgreement(view_, v, view_.vertices[v]) - now; });
}

template <class Change>
void JointPlace::AppendDifferences(const std::vector<int32_t>& vertices, double weight,
                                   HingeRow* row, const Change& change) {
  for (const int32_t v : vertices) {
    if (point_of_[v] < 0) continue;
    const Vec3d here = view_.vertices[v];
    Vec3d slope;
    for (int a = 0; a < 3; ++a) {
      view_.vertices[v][a] += kDifferenceStep;
      slope[a] = change() / kDifferenceStep;
      view_.vertices[v] = here;
    }
    AppendSlope(v, slope * weight, row);
  }
}

void JointPlace::AppendFoldGuard(int32_t c, double now, double least, Rows* rows) {
  const CellPattern& pattern = view_.PatternOf(c);
  HingeRow& row = rows->emplace_back();
  row.lack = (least + kFoldGuard.margin - now) * kFoldGuard.weight;
  std::vector<int32_t> corners(view_.cells[c].begin(), view_.cells[c].end());
  SortUnique(corners);
  AppendDifferences(corners, kFoldGuard.weight, &row,
                    [&] { return FoldMargin(pattern, PositionsOf(c)) - now; });
}

void JointPlace::AppendSlope(int32_t vertex, const Vec3d& fall, HingeRow* row) const {
  const int32_t point = point_of_[vertex];
  if (point < 0) return;
  Vec3d open;
  const FreeAxes& axes = freedoms_[point].axes;
  for (int a = 0; a < axes.count; ++a) open += axes.axis[a] * Dot(axes.axis[a], fall);
  row->slopes.push_back({point, open});
}

void JointPlace::Move(const std::vector<Vec3d>& moves) {
  double longest = kLongestMove;
  for (const Vec3d& move : moves) longest = std::max(longest, Norm(move));
  for (size_t i = 0; i < moving_.size(); ++i) {
    const VertexConstraint& constraint = freedoms_[i].constraint;
    const Vec3d move = moves[i] * (kLongestMove / longest);
    Vec3d& vertex = view_.vertices[moving_[i]];
    if (constraint.kind == Constraint::kFree) {
      vertex += move;
      continue;
    }
    // As in VertexSearch: one that has not reached the hull keeps its offset.
    const Freedom& from = freedoms_[i];
    const Vec3d place =
        ConstrainFrom(constraint, vertex + move - from.offset, from.foot, view_.features).point +
        from.offset;
    // At the end of its crease a vertex stays. Rounding alone would fold cells that barely do not.
    if (Norm(place - vertex) > kStuckShare * Norm(move)) vertex = place;
  }
}

}  // namespace amhex
