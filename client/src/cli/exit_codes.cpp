#include "cli/exit_codes.h"

#include <array>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>

#include "absl/strings/match.h"
#include "amhex/client.h"

namespace amhex::client {
namespace {

// What somebody at a command line can do about an error of the service; empty if its message says.
std::string_view NextStep(const absl::Status& status) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kSteps = {{
      {"NO_VALID_MESH", "another --cells often helps; so may a look at the input near that place"},
      {"RUN_TIMEOUT", "fewer --cells take less time; --time-limit allows more, up to the server's"},
      {"OUT_OF_MEMORY", "fewer --cells take less memory"},
      {"NOT_AUTHENTICATED", "--token-file FILE or AMHEX_TOKEN_FILE shows the server who you are"},
      {"JOB_NOT_FOUND", "amhex list names the jobs that there are"},
      {"JOB_NOT_FINAL", "amhex cancel ends it, amhex watch waits for its end"},
  }};
  const std::string reason = ReasonOf(status);
  for (const auto& [name, step] : kSteps) {
    if (name == reason) return step;
  }
  // Not of a private server that did not start.
  if (absl::IsUnavailable(status) && absl::StrContains(status.message(), "cannot be reached")) {
    return "is it running, and is the address right? Without --server a private one is started";
  }
  return {};
}

}  // namespace

const char* ExitCodeHelp() {
  return "Exit status:\n"
         "  0    done; for mesh: a valid mesh has been written\n"
         "  1    a fault in amhex or the server\n"
         "  2    the command line is wrong\n"
         "  3    the input or a parameter is bad\n"
         "  4    the server cannot be reached or started\n"
         "  5    no valid mesh was found\n"
         "  6    time, memory, disk or queue are exhausted\n"
         "  7    the output cannot be written\n"
         "  8    what the server sent did not pass the checks\n"
         "  9    no such job, or its result is gone\n"
         "  10   what was asked for is not available, e.g. the CUDA backend\n"
         "  11   the server does not know the caller, or the caller may not do this\n"
         "  130  interrupted or cancelled";
}

ExitCode ExitCodeOf(const absl::Status& status) {
  constexpr std::array<std::pair<std::string_view, ExitCode>, 5> kReasons = {{
      {"NO_VALID_MESH", kExitNoMesh},
      {"ATTEMPTS_EXHAUSTED", kExitNoMesh},
      {"INPUT_QUARANTINED", kExitNoMesh},
      {"INPUT_DECODE_LIMIT", kExitInput},
      {"BACKEND_UNAVAILABLE", kExitUnavailable},
  }};
  const std::string reason = ReasonOf(status);
  for (const auto& [name, code] : kReasons) {
    if (name == reason) return code;
  }
  switch (status.code()) {
    case absl::StatusCode::kOk:
      return kExitSuccess;
    case absl::StatusCode::kInvalidArgument:
    case absl::StatusCode::kOutOfRange:
      return kExitInput;
    case absl::StatusCode::kUnavailable:
      return kExitNoServer;
    case absl::StatusCode::kResourceExhausted:
    case absl::StatusCode::kDeadlineExceeded:
      return kExitLimit;
    case absl::StatusCode::kDataLoss:
      return kExitDamaged;
    case absl::StatusCode::kNotFound:
      return kExitNoJob;
    case absl::StatusCode::kFailedPrecondition:
    case absl::StatusCode::kUnimplemented:
      return kExitUnavailable;
    case absl::StatusCode::kUnauthenticated:
    case absl::StatusCode::kPermissionDenied:
      return kExitAccess;
    case absl::StatusCode::kCancelled:
      return kExitCancelled;
    default:
      return kExitFault;
  }
}

int Fail(const absl::Status& status) { return Fail(status, ExitCodeOf(status)); }

int Fail(const absl::Status& status, ExitCode code) {
  const std::string reason = ReasonOf(status);
  const std::string message(status.message());
  std::fprintf(stderr, "amhex: error: %s%s%s%s\n", message.c_str(), reason.empty() ? "" : " [",
               reason.c_str(), reason.empty() ? "" : "]");
  const std::string_view step = NextStep(status);
  if (!step.empty()) std::fprintf(stderr, "amhex: %s\n", std::string(step).c_str());
  return code;
}

}  // namespace amhex::client
