// Progress for scripts: one JSON object per line on stdout.
#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "amhex/v1/job.pb.h"
#include "amhex/v1/meshing_service.pb.h"

namespace amhex::client {

// Every line has "event": message, transfer, state, progress, stage, connection or end; what else
// it has is in docs/client.md.
std::string MessageEvent(const std::string& text);
std::string TransferEvent(const std::string& what, int64_t done, int64_t total);
std::string ConnectionEvent(const absl::Status& status);  // OK = it is back
// The event of a frame: a job's state, its progress, or a finished stage.
std::string FrameEvent(const amhex::v1::WatchJobResponse& frame);
// The last line: the exit status and, if there is one, the outcome (a JSON object).
std::string EndEvent(int exit_code, const std::string& outcome);

// Writes the line and flushes, so that a reader has it at once.
void PrintEvent(const std::string& event);

}  // namespace amhex::client
