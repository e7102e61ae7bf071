#include "authenticator.h"

#include <sys/stat.h>

#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/strip.h"
#include "absl/time/clock.h"
#include "errors.h"
#include "files.h"
#include "logging.h"
#include "monotonic_clock.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

constexpr absl::Duration kLookInterval = absl::Seconds(1);
constexpr char kHeader[] = "authorization";
constexpr char kScheme[] = "bearer ";

absl::Status NotAuthenticated(const std::string& problem) {
  return MakeError(absl::StatusCode::kUnauthenticated, amhex::v1::NOT_AUTHENTICATED, problem);
}

const char* NameOf(Role role) {
  switch (role) {
    case Role::kSubmit:
      return "submit";
    case Role::kRead:
      return "read";
    case Role::kReadAll:
      return "read-all";
    case Role::kAdmin:
      return "admin";
  }
  return "unknown";
}

// The token of the call, or "".
std::string TokenOf(const grpc::ServerContextBase& context) {
  const auto& headers = context.client_metadata();
  const auto header = headers.find(kHeader);
  if (header == headers.end()) return "";
  const absl::string_view value(header->second.data(), header->second.size());
  if (!absl::StartsWithIgnoreCase(value, kScheme)) return "";
  return std::string(value.substr(sizeof(kScheme) - 1));
}

absl::StatusOr<Caller> CallerOfCertificate(const grpc::ServerContextBase& context) {
  const auto names = context.auth_context()->FindPropertyValues(GRPC_X509_CN_PROPERTY_NAME);
  const std::string name = names.empty() ? "" : std::string(names[0].data(), names[0].size());
  if (!context.auth_context()->IsPeerAuthenticated() || !IsTenantName(name)) {
    return NotAuthenticated("the client's certificate has no common name that is a tenant's");
  }
  Caller caller;
  caller.tenant.name = name;
  caller.roles = {Role::kSubmit, Role::kRead};
  return caller;
}

}  // namespace

absl::StatusOr<std::unique_ptr<Authenticator>> Authenticator::Create(
    Mode mode, const std::string& token_file) {
  std::unique_ptr<Authenticator> authenticator(new Authenticator(mode, token_file));
  if (mode != Mode::kTokens) return authenticator;
  authenticator->stamp_ = StampOf(token_file);
  const auto text = ReadWholeFile(token_file);
  if (!text.ok()) return absl::InvalidArgumentError("--tokens " + token_file + " cannot be read");
  auto table = TokenTable::Parse(*text);
  if (!table.ok()) {
    return absl::InvalidArgumentError("--tokens " + token_file + ": " +
                                      std::string(table.status().message()));
  }
  authenticator->table_ = std::make_shared<const TokenTable>(*std::move(table));
  return authenticator;
}

Authenticator::FileStamp Authenticator::StampOf(const std::string& path) {
  struct stat info;
  if (stat(path.c_str(), &info) != 0) return {};
  return {absl::ToUnixNanos(absl::TimeFromTimespec(info.st_mtim)), info.st_size, info.st_ino};
}

std::shared_ptr<const TokenTable> Authenticator::Table() {
  std::lock_guard<std::mutex> lock(mutex_);
  const absl::Time now = MonotonicNow();
  if (now < next_look_) return table_;
  next_look_ = now + kLookInterval;
  const FileStamp stamp = StampOf(token_file_);
  if (stamp == stamp_) return table_;
  stamp_ = stamp;
  const auto text = ReadWholeFile(token_file_);
  auto table = text.ok() ? TokenTable::Parse(*text) : text.status();
  if (table.ok()) {
    table_ = std::make_shared<const TokenTable>(*std::move(table));
    LogInfo("tokens_loaded", {{"count", static_cast<int64_t>(table_->size())}});
  } else {
    LogError("tokens_not_loaded", {{"message", std::string(table.status().message())}});
  }
  return table_;
}

absl::StatusOr<Caller> Authenticator::CallerOf(const grpc::ServerContextBase& context) {
  if (mode_ == Mode::kNobodyAsked) return Everyone();
  if (mode_ == Mode::kCertificates) return CallerOfCertificate(context);
  const std::string token = TokenOf(context);
  if (token.empty()) {
    return NotAuthenticated("the call needs a header \"authorization: Bearer TOKEN\"");
  }
  const auto table = Table();
  const Caller* caller = table->Find(token);
  if (caller == nullptr) return NotAuthenticated("the token is not valid");
  return *caller;
}

absl::StatusOr<Caller> Authenticator::Identify(const grpc::ServerContextBase& context,
                                               std::initializer_list<Role> needed) {
  AMHEX_ASSIGN_OR_RETURN(Caller caller, CallerOf(context));
  std::string names;
  for (const Role role : needed) {
    if (caller.Has(role)) return caller;
    names += (names.empty() ? "" : " or ") + std::string(NameOf(role));
  }
  return MakeError(absl::StatusCode::kPermissionDenied, amhex::v1::ROLE_MISSING,
                   "the call needs the role " + names);
}

}  // namespace amhex::server
