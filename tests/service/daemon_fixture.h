// The real amhexd as a process, for tests that send it signals. Its workers follow scripts unless
// told otherwise.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <sys/types.h>

#include <memory>
#include <string>
#include <vector>

#include "amhex/v1/meshing_service.grpc.pb.h"
#include "service_fixtures.h"

namespace amhex::server {

class DaemonTest : public ::testing::Test {
 protected:
  // Kills what still runs.
  void TearDown() override;

  // Starts amhexd with exactly these arguments.
  void Spawn(std::vector<std::string> arguments);
  // Starts it on the data folder with scripted workers and `more` flags, and connects to it.
  void Start(const std::vector<std::string>& more = {});
  // Waits for its end: the exit code, or -1 after death by a signal.
  int Wait();
  // From now on what it logs goes to this file.
  void LogTo(const std::string& path) { log_path_ = path; }

  // The address after "name=" in the port file.
  std::string Port(const std::string& name);
  // The Prometheus page.
  std::string MetricsPage();

  std::string Submit(const std::string& script);
  amhex::v1::Job Get(const std::string& name);
  bool Reaches(const std::string& name, amhex::v1::Job::State state);

  TemporaryFolder& folder() { return folder_; }
  pid_t pid() const { return pid_; }
  std::shared_ptr<grpc::Channel> channel() const { return channel_; }
  amhex::v1::Mesher::Stub& mesher() { return *mesher_; }

 private:
  TemporaryFolder folder_;
  std::string log_path_;
  pid_t pid_ = 0;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<amhex::v1::Mesher::Stub> mesher_;
};

}  // namespace amhex::server
