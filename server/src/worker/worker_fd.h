// What amhexd and its workers agree on beside their frames.
#pragma once

#include "absl/time/time.h"

namespace amhex::server {

// The descriptor on which a worker finds its socket.
inline constexpr int kWorkerFd = 3;

// While it has a job, a worker sends a frame without news this often, whatever the job does.
inline constexpr absl::Duration kSignOfLifeInterval = absl::Seconds(1);

// Tells a worker that lost its CUDA device from one that crashed (1 or a signal).
inline constexpr int kDeviceLostExitCode = 3;

}  // namespace amhex::server
