#include "grpc_job_relay.h"

#include <algorithm>
#include <condition_variable>
#include <utility>

#include "absl/strings/ascii.h"
#include "files.h"
#include "job_id.h"
#include "logging.h"

namespace amhex::server {
namespace {

// The interval, twice what the other side permits at least, and the patience for its answer: a node
// that is cut off is noticed within the sum.
constexpr int kPingMilliseconds = 10'000;
constexpr int kPingPatienceMilliseconds = 10'000;

}  // namespace

// One call. Keeps itself alive until gRPC is done with it.
class GrpcJobRelay::Stream final : public grpc::ClientReadReactor<amhex::v1::WatchJobResponse>,
                                   public std::enable_shared_from_this<Stream> {
 public:
  Stream(const std::shared_ptr<grpc::Channel>& channel, std::shared_ptr<JobFeed> feed)
      : stub_(amhex::v1::Mesher::NewStub(channel)), feed_(std::move(feed)) {}

  void Start(const std::string& job_id, const std::string& token) {
    self_ = shared_from_this();
    if (!token.empty()) context_.AddMetadata("authorization", "Bearer " + token);
    request_.set_name(JobName(job_id));
    stub_->async()->WatchJob(&context_, &request_, this);
    StartRead(&frame_);
    StartCall();
  }

  // Nothing is published once this has returned.
  void Stop() {
    {
      std::lock_guard<std::mutex> lock(mutex_);
      stopped_ = true;
    }
    context_.TryCancel();
  }

  void WaitUntilDone() {
    std::unique_lock<std::mutex> lock(mutex_);
    done_wake_.wait(lock, [this] { return done_; });
  }

  bool done() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return done_;
  }

  bool over() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return stopped_ || done_;
  }

  void OnReadDone(bool ok) override {
    if (!ok) return;
    bool go_on = false;
    {
      std::lock_guard<std::mutex> lock(mutex_);
      if (!stopped_) Publish();
      go_on = !stopped_ && feed_->reader_count() > 0;
    }
    if (go_on) {
      StartRead(&frame_);
    } else {
      context_.TryCancel();
    }
  }

  void OnDone(const grpc::Status& status) override {
    if (!status.ok() && status.error_code() != grpc::StatusCode::CANCELLED) {
      LogInfo("relay_ended", {{"job", request_.name()}, {"message", status.error_message()}});
    }
    std::shared_ptr<Stream> self;
    std::lock_guard<std::mutex> lock(mutex_);
    self = std::move(self_);
    done_ = true;
    done_wake_.notify_all();
    // `lock` is given up before `self`, in reverse order of their making.
  }

 private:
  void Publish() {
    if (frame_.has_job()) {
      feed_->PublishJob(frame_.job());
    } else if (frame_.has_stage()) {
      feed_->PublishStage(frame_.stage());
    } else if (frame_.has_progress()) {
      feed_->PublishProgress(frame_.progress());
    }
  }

  const std::unique_ptr<amhex::v1::Mesher::Stub> stub_;
  const std::shared_ptr<JobFeed> feed_;
  grpc::ClientContext context_;
  amhex::v1::WatchJobRequest request_;
  amhex::v1::WatchJobResponse frame_;
  mutable std::mutex mutex_;
  std::condition_variable done_wake_;
  bool stopped_ = false;
  bool done_ = false;
  std::shared_ptr<Stream> self_;
};

GrpcJobRelay::~GrpcJobRelay() { Stop(); }

void GrpcJobRelay::Stop() {
  std::vector<std::shared_ptr<Stream>> ending;
  {
    std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
    for (const auto& entry : entries_) EndLocked(entry.second.stream);
    entries_.clear();
    ending.swap(ending_);
  }
  for (const auto& stream : ending) stream->WaitUntilDone();
}

void GrpcJobRelay::EndLocked(std::shared_ptr<Stream> stream) {
  stream->Stop();
  ending_.erase(std::remove_if(ending_.begin(), ending_.end(),
                               [](const auto& ended) { return ended->done(); }),
                ending_.end());
  ending_.push_back(std::move(stream));
}

void GrpcJobRelay::ForgetEndedLocked() {
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    entry = entry->second.stream->done() ? entries_.erase(entry) : std::next(entry);
  }
}

std::string GrpcJobRelay::Token() const {
  if (options_.token_file.empty()) return "";
  const auto text = ReadWholeFile(options_.token_file);
  if (text.ok()) return std::string(absl::StripAsciiWhitespace(*text));
  LogError("peer_token_not_read", {{"message", std::string(text.status().message())}});
  return "";
}

std::shared_ptr<grpc::Channel> GrpcJobRelay::ChannelLocked(const std::string& address) {
  auto& channel = channels_[address];
  if (!channel) {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kPingMilliseconds);
    arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kPingPatienceMilliseconds);
    // A relay sends nothing; gRPC would stop asking after two pings.
    arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
    channel = grpc::CreateCustomChannel(address, options_.credentials, arguments);
  }
  return channel;
}

void GrpcJobRelay::Follow(const std::string& job_id, const std::string& address,
                          std::shared_ptr<JobFeed> feed) {
  std::lock_guard<std::mutex> lock(mutex_);
  if (stopped_) return;
  ForgetEndedLocked();
  Entry& entry = entries_[job_id];
  if (entry.stream && !entry.stream->over()) {
    if (entry.address == address) return;
    EndLocked(entry.stream);
  }
  entry.address = address;
  entry.stream = std::make_shared<Stream>(ChannelLocked(address), std::move(feed));
  entry.stream->Start(job_id, Token());
}

void GrpcJobRelay::Unfollow(const std::string& job_id) {
  std::lock_guard<std::mutex> lock(mutex_);
  const auto entry = entries_.find(job_id);
  if (entry == entries_.end()) return;
  EndLocked(entry->second.stream);
  entries_.erase(entry);
}

int GrpcJobRelay::stream_count() const {
  std::lock_guard<std::mutex> lock(mutex_);
  int count = 0;
  for (const auto& entry : entries_) count += entry.second.stream->over() ? 0 : 1;
  return count;
}

}  // namespace amhex::server
