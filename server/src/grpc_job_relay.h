// JobRelay over Mesher.WatchJob of the other nodes.
#pragma once

#include <grpcpp/grpcpp.h>

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "amhex/v1/meshing_service.grpc.pb.h"
#include "job_relay.h"

namespace amhex::server {

class GrpcJobRelay : public JobRelay {
 public:
  struct Options {
    std::shared_ptr<grpc::ChannelCredentials> credentials;
    // File of the token that is sent with every call; must have the role read-all on the other
    // nodes. Read for each call, so that it can be replaced. Empty: none.
    std::string token_file;
  };

  explicit GrpcJobRelay(const Options& options) : options_(options) {}
  ~GrpcJobRelay() override;

  void Follow(const std::string& job_id, const std::string& address,
              std::shared_ptr<JobFeed> feed) override;
  void Unfollow(const std::string& job_id) override;
  void Stop() override;
  // Streams under way, for tests.
  int stream_count() const;

 private:
  class Stream;
  struct Entry {
    std::string address;
    std::shared_ptr<Stream> stream;
  };

  void ForgetEndedLocked();
  // Stops a stream and keeps it until gRPC is done with it.
  void EndLocked(std::shared_ptr<Stream> stream);
  std::string Token() const;
  std::shared_ptr<grpc::Channel> ChannelLocked(const std::string& address);

  const Options options_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<grpc::Channel>> channels_;  // by address
  std::map<std::string, Entry> entries_;                            // by job id
  std::vector<std::shared_ptr<Stream>> ending_;
  bool stopped_ = false;
};

}  // namespace amhex::server
