// The descriptor on which a worker finds its socket to amhexd.
#pragma once

namespace amhex::server {

inline constexpr int kWorkerFd = 3;

}  // namespace amhex::server
