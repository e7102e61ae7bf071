#include "cli/progress_events.h"

#include <cstdio>

#include "absl/strings/str_cat.h"
#include "cli/json.h"

namespace amhex::client {
namespace {

// Line breaks inside strings are escaped, so that those left only lay the text out.
std::string OneLine(const std::string& json) {
  std::string line;
  bool at_start = false;
  for (char c : json) {
    if (c == '\n') {
      at_start = true;
    } else if (!at_start || c != ' ') {
      at_start = false;
      line += c;
    }
  }
  return line;
}

std::string Event(const std::string& kind, const std::string& rest) {
  return absl::StrCat("{\"event\": ", JsonString(kind), rest.empty() ? "" : ", ", rest, "}");
}

}  // namespace

std::string MessageEvent(const std::string& text) {
  return Event("message", absl::StrCat("\"text\": ", JsonString(text)));
}

std::string TransferEvent(const std::string& what, int64_t done, int64_t total) {
  return Event("transfer", absl::StrCat("\"what\": ", JsonString(what), ", \"done_bytes\": ", done,
                                        ", \"total_bytes\": ", total));
}

std::string ConnectionEvent(const absl::Status& status) {
  return Event("connection",
               absl::StrCat("\"connected\": ", status.ok() ? "true" : "false",
                            ", \"text\": ", JsonString(std::string(status.message()))));
}

std::string FrameEvent(const amhex::v1::WatchJobResponse& frame) {
  if (frame.has_progress()) {
    return Event("progress", absl::StrCat("\"progress\": ", OneLine(ToJson(frame.progress()))));
  }
  if (frame.has_stage()) {
    return Event("stage", absl::StrCat("\"stage\": ", OneLine(ToJson(frame.stage()))));
  }
  const auto* state = amhex::v1::Job::State_descriptor()->FindValueByNumber(frame.job().state());
  return Event("state", absl::StrCat("\"job\": ", JsonString(frame.job().name()), ", \"state\": ",
                                     JsonString(state != nullptr ? EnumWord(*state) : "unknown"),
                                     ", \"attempt\": ", frame.job().attempt_count()));
}

std::string EndEvent(int exit_code, const std::string& outcome) {
  return Event("end", absl::StrCat("\"exit_status\": ", exit_code,
                                   outcome.empty() ? "" : ", \"outcome\": ", OneLine(outcome)));
}

void PrintEvent(const std::string& event) {
  std::printf("%s\n", event.c_str());
  std::fflush(stdout);
}

}  // namespace amhex::client
