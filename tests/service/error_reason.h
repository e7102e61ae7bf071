// The reason that a call's error carries.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <string>

#include "errors.h"

namespace amhex::server {

inline std::string Reason(const grpc::Status& status) {
  google::rpc::Status details;
  EXPECT_TRUE(details.ParseFromString(status.error_details()));
  return ReasonOf(details);
}

}  // namespace amhex::server
