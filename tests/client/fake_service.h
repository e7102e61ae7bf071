// A server in this process that breaks streams off on purpose, to test the client's patience.
#pragma once

#include <grpcpp/grpcpp.h>

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "amhex/v1/blob_service.grpc.pb.h"
#include "amhex/v1/meshing_service.grpc.pb.h"
#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"

namespace amhex::client {

// A status as the real server sends it, with a reason.
inline grpc::Status ErrorWithReason(grpc::StatusCode code, const std::string& reason) {
  google::rpc::ErrorInfo info;
  info.set_domain("amhex");
  info.set_reason(reason);
  google::rpc::Status status;
  status.set_code(code);
  status.add_details()->PackFrom(info);
  return {code, "said by the fake server", status.SerializeAsString()};
}

inline void Sleep(int64_t milliseconds) {
  gpr_sleep_until(
      gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC), gpr_time_from_millis(milliseconds, GPR_TIMESPAN)));
}

// What a server does that has forgotten a call.
inline void WaitUntilCancelled(grpc::ServerContext* context) {
  while (!context->IsCancelled()) Sleep(10);
}

// Keeps blobs in memory. Streams break after `bytes_per_stream` bytes.
class FakeBlobs final : public v1::Blobs::Service {
 public:
  int64_t bytes_per_stream = 1 << 30;
  bool corrupts = false;
  int write_streams = 0, read_streams = 0;
  int silent_streams = 0;  // so many of the first of each kind fall silent half way
  int64_t milliseconds_per_chunk = 0;
  int64_t bytes_received = 0;
  std::map<std::string, std::string> stored;  // by SHA-256; may be incomplete

  grpc::Status WriteBlob(grpc::ServerContext* context,
                         grpc::ServerReader<v1::WriteBlobRequest>* reader,
                         v1::WriteBlobResponse* response) override {
    ++write_streams;
    v1::WriteBlobRequest request;
    std::string name;
    int64_t received = 0;
    while (reader->Read(&request)) {
      if (received > 0 && write_streams <= silent_streams) WaitUntilCancelled(context);
      if (context->IsCancelled()) break;
      Sleep(milliseconds_per_chunk);
      if (request.has_blob()) name = request.blob().sha256();
      std::string& bytes = stored[name];
      if (request.offset() != static_cast<int64_t>(bytes.size())) {
        return ErrorWithReason(grpc::StatusCode::OUT_OF_RANGE, "WRONG_OFFSET");
      }
      bytes += request.data();
      received += static_cast<int64_t>(request.data().size());
      bytes_received += static_cast<int64_t>(request.data().size());
      if (received >= bytes_per_stream && !request.finish()) {
        return {grpc::StatusCode::UNAVAILABLE, "broken off"};
      }
    }
    response->set_committed_size(static_cast<int64_t>(stored[name].size()));
    response->set_complete(true);
    return grpc::Status::OK;
  }

  grpc::Status QueryWriteStatus(grpc::ServerContext*, const v1::QueryWriteStatusRequest* request,
                                v1::QueryWriteStatusResponse* response) override {
    const std::string& bytes = stored[request->blob().sha256()];
    response->set_committed_size(static_cast<int64_t>(bytes.size()));
    response->set_complete(static_cast<int64_t>(bytes.size()) == request->blob().size_bytes());
    return grpc::Status::OK;
  }

  grpc::Status ReadBlob(grpc::ServerContext* context, const v1::ReadBlobRequest* request,
                        grpc::ServerWriter<v1::ReadBlobResponse>* writer) override {
    ++read_streams;
    constexpr size_t kChunk = 1000;
    const auto place = stored.find(request->blob().sha256());
    if (place == stored.end()) {
      return ErrorWithReason(grpc::StatusCode::NOT_FOUND, "BLOB_NOT_FOUND");
    }
    std::string bytes = place->second;
    if (corrupts && !bytes.empty()) bytes.back() = static_cast<char>(bytes.back() ^ 1);
    int64_t sent = 0;
    for (auto at = static_cast<size_t>(request->offset()); at < bytes.size(); at += kChunk) {
      if (sent >= bytes_per_stream) return {grpc::StatusCode::UNAVAILABLE, "broken off"};
      v1::ReadBlobResponse response;
      response.set_offset(static_cast<int64_t>(at));
      response.set_data(bytes.substr(at, kChunk));
      sent += static_cast<int64_t>(response.data().size());
      writer->Write(response);
      if (read_streams <= silent_streams) {
        WaitUntilCancelled(context);
        break;
      }
    }
    return grpc::Status::OK;
  }
};

// Answers submissions and plays a script of frames, some per stream.
class FakeMesher final : public v1::Mesher::Service {
 public:
  std::vector<v1::WatchJobResponse> frames;  // seq is set when sent: 1, 2, ...
  size_t frames_per_stream = 1000;
  int watch_streams = 0, submissions = 0, busy_submissions = 0;
  grpc::Status busy{grpc::StatusCode::UNAVAILABLE, "busy"};
  bool hangs = false;      // WatchJob never ends
  int silent_streams = 0;  // so many of the first of WatchJob and Mesh say nothing after a frame
  int mesh_streams = 0;
  bool breaks_in_upload = false, breaks_in_mesh = false;
  std::string mesh, mesh_input;
  v1::SubmitJobRequest last_submission;

  grpc::Status GetCapabilities(grpc::ServerContext*, const v1::GetCapabilitiesRequest*,
                               v1::Capabilities* response) override {
    response->mutable_limits()->set_max_inline_input_bytes(100);
    response->mutable_limits()->set_max_blob_bytes(10'000'000);
    response->mutable_limits()->set_preferred_chunk_bytes(1000);
    return grpc::Status::OK;
  }

  grpc::Status SubmitJob(grpc::ServerContext*, const v1::SubmitJobRequest* request,
                         v1::SubmitJobResponse* response) override {
    ++submissions;
    if (submissions <= busy_submissions) return busy;
    last_submission = *request;
    response->mutable_job()->set_name("jobs/one");
    return grpc::Status::OK;
  }

  // Takes the whole input, then plays the script and sends the mesh; breaks off after
  // `frames_per_stream` frames, and after half of the mesh if `breaks_in_mesh`.
  grpc::Status Mesh(grpc::ServerContext* context,
                    grpc::ServerReaderWriter<v1::MeshResponse, v1::MeshRequest>* stream) override {
    ++mesh_streams;
    v1::MeshRequest request;
    if (!stream->Read(&request)) return {grpc::StatusCode::INVALID_ARGUMENT, "nothing came"};
    last_submission = request.submit();
    v1::MeshResponse response;
    if (request.submit().has_input_blob()) {
      response.mutable_upload()->set_committed_size(static_cast<int64_t>(mesh_input.size()));
      stream->Write(response);
      const auto whole = static_cast<size_t>(request.submit().input_blob().size_bytes());
      while (mesh_input.size() < whole && stream->Read(&request)) {
        mesh_input += request.data();
        if (mesh_streams == 1 && breaks_in_upload) {
          return {grpc::StatusCode::UNAVAILABLE, "broken off"};
        }
      }
    }
    for (size_t seq = 0; seq < frames.size(); ++seq) {
      if (seq >= frames_per_stream) return {grpc::StatusCode::UNAVAILABLE, "broken off"};
      *response.mutable_watch() = frames[seq];
      response.mutable_watch()->set_seq(static_cast<int64_t>(seq) + 1);
      stream->Write(response);
      if (mesh_streams <= silent_streams) {
        WaitUntilCancelled(context);
        return grpc::Status::OK;
      }
    }
    const size_t end = breaks_in_mesh ? mesh.size() / 2 : mesh.size();
    response.mutable_mesh()->set_data(mesh.substr(0, end));
    if (!mesh.empty()) stream->Write(response);
    return breaks_in_mesh ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "broken off")
                          : grpc::Status::OK;
  }

  grpc::Status WatchJob(grpc::ServerContext* context, const v1::WatchJobRequest* request,
                        grpc::ServerWriter<v1::WatchJobResponse>* writer) override {
    ++watch_streams;
    size_t sent = 0;
    for (size_t seq = static_cast<size_t>(request->after_seq()); seq < frames.size(); ++seq) {
      if (sent++ >= frames_per_stream) return {grpc::StatusCode::UNAVAILABLE, "restarting"};
      v1::WatchJobResponse frame = frames[seq];
      frame.set_seq(static_cast<int64_t>(seq) + 1);
      writer->Write(frame);
      if (watch_streams <= silent_streams) break;
    }
    if (hangs || watch_streams <= silent_streams) WaitUntilCancelled(context);
    return grpc::Status::OK;
  }
};

// Both services on a free port of this machine.
struct FakeServer {
  FakeServer() {
    grpc::ServerBuilder builder;
    int port = 0;
    builder.AddListeningPort("127.0.0.1:0", grpc::InsecureServerCredentials(), &port);
    builder.RegisterService(&blobs);
    builder.RegisterService(&mesher);
    server = builder.BuildAndStart();
    address = "127.0.0.1:" + std::to_string(port);
  }
  ~FakeServer() { server->Shutdown(std::chrono::system_clock::now()); }

  FakeBlobs blobs;
  FakeMesher mesher;
  std::unique_ptr<grpc::Server> server;
  std::string address;
};

}  // namespace amhex::client
