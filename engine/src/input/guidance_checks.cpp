#include "input/guidance_checks.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <vector>

#include "absl/strings/str_cat.h"
#include "base/status_macros.h"
#include "input/hull_queries.h"
#include "input/offenders.h"

namespace amhex {
namespace {

bool IsFinite(const Vec3d& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z);
}

// Long enough for its direction to be known.
bool HasDirection(const Vec3d& p) { return Norm(p) > 1e-100 && Norm(p) < 1e100; }

absl::Status Refuse(const Offenders& offenders, const char* what, const char* problem) {
  if (!offenders.Any()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(offenders.Describe(what), " ", problem));
}

}  // namespace

absl::Status CheckGuidance(const Guidance& guidance, const MeshingParams& params) {
  if (guidance.empty()) return absl::OkStatus();
  if (params.relaxation.initialization != Initialization::kField) {
    return absl::InvalidArgumentError(
        "guidance is given, but only relaxation.initialization FIELD follows it");
  }
  Offenders not_finite, no_direction;
  for (size_t i = 0; i < guidance.samples.size(); ++i) {
    const GuideSample& sample = guidance.samples[i];
    const bool is_finite =
        IsFinite(sample.position) && IsFinite(sample.axis) && IsFinite(sample.second_axis);
    if (!is_finite) {
      not_finite.Add(i);
    } else if (!HasDirection(sample.axis)) {
      no_direction.Add(i);
    }
  }
  AMHEX_RETURN_IF_ERROR(Refuse(not_finite, "guide sample", "is not finite"));
  AMHEX_RETURN_IF_ERROR(Refuse(no_direction, "guide sample", "has no direction"));
  for (size_t i = 0; i < guidance.planes.size(); ++i) {
    const GuidePlane& plane = guidance.planes[i];
    if (!IsFinite(plane.point) || !IsFinite(plane.normal)) {
      not_finite.Add(i);
    } else if (!HasDirection(plane.normal)) {
      no_direction.Add(i);
    }
  }
  AMHEX_RETURN_IF_ERROR(Refuse(not_finite, "guide plane", "is not finite"));
  return Refuse(no_direction, "guide plane", "has no normal");
}

void ApplyGuidance(const Guidance& guidance, Hull* hull) {
  hull->guidance = guidance;
  for (GuideSample& sample : hull->guidance.samples) {
    sample.position = hull->frame.ToNormalized(sample.position);
    sample.axis = Normalized(hull->frame.DirectionToNormalized(sample.axis));
    sample.second_axis = Normalized(hull->frame.DirectionToNormalized(sample.second_axis));
  }
  for (GuidePlane& plane : hull->guidance.planes) {
    plane.point = hull->frame.ToNormalized(plane.point);
    plane.normal = Normalized(hull->frame.DirectionToNormalized(plane.normal));
  }
  const std::vector<GuideSample>& samples = hull->guidance.samples;
  std::vector<uint8_t> is_outside(samples.size(), 0);
  tbb::parallel_for(size_t{0}, samples.size(), [&](size_t i) {
    is_outside[i] = hull->queries->IsInside(samples[i].position) ? 0 : 1;
  });
  int64_t outside = 0;
  for (const uint8_t flag : is_outside) outside += flag;
  if (outside > 0) {
    hull->warnings.push_back(absl::StrCat("guide samples outside the solid: ", outside));
  }
}

}  // namespace amhex
