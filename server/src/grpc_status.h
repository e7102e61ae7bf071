// absl::Status -> grpc::Status, with google.rpc details in the trailers.
#pragma once

#include <grpcpp/support/status.h>

#include "absl/status/status.h"

namespace amhex::server {

// Code, message, and a serialized google.rpc.Status that repeats both and adds the details. An
// error without a reason becomes SERVER_FAULT.
grpc::Status ToGrpc(const absl::Status& status);

}  // namespace amhex::server
