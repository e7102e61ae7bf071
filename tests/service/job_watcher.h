// Watches a job at a node of a cluster, in a thread of its own.
#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "cluster_fixture.h"

namespace amhex::server {

class JobWatcher {
 public:
  JobWatcher(const Node& node, const std::string& name) {
    request_.set_name(name);
    thread_ = std::thread([this, &node] {
      node.Introduce(&context_);
      const auto stream = node.mesher().WatchJob(&context_, request_);
      for (amhex::v1::WatchJobResponse frame; stream->Read(&frame);) Note(frame);
      status_ = stream->Finish();
    });
  }
  ~JobWatcher() {
    context_.TryCancel();
    if (thread_.joinable()) thread_.join();
  }
  // Waits for the end of the stream.
  void Join() { thread_.join(); }

  // True while no frame had a smaller number than one before it.
  bool increasing() const { return increasing_; }
  int progress_count() const { return progress_count_; }
  // Of the last job that was shown.
  amhex::v1::Job::State state() const { return state_; }
  int64_t last_seq() const { return last_seq_; }

 private:
  void Note(const amhex::v1::WatchJobResponse& frame) {
    increasing_ = increasing_ && frame.seq() >= last_seq_;
    last_seq_ = frame.seq();
    progress_count_ += frame.has_progress() ? 1 : 0;
    if (frame.has_job()) state_ = frame.job().state();
  }

  grpc::ClientContext context_;
  amhex::v1::WatchJobRequest request_;
  std::atomic<bool> increasing_{true};
  std::atomic<int64_t> last_seq_{0};
  std::atomic<int> progress_count_{0};
  std::atomic<amhex::v1::Job::State> state_{amhex::v1::Job::STATE_UNSPECIFIED};
  grpc::Status status_;
  std::thread thread_;
};

}  // namespace amhex::server
