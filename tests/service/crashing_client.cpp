// A client for tests: stops in the middle of what it does and waits to be killed.
//
//   crashing_client ADDRESS MOMENT INPUT MARK
//
// INPUT is a file in INPUT_ENCODING_ARRAYS. At its moment the client makes the file MARK:
//
//   upload         WriteBlob, when half of the input is on its way
//   watch          WatchJob, at the first frame of a job that runs
//   download       ReadBlob, when a third of the result is there
//   mesh_upload    Mesh, as upload
//   mesh_watch     Mesh, as watch
//   mesh_download  Mesh, at the final frame: the result follows, and is not read
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>

#include "amhex/client.h"
#include "files.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

class CrashingClient {
 public:
  CrashingClient(const std::string& address, std::string moment, std::string mark)
      : client_({.address = address}), moment_(std::move(moment)), mark_(std::move(mark)) {
    submit_.on_upload = [this](int64_t have, int64_t whole) {
      if (have >= whole / 2) StopAt("upload", "mesh_upload");
    };
    watch_.on_frame = [this](const amhex::v1::WatchJobResponse& frame) {
      if (frame.has_progress() || frame.job().has_progress()) StopAt("watch", "mesh_watch");
      if (frame.job().state() == Job::SUCCEEDED) StopAt("mesh_download", "");
    };
  }

  // Does everything; returns only if its moment never came.
  absl::Status Run(const client::EncodedInput& input) {
    if (moment_.rfind("mesh_", 0) == 0) return client_.Mesh(input, {}, submit_, watch_).status();
    const auto job = client_.Submit(input, {}, submit_);
    if (!job.ok()) return job.status();
    const auto done = client_.Watch(job->name(), watch_);
    if (!done.ok()) return done.status();
    return client_
        .Download(done->result().mesh(),
                  [this](int64_t have, int64_t whole) {
                    if (have >= whole / 3) StopAt("download", "");
                  })
        .status();
  }

 private:
  void StopAt(const std::string& here, const std::string& or_here) {
    if (moment_ != here && moment_ != or_here) return;
    std::ofstream(mark_) << moment_;
    while (true) pause();
  }

  client::Client client_;
  const std::string moment_;
  const std::string mark_;
  client::SubmitOptions submit_;
  client::WatchOptions watch_;
};

int Main(int argc, char** argv) {
  if (argc != 5) return EXIT_FAILURE;
  const auto bytes = ReadWholeFile(argv[3]);
  if (!bytes.ok()) return EXIT_FAILURE;
  CrashingClient client(argv[1], argv[2], argv[4]);
  const absl::Status end = client.Run({amhex::v1::INPUT_ENCODING_ARRAYS, *bytes});
  std::cerr << "crashing_client: " << argv[2] << " never came: " << end << "\n";
  return EXIT_FAILURE;
}

}  // namespace
}  // namespace amhex::server

int main(int argc, char** argv) { return amhex::server::Main(argc, argv); }
