#include "worker_probe.h"

#include <unistd.h>

#include "absl/time/clock.h"
#include "errors.h"
#include "files.h"
#include "input_preflight.h"
#include "monotonic_clock.h"
#include "status_macros.h"
#include "worker/worker_protocol.pb.h"

namespace amhex::server {
namespace {

constexpr int64_t kProbeCells = 27;
constexpr absl::Duration kPollInterval = absl::Milliseconds(250);

template <class T>
void Append(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

// The unit cube in INPUT_ENCODING_ARRAYS; corner c lies at the bits (x, y, z) of c.
std::string CubeArrays() {
  constexpr int32_t kTriangles[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
                                         {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                         {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  std::string bytes(kHullArraysMagic, kArraysMagicBytes);
  Append(kArraysVersion, &bytes);
  Append(int32_t{0}, &bytes);
  Append(int64_t{8}, &bytes);
  Append(int64_t{12}, &bytes);
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) Append(double((corner >> axis) & 1), &bytes);
  }
  for (const auto& triangle : kTriangles) {
    for (const int32_t corner : triangle) Append(corner, &bytes);
  }
  return bytes;
}

absl::Status AwaitVerdict(FrameChannel* channel, const ProbeOptions& options) {
  const absl::Time deadline = MonotonicNow() + options.patience;
  while (MonotonicNow() < deadline && !options.stopping()) {
    amhex::worker::FromWorker news;
    AMHEX_ASSIGN_OR_RETURN(const auto outcome, channel->Receive(&news, kPollInterval));
    if (outcome != FrameChannel::Outcome::kFrame || !news.has_finished()) continue;
    const absl::Status verdict = FromRpcStatus(news.finished().error());
    if (verdict.ok()) return verdict;
    return absl::UnavailableError("the trial job failed: " + std::string(verdict.message()));
  }
  return absl::UnavailableError("the trial job did not end");
}

}  // namespace

absl::Status ProbeWorker(FrameChannel* channel, const ProbeOptions& options) {
  AMHEX_RETURN_IF_ERROR(WriteFileAtomically(options.input_path, CubeArrays()));
  amhex::worker::ToWorker frame;
  auto& order = *frame.mutable_run();
  order.set_job(kProbeJob);
  order.set_input_path(options.input_path);
  order.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
  const Limits limits;
  order.mutable_input_limits()->set_max_point_count(limits.max_point_count);
  order.mutable_input_limits()->set_max_triangle_count(limits.max_triangle_count);
  order.mutable_input_limits()->set_max_attribute_count(limits.max_attribute_count);
  order.mutable_params()->mutable_sizing()->set_cell_count(kProbeCells);
  order.set_output_path(options.output_path);
  absl::Status verdict = channel->Send(frame);
  if (verdict.ok()) verdict = AwaitVerdict(channel, options);
  unlink(options.input_path.c_str());
  unlink(options.output_path.c_str());
  return verdict;
}

}  // namespace amhex::server
