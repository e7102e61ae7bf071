#include "optimize/hull_deviation.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "input/hull_queries.h"
#include "input/triangle_math.h"
#include "optimize/face_places.h"
#include "optimize/hull_samples.h"
#include "optimize/segment_queries.h"

namespace amhex {
namespace {

// What is wanted of a mesh: the larger of these.
constexpr double kShareOfDiagonal = 0.005;
constexpr double kShareOfEdge = 1.0 / 6.0;
constexpr double kFreeShare = 0.6;  // of the limit
constexpr double kBinSize = 1.0;
// Gaps this near to one another are the same.
constexpr double kSameGap = 0.4;
// Samples per task: some ten milliseconds at most.
constexpr size_t kSamplesPerBlock = 1024;

std::vector<Vec3d> MiddlesOf(const CellComplex& complex) {
  std::vector<Vec3d> middles;
  middles.reserve(complex.hull_faces.size());
  for (const CellFace& face : complex.hull_faces) {
    middles.push_back(MiddleOf(face, complex.vertices));
  }
  return middles;
}

// The corners, too: joint moves may take them off the hull.
std::vector<Vec3d> PlacesOf(const CellComplex& complex) {
  std::vector<Vec3d> places;
  std::vector<uint8_t> is_listed(complex.vertices.size(), 0);
  for (const CellFace& face : complex.hull_faces) {
    for (int j = 0; j < face.count; ++j) {
      if (std::exchange(is_listed[face.v[j]], uint8_t{1}) == 0) {
        places.push_back(complex.vertices[face.v[j]]);
      }
    }
    double longest = 0;
    for (int j = 0; j < face.count; ++j) {
      const Vec3d& next = complex.vertices[face.v[(j + 1) % face.count]];
      longest = std::max(longest, Norm(next - complex.vertices[face.v[j]]));
    }
    VisitFacePlaces(face.count, FaceDivisions(longest),
                    [&](const std::array<double, 4>& weight, int side) {
                      if (side >= 0 && face.v[side] > face.v[(side + 1) % face.count])
                        return;  // the next face's
                      Vec3d place;
                      for (int j = 0; j < face.count; ++j)
                        place += complex.vertices[face.v[j]] * weight[j];
                      places.push_back(place);
                    });
  }
  return places;
}

// Calls visit(a, b, c) for the triangles of a face, of a quad's around its middle.
template <class Visit>
void VisitTriangles(const Vec3d* corner, int count, const Visit& visit) {
  if (count == 3) return visit(corner[0], corner[1], corner[2]);
  const Vec3d middle = (corner[0] + corner[1] + corner[2] + corner[3]) / 4.0;
  for (int j = 0; j < 4; ++j) visit(corner[j], corner[(j + 1) % 4], middle);
}

struct FaceCorners {
  int count = 0;
  Vec3d corner[4];
};
FaceCorners CornersOf(const CellFace& face, const std::vector<Vec3d>& vertices) {
  FaceCorners corners{face.count, {}};
  for (int j = 0; j < face.count; ++j) corners.corner[j] = vertices[face.v[j]];
  return corners;
}

std::vector<Gap> WorstFirst(const std::vector<std::vector<Gap>>& parts) {
  std::vector<Gap> all;
  for (const std::vector<Gap>& part : parts) all.insert(all.end(), part.begin(), part.end());
  std::stable_sort(all.begin(), all.end(),
                   [](const Gap& a, const Gap& b) { return a.distance > b.distance; });
  return all;
}

}  // namespace

HullQueries BoundaryOf(const CellComplex& complex, const StopPoll& poll) {
  const std::vector<CellFace>& faces = complex.hull_faces;
  std::vector<size_t> first(faces.size() + 1, 0);  // triangle of each face
  for (size_t f = 0; f < faces.size(); ++f) {
    first[f + 1] = first[f] + (faces[f].count == 3 ? 1 : static_cast<size_t>(faces[f].count));
  }
  std::vector<Vec3d> vertices(3 * first.back());
  std::vector<std::array<int32_t, 3>> triangles(first.back());
  tbb::parallel_for(size_t{0}, faces.size(), [&](size_t f) {
    const FaceCorners corners = CornersOf(faces[f], complex.vertices);
    size_t t = first[f];
    VisitTriangles(corners.corner, corners.count,
                   [&](const Vec3d& a, const Vec3d& b, const Vec3d& c) {
                     const auto vertex = static_cast<int32_t>(3 * t);
                     vertices[3 * t] = a, vertices[3 * t + 1] = b, vertices[3 * t + 2] = c;
                     triangles[t++] = {vertex, vertex + 1, vertex + 2};
                   });
  });
  return {vertices, triangles, HullQuestions::kDistances, poll};
}

Vec3d MiddleOf(const CellFace& face, const std::vector<Vec3d>& vertices) {
  Vec3d sum;
  for (int j = 0; j < face.count; ++j) sum += vertices[face.v[j]];
  return sum / static_cast<double>(face.count);
}

DeviationLimits LimitsFor(const Hull& hull) {
  DeviationLimits limits;
  limits.limit = std::max(kShareOfDiagonal * hull.input_diagonal, kShareOfEdge);
  limits.free = kFreeShare * limits.limit;
  limits.mended = limits.limit;
  return limits;
}

HullSampling::HullSampling(const Hull& hull, const Placement& placement, const StopPoll& poll,
                           const Surroundings& around)
    : hull_(hull),
      placement_(placement),
      vertices_(placement.complex.vertices),
      boundary_(BoundaryOf(placement.complex, poll)),
      points_(placement.features.points().Against(boundary_, poll, around)),
      crease_points_(CreasePoints(placement.features.view(), around)),
      face_middles_(MiddlesOf(placement.complex)),
      point_index_(points_, kBinSize),
      crease_index_(crease_points_, kBinSize),
      face_index_(face_middles_, kBinSize) {}

std::vector<Gap> HullSampling::GapsBeyond(double distance, const StopPoll& poll, FaceDetail detail,
                                          const Surroundings& around) const {
  if (placement_.complex.vertices == vertices_) {
    return GapsTo(boundary_, distance, poll, detail, around);
  }
  return GapsTo(BoundaryOf(placement_.complex, poll), distance, poll, detail, around);
}

std::vector<Gap> HullSampling::GapsTo(const HullQueries& boundary, double distance,
                                      const StopPoll& poll, FaceDetail detail,
                                      const Surroundings& around) const {
  const std::vector<Vec3d> on_boundary =
      detail == FaceDetail::kFew ? face_middles_ : PlacesOf(placement_.complex);
  const size_t count = points_.size() + on_boundary.size();
  std::vector<std::vector<Gap>> of_block(count / kSamplesPerBlock + 1);
  tbb::parallel_for(size_t{0}, of_block.size(), [&](size_t block) {
    int32_t of_boundary = -1, of_hull = -1;
    const auto look_at = [&](const HullQueries& other, const Vec3d& p, int32_t& likely) {
      if (!around.Contain(p) || other.IsWithin(p, distance, likely)) return;
      const HullPoint nearest = other.Closest(p, likely);
      if (nearest.distance > distance) {
        of_block[block].push_back({p, nearest.point, nearest.distance, &other != &boundary});
      }
    };
    poll.Now();
    const size_t begin = block * kSamplesPerBlock;
    for (size_t i = begin; i < std::min(count, begin + kSamplesPerBlock); ++i) {
      if (i < points_.size()) {
        look_at(boundary, points_[i], of_boundary);
      } else {
        look_at(*hull_.queries, on_boundary[i - points_.size()], of_hull);
      }
    }
  });
  return WorstFirst(of_block);
}

std::vector<Gap> HullSampling::CreaseGapsBeyond(double distance, const StopPoll& poll,
                                                const Surroundings& around) const {
  std::vector<Gap> gaps;
  if (crease_points_.empty()) return gaps;
  const CellComplex& complex = placement_.complex;
  std::vector<LineSegment> edges;
  for (const CellFace& face : complex.hull_faces) {
    for (int j = 0; j < face.count; ++j) {
      const int32_t a = face.v[j], b = face.v[(j + 1) % face.count];
      if (a < b) edges.push_back({complex.vertices[a], complex.vertices[b]});
    }
  }
  const SegmentQueries queries(std::move(edges));
  int64_t visited = 0;
  for (const Vec3d& p : crease_points_) {
    poll.At(++visited);
    if (!around.Contain(p)) continue;
    const SegmentPoint nearest = queries.Closest(p, hull_.box.Diagonal());
    if (nearest.segment >= 0 && nearest.distance > distance) {
      gaps.push_back({p, nearest.point, nearest.distance});
    }
  }
  return WorstFirst({gaps});
}

std::vector<Gap> DistinctGaps(const std::vector<Gap>& gaps, const StopPoll& poll) {
  std::vector<Gap> distinct;
  for (const Gap& gap : gaps) {
    poll.Now();
    const bool is_known = std::any_of(distinct.begin(), distinct.end(), [&](const Gap& other) {
      return Norm(other.sample - gap.sample) < kSameGap;
    });
    if (!is_known) distinct.push_back(gap);
  }
  return distinct;
}

VertexDeviation::VertexDeviation(const HullSampling& sampling, const Placement& placement,
                                 const DeviationLimits& limits, int32_t vertex)
    : sampling_(sampling), placement_(placement), limits_(limits), vertex_(vertex) {
  const std::vector<Vec3d>& vertices = placement.complex.vertices;
  for (const int32_t f : placement.neighbourhoods.hull_faces[vertex]) {
    const CellFace& face = placement.complex.hull_faces[f];
    int first = 0;
    while (face.v[first] != vertex) ++first;
    Fan fan;
    fan.count = face.count;
    for (int j = 0; j < face.count; ++j) {
      fan.corner[j] = vertices[face.v[(first + j) % face.count]];
      reach_ = std::max(reach_, Norm(fan.corner[j] - vertices[vertex]));
    }
    fans_.push_back(fan);
  }
  FindSamples(FindOtherFaces());
  FindCreaseSamples();
}

double VertexDeviation::reach() const { return reach_ + kSamplesBeyondFaces + kFaceReach; }

std::vector<VertexDeviation::OtherFace> VertexDeviation::FindOtherFaces() const {
  const CellComplex& complex = placement_.complex;
  std::vector<OtherFace> faces;
  sampling_.face_index().VisitNear(complex.vertices[vertex_], reach(), [&](int32_t f) {
    const CellFace& face = complex.hull_faces[f];
    const auto end = face.v.begin() + face.count;
    if (std::find(face.v.begin(), end, vertex_) != end) return;
    const FaceCorners corners = CornersOf(face, complex.vertices);
    const Vec3d middle = MiddleOf(face, complex.vertices);
    OtherFace other{middle, 0, FaceInLanes(corners.corner, corners.count, middle)};
    for (int j = 0; j < face.count; ++j) {
      other.extent = std::max(other.extent, Norm(corners.corner[j] - middle));
    }
    faces.push_back(other);
  });
  return faces;
}

// Those that the other faces alone bring near enough never count.
void VertexDeviation::FindSamples(const std::vector<OtherFace>& faces) {
  const Vec3d& here = placement_.complex.vertices[vertex_];
  const double radius = reach_ + kSamplesBeyondFaces;
  sampling_.point_index().VisitNear(here, radius, [&](int32_t i) {
    Sample sample{sampling_.points()[i], here, 1e300};
    if (Norm(sample.point - here) > radius) return;
    if (Locate(faces, &sample)) samples_.push_back(sample);
  });
}

// Sets what is nearest to the sample; false where that is within the free distance.
bool VertexDeviation::Locate(const std::vector<OtherFace>& faces, Sample* sample) const {
  bool is_beyond = true;
  RunWithWidestVectors([&] {
    const Vec3d& p = sample->point;
    const auto try_face = [&](const OtherFace& face) {
      const NearestOnFace at = face.lanes.Nearest(p);
      const double distance = std::sqrt(at.squared);
      if (distance < sample->distance) sample->distance = distance, sample->nearest = at.point;
      is_beyond = sample->distance > limits_.free;
    };
    // Mostly it is the face with the nearest middle, which bounds what others can be.
    const OtherFace* likely = nullptr;
    double bound = 1e300;
    for (const OtherFace& face : faces) {
      const double squared = SquaredNorm(p - face.middle);
      if (squared < bound) bound = squared, likely = &face;
    }
    if (likely == nullptr) return;
    try_face(*likely);
    if (!is_beyond) return;
    // Once more in their order: of equally near points the first face's is taken.
    constexpr double kRoundingSlack = 1 + 1e-9;
    const double enough = sample->distance * kRoundingSlack;
    *sample = {p, sample->nearest, 1e300};
    for (const OtherFace& face : faces) {
      if (Norm(p - face.middle) - face.extent >= std::min(sample->distance, enough)) continue;
      try_face(face);
      if (!is_beyond) return;
    }
  });
  return is_beyond;
}

void VertexDeviation::FindCreaseSamples() {
  const std::vector<Vec3d>& vertices = placement_.complex.vertices;
  const Vec3d& here = vertices[vertex_];
  const double radius = reach_ + kSamplesBeyondFaces;
  sampling_.crease_index().VisitNear(here, radius, [&](int32_t i) {
    const Vec3d& p = sampling_.crease_points()[i];
    if (Norm(p - here) <= radius) crease_samples_.push_back({p, here, 1e300});
  });
  if (crease_samples_.empty()) return;
  sampling_.face_index().VisitNear(here, radius + kFaceReach, [&](int32_t f) {
    const CellFace& face = placement_.complex.hull_faces[f];
    for (int j = 0; j < face.count; ++j) {
      const int32_t a = face.v[j], b = face.v[(j + 1) % face.count];
      if (a == vertex_ || b == vertex_) continue;
      for (Sample& sample : crease_samples_) {
        const Vec3d q = ClosestPointOnSegment(sample.point, vertices[a], vertices[b]);
        const double distance = Norm(q - sample.point);
        if (distance < sample.distance) sample.distance = distance, sample.nearest = q;
      }
    }
  });
}

Deviation VertexDeviation::At(const Vec3d& position, double bound) {
  for (Fan& fan : fans_) {
    fan.corner[0] = position;
    fan.middle = {};
    for (int j = 0; j < fan.count; ++j)
      fan.middle += fan.corner[j] / static_cast<double>(fan.count);
    fan.extent = 0;
    for (int j = 0; j < fan.count; ++j) {
      fan.extent = std::max(fan.extent, Norm(fan.corner[j] - fan.middle));
    }
    fan.lanes = FaceInLanes(fan.corner, fan.count, fan.middle);
  }
  worst_of_hull_ = worst_of_boundary_ = worst_of_creases_ = {};
  Deviation deviation;
  AddBoundarySamples(&deviation);
  AddCreaseSamples(&deviation);
  AddHullSamples(bound, &deviation);
  return deviation;
}

void VertexDeviation::Count(double distance, Deviation* deviation) const {
  const double excess = std::max(0.0, distance - limits_.free);
  deviation->largest = std::max(deviation->largest, distance);
  deviation->cost += excess * excess;
}

void VertexDeviation::AddHullSamples(double bound, Deviation* deviation) {
  RunWithWidestVectors([&] {
    for (const Sample& sample : samples_) {
      if (deviation->cost > bound) return;
      Gap gap{sample.point, sample.nearest, sample.distance};
      for (const Fan& fan : fans_) {
        if (Norm(sample.point - fan.middle) - fan.extent >= gap.distance) continue;
        const NearestOnFace at = fan.lanes.Nearest(sample.point);
        const double distance = std::sqrt(at.squared);
        if (distance < gap.distance) gap.distance = distance, gap.nearest = at.point;
      }
      if (gap.distance > worst_of_hull_.distance) worst_of_hull_ = gap;
      Count(gap.distance, deviation);
    }
  });
}

void VertexDeviation::AddBoundarySamples(Deviation* deviation) {
  const HullQueries& hull = *sampling_.hull().queries;
  const auto add = [&](const Vec3d& p, int32_t& likely) {
    if (hull.IsWithin(p, limits_.free, likely)) return;
    const HullPoint nearest = hull.Closest(p, likely);
    if (nearest.distance > worst_of_boundary_.distance) {
      worst_of_boundary_ = {p, nearest.point, nearest.distance};
    }
    Count(nearest.distance, deviation);
  };
  for (Fan& fan : fans_) {
    add(fan.middle, fan.likely[0]);
    add((fan.corner[0] + fan.middle) / 2.0, fan.likely[1]);
    add((fan.corner[0] + fan.corner[1]) / 2.0, fan.likely[2]);  // the other edge is the next face's
  }
}

void VertexDeviation::AddCreaseSamples(Deviation* deviation) {
  for (const Sample& sample : crease_samples_) {
    Gap gap{sample.point, sample.nearest, sample.distance};
    for (const Fan& fan : fans_) {
      for (const int end : {1, fan.count - 1}) {
        const Vec3d q = ClosestPointOnSegment(sample.point, fan.corner[0], fan.corner[end]);
        const double distance = Norm(q - sample.point);
        if (distance < gap.distance) gap.distance = distance, gap.nearest = q;
      }
    }
    if (gap.distance > worst_of_creases_.distance) worst_of_creases_ = gap;
    deviation->cost += gap.distance * gap.distance;
  }
}

}  // namespace amhex
