// The descriptor on which a worker finds its socket to amhexd.
#pragma once

namespace amhex::server {

inline constexpr int kWorkerFd = 3;

// Tells a worker that lost its CUDA device from one that crashed (1 or a signal).
inline constexpr int kDeviceLostExitCode = 3;

}  // namespace amhex::server
