#include "token_file.h"

#include <openssl/crypto.h>
#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>

#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "sha256.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

constexpr size_t kTokenBytes = 32;
constexpr size_t kMaxTenantBytes = 64;
constexpr int32_t kMaxWeight = 1000;

absl::Status Refuse(const std::string& problem) { return absl::InvalidArgumentError(problem); }

absl::StatusOr<std::set<Role>> ParseRoles(absl::string_view text) {
  static const std::map<std::string, Role> kRoles = {{"submit", Role::kSubmit},
                                                     {"read", Role::kRead},
                                                     {"read-all", Role::kReadAll},
                                                     {"admin", Role::kAdmin}};
  std::set<Role> roles;
  for (const auto word : absl::StrSplit(text, ',')) {
    const auto role = kRoles.find(std::string(word));
    if (role == kRoles.end()) {
      return Refuse(absl::StrCat("role ", word, " is none of submit, read, read-all, admin"));
    }
    roles.insert(role->second);
  }
  return roles;
}

absl::Status ParseBound(absl::string_view text, Tenant* tenant) {
  const std::vector<absl::string_view> parts = absl::StrSplit(text, absl::MaxSplits('=', 1));
  int64_t value = 0;
  if (parts.size() != 2 || !absl::SimpleAtoi(parts[1], &value) || value < 1) {
    return Refuse(absl::StrCat("bound ", text, " is not of the form name=positive number"));
  }
  if (parts[0] == "weight" && value <= kMaxWeight) {
    tenant->weight = static_cast<int32_t>(value);
  } else if (parts[0] == "max_queued") {
    tenant->max_queued_jobs = value;
  } else if (parts[0] == "max_running") {
    tenant->max_running_jobs = value;
  } else if (parts[0] == "max_blob_bytes") {
    tenant->max_blob_bytes = value;
  } else {
    return Refuse(absl::StrCat("bound ", text, " is none of weight (up to ", kMaxWeight,
                               "), max_queued, max_running, max_blob_bytes"));
  }
  return absl::OkStatus();
}

}  // namespace

bool IsTenantName(const std::string& name) {
  const auto is_plain = [](unsigned char c) { return std::islower(c) || std::isdigit(c); };
  return !name.empty() && name.size() <= kMaxTenantBytes &&
         is_plain(static_cast<unsigned char>(name.front())) &&
         std::all_of(name.begin(), name.end(), [&](unsigned char c) {
           return is_plain(c) || c == '.' || c == '_' || c == '-';
         });
}

absl::StatusOr<TokenTable> TokenTable::Parse(const std::string& text) {
  TokenTable table;
  int number = 0;
  for (const auto line : absl::StrSplit(text, '\n')) {
    ++number;
    const absl::string_view content = line.substr(0, line.find('#'));
    const std::vector<std::string> words =
        absl::StrSplit(content, absl::ByAnyChar(" \t\r"), absl::SkipEmpty());
    if (words.empty()) continue;
    const auto in_line = [number](const std::string& problem) {
      return Refuse(absl::StrCat("line ", number, ": ", problem));
    };
    if (words.size() < 3) return in_line("tenant, roles and SHA-256 are needed");
    if (!IsTenantName(words[0])) {
      return in_line("the tenant's name must be [a-z0-9][a-z0-9._-]*, at most 64 bytes");
    }
    Entry entry;
    entry.caller.tenant.name = words[0];
    auto roles = ParseRoles(words[1]);
    if (!roles.ok()) return in_line(std::string(roles.status().message()));
    entry.caller.roles = *std::move(roles);
    if (!IsSha256Hex(words[2])) {
      return in_line("the SHA-256 must be 64 lower-case hexadecimal digits");
    }
    entry.digest = words[2];
    for (size_t i = 3; i < words.size(); ++i) {
      const absl::Status status = ParseBound(words[i], &entry.caller.tenant);
      if (!status.ok()) return in_line(std::string(status.message()));
    }
    if (std::any_of(table.entries_.begin(), table.entries_.end(),
                    [&entry](const Entry& other) { return other.digest == entry.digest; })) {
      return in_line("the SHA-256 is that of an earlier line");
    }
    table.entries_.push_back(std::move(entry));
  }
  return table;
}

const Caller* TokenTable::Find(const std::string& token) const {
  const std::string digest = Sha256Hex(token);
  const Caller* found = nullptr;
  // Every entry is looked at, and each for the same time.
  for (const Entry& entry : entries_) {
    if (CRYPTO_memcmp(entry.digest.data(), digest.data(), digest.size()) == 0) {
      found = &entry.caller;
    }
  }
  return found;
}

std::string NewToken() {
  std::array<unsigned char, kTokenBytes> random;
  if (RAND_bytes(random.data(), static_cast<int>(random.size())) != 1) std::abort();
  return absl::WebSafeBase64Escape(
      absl::string_view(reinterpret_cast<const char*>(random.data()), random.size()));
}

}  // namespace amhex::server
