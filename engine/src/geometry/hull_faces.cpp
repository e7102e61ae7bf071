#include "geometry/hull_faces.h"

#include <vector>

#include "base/status_macros.h"
#include "base/stop_poll.h"
#include "geometry/hull_face_question.h"
#include "input/ask_hull.h"

namespace amhex {
namespace {

template <class T>
ArrayView<const T> ViewOf(const std::vector<T>& values) {
  return {values.data(), static_cast<int64_t>(values.size())};
}

void NoteHullVertices(MergedCubes* merged) {
  merged->on_hull.assign(merged->vertices.size(), 0);
  for (size_t cube = 0; cube < merged->hull_faces.size(); ++cube) {
    for (int direction = 0; direction < kDirectionCount; ++direction) {
      if ((merged->hull_faces[cube] >> direction & 1) == 0) continue;
      for (const int corner : kCubeFaces[direction]) {
        merged->on_hull[merged->corners[cube][corner]] = 1;
      }
    }
  }
}

absl::Status ProjectHullVertices(const HullAsker& hull, MergedCubes* merged) {
  std::vector<size_t> projected;
  std::vector<Vec3d> points;
  for (size_t v = 0; v < merged->vertices.size(); ++v) {
    if (merged->on_hull[v] == 0) continue;
    projected.push_back(v);
    points.push_back(merged->vertices[v]);
  }
  AMHEX_ASSIGN_OR_RETURN(points, hull.Ask(ClosestTo<PlainPoints>{PointsOf(points)}));
  for (size_t i = 0; i < points.size(); ++i) merged->vertices[projected[i]] = points[i];
  return absl::OkStatus();
}

}  // namespace

absl::Status LabelHullFaces(const Cubes& cubes, const HullAsker& hull, MergedCubes* merged) {
  const HullFacesOf question{
      {cubes.view(), ViewOf(merged->vertices), ViewOf(merged->corners), ViewOf(merged->matches)}};
  AMHEX_ASSIGN_OR_RETURN(merged->hull_faces, hull.Ask(question));
  NoteHullVertices(merged);
  return ProjectHullVertices(hull, merged);
}

}  // namespace amhex
