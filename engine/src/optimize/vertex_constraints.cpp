#include "optimize/vertex_constraints.h"

#include <algorithm>
#include <tuple>
#include <vector>

#include "base/loop_polling.h"
#include "geometry/own_side_of_gap.h"
#include "input/sharp_features.h"

namespace amhex {
namespace {

// How far, in edge lengths, a vertex may be from the crease or corner it is assigned to.
constexpr double kCreaseReach = 0.8;
constexpr double kFadingCreaseReach = 0.5;
constexpr double kCornerReach = 1.1;
// A face lies on the hull's nearest patch if their normals agree this well (cosine); otherwise
// adjacent patches compete.
constexpr double kPlainAgreement = 0.7;
// Edge lengths of distance that a full disagreement of normals is worth in that competition.
constexpr double kNormalWeight = 1.0;
// Hull faces on both sides of a crease that fades out inside a patch: their normals differ by more
// than about 25 degrees.
constexpr double kFadingCreaseCosine = 0.9;

// A face between two sides that meet in an acute ridge, and looks ahead between them rather than to
// either, is the blunt end of cells that stop that far before it, in edge lengths. Where rows as
// thin as hairs end a face is soon turned by a quarter of a right angle: one taken for a side's
// would be tied to the ridge, and the rows crumple.
constexpr double kBluntReach = 0.3;
constexpr double kBeyondBlunted = 0.2;  // and so much before where those at a tip end
constexpr double kTipAgreement = 0.6;   // cosine: sides of an acute tip have less than 0.43

using PatchList = std::vector<int32_t>;

// Faces and vertices for one thread at a time.
constexpr size_t kConstrainedAtOnce = 256;

Vec3d FaceNormal(const CellFace& face, const std::vector<Vec3d>& vertices) {
  const Vec3d &a = vertices[face.v[0]], &b = vertices[face.v[1]], &c = vertices[face.v[2]];
  if (face.count == 3) return Normalized(Cross(b - a, c - a));
  return Normalized(Cross(c - a, vertices[face.v[3]] - b));
}

Vec3d FaceMiddle(const CellFace& face, const std::vector<Vec3d>& vertices) {
  Vec3d sum;
  for (int j = 0; j < face.count; ++j) sum += vertices[face.v[j]];
  return sum / static_cast<double>(face.count);
}

// The same before an acute tip.
bool IsBluntTip(const Vec3d& middle, const Vec3d& face_normal, const HullFeatures& features) {
  const std::vector<AcuteTip>& tips = features.tips();
  return std::any_of(tips.begin(), tips.end(), [&](const AcuteTip& tip) {
    return Norm(middle - tip.apex) < tip.blunted + kBeyondBlunted &&
           Dot(face_normal, tip.outward) > kTipAgreement;
  });
}

// `nearest` is the hull's closest point to the face's middle.
bool IsBluntEnd(const Vec3d& middle, const Vec3d& face_normal, const HullPoint& nearest,
                const HullFeatures& features) {
  if (nearest.distance > kBluntReach) return false;
  const std::vector<int32_t>& adjacent =
      features.AdjacentPatches(features.PatchOf(nearest.triangle));
  return std::any_of(adjacent.begin(), adjacent.end(), [&](int32_t other) {
    const HullPoint across = features.ClosestOnPatch(other, middle);
    if (across.distance > kBluntReach) return false;
    if (Dot(nearest.normal, across.normal) >= kAcuteRidgeCosine) return false;
    const double ahead = Dot(face_normal, Normalized(nearest.normal + across.normal));
    return ahead > Dot(face_normal, nearest.normal) && ahead > Dot(face_normal, across.normal);
  });
}

// The closest point of the hull; where that looks against the face, of the side that the face is
// on: across a gap thinner than a cell the other side may be the nearer one.
HullPoint ClosestOnOwnSide(const Vec3d& middle, const Vec3d& face_normal,
                           const HullFeatures& features) {
  constexpr double kExtent = 1;  // of the face's cell, edge lengths
  const HullPoint nearest = features.Closest(middle);
  if (Dot(nearest.normal, face_normal) > OwnSideOfGap::kOtherSide) return nearest;
  const HullPoint own = OwnSideOfGap::ClosestTo(features.view().hull, middle, face_normal, kExtent);
  return own.triangle >= 0 ? own : nearest;
}

// True if the face is a blunt end, which lies on no patch.
bool LocateFace(const CellFace& face, const std::vector<Vec3d>& vertices,
                const HullFeatures& features, int32_t& patch, Vec3d& normal) {
  const Vec3d middle = FaceMiddle(face, vertices);
  const Vec3d face_normal = FaceNormal(face, vertices);
  const HullPoint nearest = ClosestOnOwnSide(middle, face_normal, features);
  patch = features.PatchOf(nearest.triangle);
  normal = nearest.normal;
  const double agreement = Dot(face_normal, normal);
  if (agreement >= kPlainAgreement) return false;
  if (IsBluntTip(middle, face_normal, features) ||
      IsBluntEnd(middle, face_normal, nearest, features)) {
    normal = face_normal;
    return true;
  }
  double best = nearest.distance + kNormalWeight * (1 - agreement);
  for (const int32_t other : features.AdjacentPatches(patch)) {
    const HullPoint hit = features.ClosestOnPatch(other, middle);
    const double cost = hit.distance + kNormalWeight * (1 - Dot(face_normal, hit.normal));
    if (cost < best) best = cost, patch = other, normal = hit.normal;
  }
  return false;
}

struct VertexPatches {
  PatchList patches;  // ascending
  bool at_blunt_end = false;
};

// Of its faces but the blunt ends.
VertexPatches PatchesAt(int32_t vertex, const VertexNeighbourhoods& neighbourhoods,
                        const std::vector<int32_t>& face_patch,
                        const std::vector<uint8_t>& is_blunt) {
  VertexPatches at;
  PatchList& patches = at.patches;
  for (const int32_t f : neighbourhoods.hull_faces[vertex]) {
    if (is_blunt[f] != 0) at.at_blunt_end = true;
    if (is_blunt[f] == 0) patches.push_back(face_patch[f]);
  }
  std::sort(patches.begin(), patches.end());
  patches.erase(std::unique(patches.begin(), patches.end()), patches.end());
  return at;
}

VertexConstraint NearestPatch(const PatchList& patches, const Vec3d& p,
                              const HullFeatures& features) {
  VertexConstraint constraint{Constraint::kPatch, patches[0], -1, -1};
  double best = 1e300;
  for (const int32_t patch : patches) {
    const double distance = features.ClosestOnPatch(patch, p).distance;
    if (distance < best) best = distance, constraint.patch_a = patch;
  }
  return constraint;
}

VertexConstraint NearestCrease(const PatchList& patches, const Vec3d& p,
                               const HullFeatures& features) {
  VertexConstraint constraint;
  double best = kCreaseReach;
  for (size_t i = 0; i < patches.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const auto hit = features.ClosestOnCrease(patches[j], patches[i], p, best);
      if (!hit.has_value()) continue;
      best = hit->distance;
      constraint = {Constraint::kCrease, patches[j], patches[i], -1};
    }
  }
  return constraint.kind == Constraint::kFree ? NearestPatch(patches, p, features) : constraint;
}

// True if some two hull faces at the vertex differ in normal as across a crease.
bool FacesBend(int32_t vertex, const VertexNeighbourhoods& neighbourhoods,
               const std::vector<Vec3d>& own_normals) {
  const auto row = neighbourhoods.hull_faces[vertex];
  for (const int32_t a : row) {
    for (const int32_t b : row) {
      if (Dot(own_normals[a], own_normals[b]) < kFadingCreaseCosine) return true;
    }
  }
  return false;
}

struct CornerClaim {
  int missing;  // patches of the corner that the vertex has no face on
  double distance;
  int32_t corner, vertex;
};

// Both lists ascending.
int CountMissing(const PatchList& wanted, const PatchList& present) {
  int missing = 0;
  for (const int32_t patch : wanted) {
    missing += !std::binary_search(present.begin(), present.end(), patch);
  }
  return missing;
}

// Every corner takes the nearest vertex whose faces lie on all, or all but one, of its patches. At
// the end of a ridge that cells stop before, that is one of a blunt end, which stays where it is.
void AssignCorners(const std::vector<Vec3d>& vertices, const std::vector<VertexPatches>& patches_of,
                   const std::vector<int32_t>& hull_vertices, const HullFeatures& features,
                   std::vector<VertexConstraint>& constraints) {
  std::vector<CornerClaim> claims;
  std::vector<std::vector<int32_t>> corners_of_patch(features.patch_count());
  for (size_t c = 0; c < features.corners().size(); ++c) {
    for (const int32_t patch : features.corners()[c].patches) {
      corners_of_patch[patch].push_back(static_cast<int32_t>(c));
    }
  }
  for (const int32_t v : hull_vertices) {
    const PatchList& own = patches_of[v].patches;
    if (own.size() < 2) continue;
    for (const int32_t patch : own) {
      for (const int32_t c : corners_of_patch[patch]) {
        const HullCorner& corner = features.corners()[c];
        const double distance = Norm(corner.position - vertices[v]);
        if (distance > kCornerReach) continue;
        const int missing = CountMissing(corner.patches, own);
        if (missing <= 1) claims.push_back({missing, distance, c, v});
      }
    }
  }
  std::sort(claims.begin(), claims.end(), [](const CornerClaim& a, const CornerClaim& b) {
    return std::tie(a.missing, a.distance, a.corner, a.vertex) <
           std::tie(b.missing, b.distance, b.corner, b.vertex);
  });
  std::vector<uint8_t> owned(features.corners().size(), 0);
  for (const CornerClaim& claim : claims) {
    VertexConstraint& constraint = constraints[claim.vertex];
    if (owned[claim.corner] || constraint.kind == Constraint::kCorner) continue;
    owned[claim.corner] = 1;
    if (patches_of[claim.vertex].at_blunt_end) continue;
    constraint.kind = Constraint::kCorner;
    constraint.corner = claim.corner;
  }
}

}  // namespace

VertexConstraints AssignConstraints(const CellComplex& complex,
                                    const VertexNeighbourhoods& neighbourhoods,
                                    const HullFeatures& features, const StopPoll& poll) {
  VertexConstraints result;
  const size_t face_count = complex.hull_faces.size();
  result.face_patch.resize(face_count);
  result.face_normal.resize(face_count);
  std::vector<Vec3d> own_normals(face_count);
  std::vector<uint8_t> is_blunt(face_count);
  ForAllPolling(face_count, kConstrainedAtOnce, poll, [&](size_t f) {
    own_normals[f] = FaceNormal(complex.hull_faces[f], complex.vertices);
    is_blunt[f] = LocateFace(complex.hull_faces[f], complex.vertices, features,
                             result.face_patch[f], result.face_normal[f]);
  });
  result.vertex.resize(complex.vertices.size());
  std::vector<VertexPatches> patches_of(complex.vertices.size());
  std::vector<int32_t> hull_vertices;
  for (size_t v = 0; v < complex.vertices.size(); ++v) {
    if (neighbourhoods.hull_faces[static_cast<int64_t>(v)].size() == 0) continue;
    hull_vertices.push_back(static_cast<int32_t>(v));
  }
  ForAllPolling(hull_vertices.size(), kConstrainedAtOnce, poll, [&](size_t i) {
    const int32_t v = hull_vertices[i];
    patches_of[v] = PatchesAt(v, neighbourhoods, result.face_patch, is_blunt);
    const PatchList& patches = patches_of[v].patches;
    const Vec3d& p = complex.vertices[v];
    if (patches.empty()) {  // inside a blunt end, where two rows end: between their sides
      result.vertex[v].kind = Constraint::kFixed;
      return;
    }
    if (patches.size() > 1) {
      result.vertex[v] = NearestCrease(patches, p, features);
      return;
    }
    const int32_t patch = patches[0];
    result.vertex[v] = {Constraint::kPatch, patch, -1, -1};
    if (features.ClosestOnCrease(patch, patch, p, kFadingCreaseReach).has_value() &&
        FacesBend(v, neighbourhoods, own_normals)) {
      result.vertex[v] = {Constraint::kCrease, patch, patch, -1};
    }
  });
  AssignCorners(complex.vertices, patches_of, hull_vertices, features, result.vertex);
  return result;
}

VertexConstraint Weakened(const VertexConstraint& constraint, const Vec3d& p,
                          const HullFeatures& features) {
  if (constraint.kind == Constraint::kCorner && constraint.patch_b >= 0) {
    return {Constraint::kCrease, constraint.patch_a, constraint.patch_b, -1};
  }
  if (constraint.kind == Constraint::kCorner || constraint.kind == Constraint::kCrease) {
    PatchList patches = {constraint.patch_a};
    if (constraint.patch_b >= 0) patches.push_back(constraint.patch_b);
    return NearestPatch(patches, p, features);
  }
  return constraint;
}

}  // namespace amhex
