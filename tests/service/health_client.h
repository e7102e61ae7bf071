// Asks grpc.health.v1.Health. Debian does not install its proto, so the two one-field messages are
// written and read by hand.
#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <optional>
#include <string>

namespace amhex::server {

class HealthClient {
 public:
  // The numbers of HealthCheckResponse.ServingStatus; kUnknown also for an unknown service.
  enum Status { kUnknown = 0, kServing = 1, kNotServing = 2, kServiceUnknown = 3 };

  explicit HealthClient(std::shared_ptr<grpc::Channel> channel) : stub_(std::move(channel)) {}

  Status Check(const std::string& service) {
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    std::string request_bytes = {'\n', static_cast<char>(service.size())};
    request_bytes += service;
    grpc::Slice slice(request_bytes);
    const grpc::ByteBuffer request(&slice, 1);
    auto call = stub_.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", request, &queue);
    call->StartCall();
    grpc::ByteBuffer response;
    grpc::Status status;
    call->Finish(&response, &status, this);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    grpc::Slice answer;
    if (!status.ok() || !response.DumpToSingleSlice(&answer).ok() || answer.size() != 2) {
      return kUnknown;
    }
    return static_cast<Status>(answer.begin()[1]);
  }

 private:
  grpc::GenericStub stub_;
};

// One Watch stream; ends with the object.
class HealthWatch {
 public:
  using Status = HealthClient::Status;

  HealthWatch(std::shared_ptr<grpc::Channel> channel, const std::string& service)
      : stub_(std::move(channel)) {
    context_.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    stream_ = stub_.PrepareCall(&context_, "/grpc.health.v1.Health/Watch", &queue_);
    stream_->StartCall(this);
    Await();
    std::string bytes = {'\n', static_cast<char>(service.size())};
    bytes += service;
    grpc::Slice slice(bytes);
    stream_->Write(grpc::ByteBuffer(&slice, 1), this);
    Await();
    stream_->WritesDone(this);
    Await();
  }

  ~HealthWatch() {
    context_.TryCancel();
    grpc::Status status;
    stream_->Finish(&status, this);
    Await();
    queue_.Shutdown();
    while (Await()) {
    }
  }

  // What the server says next; nothing at the end of the stream.
  std::optional<Status> Next() {
    grpc::ByteBuffer response;
    stream_->Read(&response, this);
    grpc::Slice answer;
    if (!Await() || !response.DumpToSingleSlice(&answer).ok()) return std::nullopt;
    // proto3 leaves out the value 0.
    return answer.size() == 2 ? static_cast<Status>(answer.begin()[1]) : HealthClient::kUnknown;
  }

  bool Reaches(Status wanted) {
    while (const auto status = Next()) {
      if (status == wanted) return true;
    }
    return false;
  }

  // Reads to the end of the stream; false if the server said `unwanted` before.
  bool EndsWithout(Status unwanted) { return !Reaches(unwanted); }

 private:
  bool Await() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }

  grpc::GenericStub stub_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream_;
};

}  // namespace amhex::server
