// The server's version, set by the build.
#pragma once

namespace amhex::server {

inline constexpr char kServerVersion[] = AMHEX_SERVER_VERSION;

}  // namespace amhex::server
