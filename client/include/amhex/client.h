// The service's client library: everything a program needs to turn a scan into a mesh.
//
//   amhex::client::Client client({.address = "localhost:7878"});
//   auto job = client.Submit(input, params);       // uploads what the server does not have yet
//   auto done = client.Watch(job->name(), {});     // until the job is final
//   auto mesh = client.FetchMesh(done->result());  // downloaded, verified, checked
//
// Calls block. All are safe to repeat and repeat themselves while the server cannot be reached:
// uploads, downloads and watching go on where they broke off. Thread-safe.
//
// Errors are those of amhex/v1/*.proto as absl::Status of the same code; ReasonOf names the cause.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "amhex/v1/capabilities.pb.h"
#include "amhex/v1/geometry.pb.h"
#include "amhex/v1/job.pb.h"
#include "amhex/v1/meshing_service.pb.h"
#include "amhex/v1/params.pb.h"
#include "amhex/volume_mesh.h"

namespace grpc {
class ClientContext;
}  // namespace grpc

namespace amhex::client {

// Lets another thread end blocking calls; they return CANCELLED. The jobs go on.
class Interrupt {
 public:
  void Request();
  bool requested() const { return requested_; }

 private:
  friend class InterruptibleCall;
  void Add(grpc::ClientContext* context);
  void Remove(grpc::ClientContext* context);

  std::atomic<bool> requested_{false};
  std::mutex mutex_;
  std::set<grpc::ClientContext*> contexts_;
};

// How the connection is protected and who the caller is. PEM texts, not paths.
struct Security {
  bool use_tls = false;     // false: plaintext
  std::string authorities;  // that may sign the server's certificate; empty: the system's
  std::string certificate;  // the caller's own, if the server asks for one
  std::string key;          // of `certificate`
  std::string server_name;  // expected in the server's certificate; empty: the address's
  std::string token;        // sent with every call; empty: none
};

struct ClientOptions {
  std::string address;  // "host:port" or "unix:/path"
  Security security = {};
  // How long a call keeps trying while the server cannot be reached or is busy, from the first
  // failure on; the time starts anew with every byte moved and every frame seen.
  absl::Duration patience = absl::Seconds(60);
  // A watch on which nothing comes for so long is begun anew where it was; servers send a frame at
  // least every 15 s. A transfer is after four times as long, for a chunk on a slow line. Time in
  // which the client's process stood still does not count.
  absl::Duration longest_silence = absl::Seconds(45);
  // Ends calls early if set; must outlive the client.
  Interrupt* interrupt = nullptr;
};

// Bytes of an input and how to read them.
struct EncodedInput {
  amhex::v1::InputEncoding encoding = amhex::v1::INPUT_ENCODING_DRACO;
  std::string bytes;
};

struct SubmitOptions {
  std::string request_id;                             // UUID; empty = a random one
  int32_t priority = 50;                              // [0, 100], lower runs sooner
  absl::Duration run_timeout = absl::ZeroDuration();  // zero = the server's limit
  // Told while the input is uploaded: bytes there, bytes in all.
  std::function<void(int64_t, int64_t)> on_upload;
};

struct WatchOptions {
  // Called for every frame: job states, progress, finished stages.
  std::function<void(const amhex::v1::WatchJobResponse&)> on_frame;
  // Called when the connection broke and is being made again.
  std::function<void(const absl::Status&)> on_reconnect;
  absl::Duration min_interval = absl::Milliseconds(100);
};

// What one input became.
struct MeshedInput {
  amhex::v1::Job job;   // final
  AtMostHexaMesh mesh;  // empty unless the job SUCCEEDED
};

class Client {
 public:
  explicit Client(ClientOptions options);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  absl::StatusOr<amhex::v1::Capabilities> GetCapabilities();

  // Submits a job. Small inputs travel inline; others are uploaded first, from where an earlier
  // upload of the same bytes ended, and not at all if the server has them.
  absl::StatusOr<amhex::v1::Job> Submit(const EncodedInput& input,
                                        const amhex::v1::MeshingParams& params,
                                        const SubmitOptions& options = {});

  // Follows a job until it is final, across broken connections and restarts of the server, and
  // gives the final job, be it SUCCEEDED, FAILED or CANCELLED.
  absl::StatusOr<amhex::v1::Job> Watch(const std::string& name, const WatchOptions& options);

  // Submit, Watch and FetchMesh in one call to the server. Where its stream breaks, it is taken up
  // by ordinary calls: nothing is sent, computed or received twice. A FAILED job is no error.
  absl::StatusOr<MeshedInput> Mesh(const EncodedInput& input,
                                   const amhex::v1::MeshingParams& params,
                                   const SubmitOptions& submit = {},
                                   const WatchOptions& watch = {});

  absl::StatusOr<amhex::v1::Job> GetJob(const std::string& name);
  // Newest first, at most `most` jobs.
  absl::StatusOr<std::vector<amhex::v1::Job>> ListJobs(int most);
  absl::StatusOr<amhex::v1::Job> CancelJob(const std::string& name);
  absl::Status DeleteJob(const std::string& name);

  // Stores `bytes` and gives their name.
  absl::StatusOr<amhex::v1::BlobRef> Upload(
      std::string_view bytes, const std::function<void(int64_t, int64_t)>& on_progress = {});

  // Reads a blob; the SHA-256 of what arrived is checked (DATA_LOSS).
  absl::StatusOr<std::string> Download(
      const amhex::v1::BlobRef& blob,
      const std::function<void(int64_t, int64_t)>& on_progress = {});

  // Downloads a result's mesh and checks it: digest, sizes, counts against the statistics, vertex
  // numbers, cell types, positive volumes, matching faces (DATA_LOSS naming what is wrong).
  absl::StatusOr<AtMostHexaMesh> FetchMesh(
      const amhex::v1::MeshingResult& result,
      const std::function<void(int64_t, int64_t)>& on_progress = {});

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

// The job's error as a status with its reason; OK if it has none.
absl::Status ErrorOf(const amhex::v1::Job& job);

// The name of the cause out of amhex.v1.ErrorReason, e.g. "QUEUE_FULL"; empty if there is none.
std::string ReasonOf(const absl::Status& status);

// "jobs/{uuid}" from itself or from the bare uuid.
std::string FullJobName(const std::string& name);

// Reads MESH_ENCODING_ARRAYS. DATA_LOSS if the sizes do not fit the counts.
absl::StatusOr<AtMostHexaMesh> DecodeMesh(std::string_view bytes);

}  // namespace amhex::client
