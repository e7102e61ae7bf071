// States of a job and the transitions between them.
//
//   QUEUED --> RUNNING --> SUCCEEDED
//     |  ^        |  |
//     |  +--------+  +--> FAILED, CANCELLED     (back: the worker or the server went away)
//     +--> FAILED, CANCELLED
#pragma once

#include "amhex/v1/job.pb.h"

namespace amhex::server {

inline bool IsFinal(amhex::v1::Job::State state) {
  return state == amhex::v1::Job::SUCCEEDED || state == amhex::v1::Job::FAILED ||
         state == amhex::v1::Job::CANCELLED;
}

}  // namespace amhex::server
