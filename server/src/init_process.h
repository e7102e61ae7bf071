// What the first process of a container owes the others.
#pragma once

#include <functional>

namespace amhex::server {

// Runs `serve` in a child process, passes signals on to it, and reaps every process that ends
// below, also those whose parents are gone. Returns, in the parent, what `serve` returned, or
// 128 + the number of the signal it died of; in the child, what `serve` returns.
int ServeUnderInit(const std::function<int()>& serve);

}  // namespace amhex::server
