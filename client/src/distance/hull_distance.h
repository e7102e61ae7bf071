// How far a mesh's hull is from what was scanned, cell by cell.
#pragma once

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "amhex/input_hull.h"
#include "amhex/volume_mesh.h"

namespace amhex::client {

// For each cell the largest distance found between its faces on the hull and the input, in the
// user's units, to about half an edge length's sampling:
//   - from points of the input to the hull; each counts for the cell of the face nearest to it,
//   - from corners, edges and middles of the faces to the input, unless it is a cloud, where the
//     distance to the nearest point would tell how dense the points are and not how the hull fits.
// Quadrilaterals count as four triangles around their middle; of a volume mesh the faces that only
// one cell has count. NaN for cells without a face on the hull, and where no point of a cloud is
// nearest to them. DATA_LOSS if the cells do not fit together, INVALID_ARGUMENT for an input
// without points, with points that are not finite, or further away than the mesh is large. O((n +
// m) log (n + m)) for n hull faces and m triangles or points.
absl::StatusOr<std::vector<float>> DistancesToInput(const AtMostHexaMesh& mesh,
                                                    const InputHull& input);

// The same for the input in a file of any format that is read.
absl::StatusOr<std::vector<float>> DistancesToFile(const AtMostHexaMesh& mesh,
                                                   const std::string& path);

// The faces that only one cell of a volume mesh has, as triangles.
TriangleMesh HullOfVolume(const VolumeMesh& volume);

}  // namespace amhex::client
