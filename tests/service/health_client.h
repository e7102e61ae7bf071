// Asks grpc.health.v1.Health. Debian does not install its proto, so the two one-field messages are
// written and read by hand.
#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <memory>
#include <string>

namespace amhex::server {

class HealthClient {
 public:
  // The numbers of HealthCheckResponse.ServingStatus; kUnknown also for an unknown service.
  enum Status { kUnknown = 0, kServing = 1, kNotServing = 2 };

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

}  // namespace amhex::server
