// What the client library's files share: stubs, and calls that repeat themselves.
#pragma once

#include <grpcpp/grpcpp.h>

#include <optional>

#include "absl/strings/str_cat.h"
#include "amhex/client.h"
#include "amhex/v1/blob_service.grpc.pb.h"
#include "amhex/v1/meshing_service.grpc.pb.h"
#include "rpc/interruptible_call.h"
#include "rpc/patience.h"
#include "rpc/status_convert.h"

namespace amhex::client {

namespace v1 = amhex::v1;

// A call that answers at once is given this long.
inline constexpr absl::Duration kUnaryDeadline = absl::Seconds(30);

inline bool IsFinal(const v1::Job& job) {
  return job.state() == v1::Job::SUCCEEDED || job.state() == v1::Job::FAILED ||
         job.state() == v1::Job::CANCELLED;
}

// Not connected yet; the first call connects.
std::shared_ptr<grpc::Channel> NewChannel(const ClientOptions& options);

class Client::Implementation {
 public:
  explicit Implementation(ClientOptions client_options)
      : options(std::move(client_options)),
        channel(NewChannel(options)),
        mesher(v1::Mesher::NewStub(channel)),
        blobs(v1::Blobs::NewStub(channel)) {}

  Patience NewPatience() const { return Patience(options.patience, options.interrupt); }

  // Calls `method` of `stub` until it answers or patience ends.
  template <class Stub, class Request, class Response>
  absl::Status Call(Stub* stub,
                    grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                    const Request& request, Response* response) {
    Patience patience = NewPatience();
    while (true) {
      InterruptibleCall call(options);
      call.context()->set_deadline(absl::ToChronoTime(absl::Now() + kUnaryDeadline));
      const absl::Status status =
          FromGrpcStatus((stub->*method)(call.context(), request, response));
      if (status.ok() || !patience.ShouldRetry(status)) return Named(status);
    }
  }

  // The status of a server that is unreachable or out of room with its address, which gRPC leaves
  // out.
  absl::Status Named(const absl::Status& status) const {
    if (options.interrupt != nullptr && options.interrupt->requested()) {
      return absl::CancelledError("interrupted");
    }
    if (HasNoRoomNow(status)) {
      return absl::ResourceExhaustedError(
          absl::StrCat("the server at ", options.address,
                       " has no memory left for messages: ", std::string(status.message())));
    }
    if (!absl::IsUnavailable(status) || !ReasonOf(status).empty()) return status;
    return absl::UnavailableError(absl::StrCat(
        "the server at ", options.address, " cannot be reached: ", std::string(status.message())));
  }

  // Limits are asked for once.
  absl::StatusOr<v1::Limits> GetLimits() {
    const std::lock_guard lock(limits_mutex);
    if (limits) return *limits;
    v1::Capabilities capabilities;
    const absl::Status status =
        Call<v1::Mesher::Stub>(mesher.get(), &v1::Mesher::Stub::GetCapabilities,
                               v1::GetCapabilitiesRequest(), &capabilities);
    if (!status.ok()) return status;
    limits = capabilities.limits();
    return *limits;
  }

  // What the server has of a blob.
  absl::StatusOr<v1::QueryWriteStatusResponse> QueryWriteStatus(const v1::BlobRef& blob);
  // One WriteBlob stream from `committed` on, which becomes what the server has.
  absl::Status WriteFrom(std::string_view bytes, const v1::BlobRef& blob, int64_t chunk_bytes,
                         const std::function<void(int64_t, int64_t)>& on_progress,
                         int64_t* committed);
  // One ReadBlob stream; appends to `bytes`.
  absl::Status ReadInto(const v1::BlobRef& blob,
                        const std::function<void(int64_t, int64_t)>& on_progress,
                        std::string* bytes);
  // A submission with everything but the input.
  v1::SubmitJobRequest NewRequest(const EncodedInput& input, const v1::MeshingParams& params,
                                  const SubmitOptions& submit) const;
  // True if the input should travel in the submission.
  static bool IsInline(const EncodedInput& input, const v1::Limits& limits);
  // The bytes of a result as a mesh, if they are what was announced.
  static absl::StatusOr<AtMostHexaMesh> CheckedMesh(const v1::MeshingResult& result,
                                                    std::string_view bytes);
  // Downloads what `bytes` lacks of a blob.
  absl::Status ReadRest(const v1::BlobRef& blob,
                        const std::function<void(int64_t, int64_t)>& on_progress,
                        std::string* bytes);
  // Follows a job from where `seq` and `job` stand until it is final.
  absl::Status WatchOn(const std::string& name, const WatchOptions& watch, int64_t* seq,
                       v1::Job* job);
  // One WatchJob stream; `seq` and `job` follow it.
  absl::Status WatchOnce(const std::string& name, const WatchOptions& watch, int64_t* seq,
                         v1::Job* job, Patience* patience);

  const ClientOptions options;
  const std::shared_ptr<grpc::Channel> channel;
  const std::unique_ptr<v1::Mesher::Stub> mesher;
  const std::unique_ptr<v1::Blobs::Stub> blobs;
  std::mutex limits_mutex;
  std::optional<v1::Limits> limits;
};

}  // namespace amhex::client
