// Who makes a call, and what that allows.
#pragma once

#include <set>

#include "job_store.h"

namespace amhex::server {

enum class Role {
  kSubmit,   // upload; submit, cancel and delete the tenant's own jobs
  kRead,     // see the tenant's own jobs and download its blobs
  kReadAll,  // see all tenants' jobs and download their blobs
  kAdmin,    // everything, on all tenants' jobs
};

struct Caller {
  Tenant tenant;
  std::set<Role> roles;

  bool Has(Role role) const { return roles.contains(role) || roles.contains(Role::kAdmin); }
  // Whether the caller may know of what belongs to `owner`.
  bool Sees(const std::string& owner) const { return owner == tenant.name || Has(Role::kReadAll); }
  // Whether the caller may change what belongs to `owner`.
  bool Rules(const std::string& owner) const {
    return owner == tenant.name || roles.contains(Role::kAdmin);
  }
};

// The one caller of a server that asks nobody who they are.
inline Caller Everyone() { return {Tenant(), {Role::kSubmit, Role::kRead, Role::kAdmin}}; }

}  // namespace amhex::server
