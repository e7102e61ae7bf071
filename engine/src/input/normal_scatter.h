// Which of the two a scan's points tell less well: where they are, or which way they look.
#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "amhex/run_context.h"
#include "amhex/vec3.h"
#include "input/point_tree.h"

namespace amhex {

// Whether in most neighbourhoods the normals scatter about a linear variation by more radians than
// the points do about a quadric by their distance from each other. One such distance beside a
// point, its plane is off by the one because of its normal and by the other because of its
// position: then averaging normals loses nothing that the points could tell. False where they
// scatter too little to matter. `normals`: unit and oriented, one for each point; `tree`: of the
// points. At most a thousand neighbourhoods are looked at. O(n).
absl::StatusOr<bool> NormalsScatterMore(const std::vector<Vec3d>& points,
                                        const std::vector<Vec3d>& normals, const PointTree& tree,
                                        RunContext& run);

}  // namespace amhex
