#include "output/missed_places.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "input/ask_hull.h"
#include "input/hull_queries.h"
#include "output/boundary_overlap.h"
#include "output/mesh_faces.h"
#include "output/surface_distance.h"

namespace amhex {
namespace {

// Edge lengths from the mesh from which on a point is missed; as in distance_exceeds_cell.
constexpr double kMissedDistance = 1.0;
// Missed points in the same or in touching cubes of this side, in edge lengths, are one place.
constexpr double kCubeSide = 1.0;
constexpr size_t kMostNamed = 3;

using Cube = std::array<int64_t, 3>;

Cube CubeOf(const Vec3d& p) {
  return {std::llround(p.x / kCubeSide), std::llround(p.y / kCubeSide),
          std::llround(p.z / kCubeSide)};
}

struct Missed {
  Vec3d point;  // normalised
  double distance = 0;
};

std::vector<Missed> MissedPoints(const std::vector<Vec3d>& samples, const HullAsker& mesh) {
  const std::vector<double> distance = mesh.AskOrThrow(DistanceTo<PlainPoints>{PointsOf(samples)});
  std::vector<Missed> missed;
  for (size_t i = 0; i < samples.size(); ++i) {
    if (distance[i] > kMissedDistance) missed.push_back({samples[i], distance[i]});
  }
  return missed;
}

// Number of the connected group of cubes each cube belongs to.
std::map<Cube, size_t> GroupCubes(const std::vector<Missed>& missed) {
  std::map<Cube, size_t> group;
  for (const Missed& m : missed) group.emplace(CubeOf(m.point), missed.size());
  size_t count = 0;
  for (auto& [start, number] : group) {
    if (number != missed.size()) continue;
    std::vector<Cube> open = {start};
    number = count;
    while (!open.empty()) {
      const Cube cube = open.back();
      open.pop_back();
      for (int k = 0; k < 27; ++k) {
        const auto next =
            group.find({cube[0] + k % 3 - 1, cube[1] + k / 3 % 3 - 1, cube[2] + k / 9 - 1});
        if (next == group.end() || next->second != missed.size()) continue;
        next->second = count;
        open.push_back(next->first);
      }
    }
    ++count;
  }
  return group;
}

// Of the surface, and the input's own points: a tip is smaller than any sample's share of the area,
// and what was too thin to be rebuilt has no surface.
std::vector<Vec3d> PointsOfInput(const Hull& hull) {
  std::vector<Vec3d> points = SampleSurface(hull.vertices, hull.triangles, kMissedDistance / 3);
  points.insert(points.end(), hull.input_points.begin(), hull.input_points.end());
  return points;
}

std::string Text(const Vec3d& p) { return absl::StrCat("(", p.x, ", ", p.y, ", ", p.z, ")"); }

// How many, and the first few with their places.
std::string Named(const std::vector<MissedPlace>& places) {
  std::string text = absl::StrCat(places.size());
  for (size_t i = 0; i < std::min(places.size(), kMostNamed); ++i) {
    absl::StrAppend(&text, i == 0 ? "; " : ", ", "up to ", places[i].distance, " at ",
                    Text(places[i].farthest), " within ", Text(places[i].box.low), " to ",
                    Text(places[i].box.high));
  }
  return text;
}

}  // namespace

std::vector<MissedPlace> FindMissedPlaces(const AtMostHexaMesh& mesh, const Hull& hull,
                                          const StopPoll& poll, DeviceUse* device) {
  const FaceCensus census =
      CountFaces(mesh.corners, static_cast<int64_t>(mesh.vertices.size()), poll);
  BoundaryTriangles boundary = TriangulateBoundary(census.boundary, mesh.vertices);
  for (Vec3d& p : boundary.vertices) p = hull.frame.ToNormalized(p);
  const HullQueries queries(boundary.vertices, boundary.triangles, poll, device,
                            HullAskers::kDevice);
  const std::vector<Missed> missed =
      MissedPoints(PointsOfInput(hull), HullAsker(queries, device, poll));
  const std::map<Cube, size_t> group = GroupCubes(missed);
  std::map<size_t, MissedPlace> places;
  for (const Missed& m : missed) {
    MissedPlace& place = places[group.at(CubeOf(m.point))];
    const Vec3d point = hull.frame.ToUser(m.point);
    const double distance = m.distance * hull.frame.scale;
    place.box.Extend(point);
    if (distance <= place.distance) continue;
    place.distance = distance, place.farthest = point;
    place.is_covered = queries.IsInside(m.point);
  }
  std::vector<MissedPlace> result;
  result.reserve(places.size());
  for (const auto& [number, place] : places) result.push_back(place);
  std::stable_sort(result.begin(), result.end(), [](const MissedPlace& a, const MissedPlace& b) {
    return a.distance > b.distance;
  });
  return result;
}

std::string DescribeMissedPlaces(const std::vector<MissedPlace>& places) {
  std::string text;
  for (const bool covered : {false, true}) {
    std::vector<MissedPlace> alike;
    std::copy_if(places.begin(), places.end(), std::back_inserter(alike),
                 [&](const MissedPlace& place) { return place.is_covered == covered; });
    if (alike.empty()) continue;
    absl::StrAppend(
        &text, text.empty() ? "" : "; ",
        "places of the input farther than an edge length from the mesh, ",
        covered ? "within its cells, cavities too small for them or surfaces that bound none: "
                : "too thin for its cells most likely: ",
        Named(alike));
  }
  return text;
}

}  // namespace amhex
