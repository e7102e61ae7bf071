// Job names: "jobs/" and a UUID of version 7, so that names sort by creation time.
#pragma once

#include <string>

#include "absl/time/time.h"

namespace amhex::server {

// A fresh UUIDv7 in canonical form (36 lower-case characters): 48 bits of milliseconds, then
// random.
std::string MakeUuid(absl::Time now);

// True for the canonical form of any UUID version, either case.
bool IsUuid(const std::string& text);

// "jobs/{uuid}" -> uuid, or "" if `name` has another form.
std::string JobIdFromName(const std::string& name);
std::string JobName(const std::string& job_id);

}  // namespace amhex::server
