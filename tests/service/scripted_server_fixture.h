// A server in this process with scripted workers, and stubs to call it.
#pragma once

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <memory>

#include "amhex/v1/blob_service.grpc.pb.h"
#include "amhex/v1/meshing_service.grpc.pb.h"
#include "server.h"
#include "service_fixtures.h"

namespace amhex::server {

class ScriptedServerTest : public ::testing::Test {
 protected:
  ScriptedServerTest() {
    options_.listen = {"127.0.0.1:0"};
    options_.metrics_listen = "";
    options_.data_dir = folder_ / "data";
    options_.worker = AMHEX_SCRIPTED_WORKER;
  }

  // With options_ as they are then.
  void Start() {
    auto created = Server::Create(options_);
    ASSERT_TRUE(created.ok()) << created.status();
    server_ = *std::move(created);
    channel_ =
        grpc::CreateChannel(server_->addresses().front(), grpc::InsecureChannelCredentials());
    mesher_ = amhex::v1::Mesher::NewStub(channel_);
    blobs_ = amhex::v1::Blobs::NewStub(channel_);
  }

  TemporaryFolder folder_;
  ServerOptions options_;
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<amhex::v1::Mesher::Stub> mesher_;
  std::unique_ptr<amhex::v1::Blobs::Stub> blobs_;
};

}  // namespace amhex::server
