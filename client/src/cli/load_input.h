// From a file of any input format to the bytes that travel.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "amhex/client.h"
#include "amhex/input_hull.h"
#include "amhex/v1/params.pb.h"
#include "cli/report.h"

namespace amhex::client {

struct LoadedInput {
  EncodedInput encoded;
  InputNote note;
};

// .drc files travel as they are; other surfaces and clouds are encoded with a precision that
// follows from the wanted cells, or as arrays when there is guidance; volume meshes are sent as
// arrays. Errors begin with the path and exit codes are those of the input.
absl::StatusOr<LoadedInput> LoadInput(const std::string& path,
                                      const amhex::v1::SizingParams& sizing,
                                      Guidance guidance = {});

// "12946 triangles, 6475 vertices", "8000 points with normals" or "2520 cells, 3180 vertices".
std::string DescribeHull(const InputHull& hull);

// INPUT_ENCODING_ARRAYS, as laid out in proto/amhex/v1/geometry.proto.
std::string EncodeArrays(const MeshingInput& input);

}  // namespace amhex::client
