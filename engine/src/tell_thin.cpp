#include "tell_thin.h"

#include <cmath>

#include "absl/strings/match.h"
#include "absl/strings/str_format.h"
#include "base/stop_poll.h"
#include "input/hull_queries.h"
#include "input/single_layers.h"

namespace amhex {
namespace {

// Of the surface: a solid with some thin parts may fail for other reasons.
constexpr double kMostlyThin = 0.5;
// What closing and the last judgement begin with.
constexpr char kNoValidMesh[] = "no valid mesh was found";

// Other errors, of a device or of the engine itself, have nothing to do with the solid.
bool SaysNothingFitted(const absl::Status& error) {
  if (absl::IsInternal(error)) return absl::StrContains(error.message(), kNoValidMesh);
  return absl::IsInvalidArgument(error);
}

absl::Status ThinError(const absl::Status& error, const ThinPart& thin, const Hull& hull) {
  const double unit = hull.frame.scale;
  const double fitting = LongestEdgeFor(thin.thinnest);
  const Vec3d place = hull.frame.ToUser(thin.place);
  return absl::InvalidArgumentError(absl::StrFormat(
      "%s; the solid is too thin for the wanted edge length of %.3g: below %.0f %% of its surface "
      "the other side is less than half of that away, as at (%g, %g, %g), where it is %.3g (%.2f "
      "edge lengths) thick; ask for an edge length of at most %.2g or %.0f times as many cells",
      error.message(), unit, 100 * thin.area_ratio, place.x, place.y, place.z,
      thin.thickness * unit, thin.thickness, fitting * unit, std::ceil(std::pow(fitting, -3.0))));
}

}  // namespace

absl::Status TellThinWalls(absl::Status error, const Hull& hull, const RunContext& run) {
  if (!SaysNothingFitted(error)) return error;
  const SurfaceOfSolid surface{hull.vertices, hull.triangles, hull.volume};
  try {
    const ThinPart thin = FindThinPart(surface, *hull.queries, 1, StopPoll(run));
    return thin.area_ratio > kMostlyThin ? ThinError(error, thin, hull) : error;
  } catch (const RunStopped&) {
    return run.CheckStop();
  }
}

}  // namespace amhex
