// Addresses for servers that tests start and start again.
#pragma once

#include <string>

namespace amhex::server {

// An address of this machine that no other process uses: all of 127/8 leads to it. Elsewhere a port
// that was free a moment ago may have been taken by whatever runs at the same time.
std::string OwnAddress();
// From now on it is this one.
void SetOwnAddress(const std::string& address);

// A port of that address that this process has not used yet.
int NextPort();

}  // namespace amhex::server
