// A trial job: whether a fresh worker can mesh at all, whatever inputs killed the ones before.
#pragma once

#include <functional>
#include <string>

#include "absl/status/status.h"
#include "absl/time/time.h"
#include "worker/frame_channel.h"

namespace amhex::server {

// Marks the trial job's order.
inline constexpr char kProbeJob[] = "probe";

struct ProbeOptions {
  std::string input_path;   // written and removed
  std::string output_path;  // removed
  absl::Duration patience;
  std::function<bool()> stopping;  // ends the trial early
};

// OK if the worker meshes a small cube; UNAVAILABLE telling what it did instead.
absl::Status ProbeWorker(FrameChannel* channel, const ProbeOptions& options);

}  // namespace amhex::server
