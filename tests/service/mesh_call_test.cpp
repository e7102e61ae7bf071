// Mesher.Mesh over a real channel, with scripted workers: the whole in one call, hostile orders of
// messages, and streams that end early.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "amhex/v1/blob_service.grpc.pb.h"
#include "amhex/v1/meshing_service.grpc.pb.h"
#include "error_reason.h"
#include "errors.h"
#include "job.h"
#include "job_manager.h"
#include "server.h"
#include "service_fixtures.h"
#include "sha256.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;
using amhex::v1::MeshRequest;
using amhex::v1::MeshResponse;

constexpr char kRequestId[] = "6f9619ff-8b86-4011-b42d-00c04fc964ff";

// One call of Mesh.
class MeshCall {
 public:
  explicit MeshCall(amhex::v1::Mesher::Stub* mesher) {
    context_.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    stream_ = mesher->Mesh(&context_);
  }
  ~MeshCall() {
    if (finished_) return;
    context_.TryCancel();
    Finish();
  }

  bool Send(const MeshRequest& request) { return stream_->Write(request); }
  bool SendData(int64_t offset, const std::string& data) {
    MeshRequest request;
    request.set_offset(offset);
    request.set_data(data);
    return Send(request);
  }
  void EndSending() { stream_->WritesDone(); }
  bool Read(MeshResponse* response) { return stream_->Read(response); }
  void Cut() { context_.TryCancel(); }

  // Reads until the job runs; returns its name.
  std::string ReadUntilRunning() {
    MeshResponse response;
    std::string name;
    while (Read(&response)) {
      if (response.watch().has_job()) name = response.watch().job().name();
      if (response.watch().has_progress()) return name;
      if (response.watch().job().state() == Job::RUNNING) return name;
    }
    return "";
  }

  // Reads to the end: frames of the job grow in number, chunks follow each other.
  void ReadAll() {
    for (MeshResponse response; Read(&response);) {
      if (response.has_watch()) {
        EXPECT_GT(response.watch().seq(), last_seq);
        last_seq = response.watch().seq();
        if (response.watch().has_job()) job = response.watch().job();
      }
      if (response.has_mesh()) {
        EXPECT_EQ(response.mesh().offset(), static_cast<int64_t>(mesh.size()));
        mesh += response.mesh().data();
      }
    }
    Finish();
  }

  grpc::Status Finish() {
    finished_ = true;
    status = stream_->Finish();
    return status;
  }

  Job job;
  std::string mesh;
  int64_t last_seq = 0;
  grpc::Status status;

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<MeshRequest, MeshResponse>> stream_;
  bool finished_ = false;
};

MeshRequest Inline(const std::string& script) {
  MeshRequest request;
  *request.mutable_submit() = ScriptRequest(script);
  return request;
}

MeshRequest Named(const std::string& input) {
  MeshRequest request;
  auto& submit = *request.mutable_submit();
  submit.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
  submit.set_request_id(kRequestId);
  submit.mutable_input_blob()->set_sha256(Sha256Hex(input));
  submit.mutable_input_blob()->set_size_bytes(static_cast<int64_t>(input.size()));
  return request;
}

class MeshCallTest : public ::testing::Test {
 protected:
  void SetUp() override {
    options_.listen = {"127.0.0.1:0"};
    options_.metrics_listen = "";
    options_.data_dir = folder_ / "data";
    options_.worker = AMHEX_SCRIPTED_WORKER;
    auto created = Server::Create(options_);
    ASSERT_TRUE(created.ok()) << created.status();
    server_ = *std::move(created);
    const auto channel =
        grpc::CreateChannel(server_->addresses().front(), grpc::InsecureChannelCredentials());
    mesher_ = amhex::v1::Mesher::NewStub(channel);
    blobs_ = amhex::v1::Blobs::NewStub(channel);
  }

  Job Get(const std::string& name) {
    const auto job = server_->manager().Get(Everyone(), name.substr(std::string("jobs/").size()));
    EXPECT_TRUE(job.ok()) << job.status();
    return job.ok() ? *job : Job();
  }
  bool Reaches(const std::string& name, Job::State state) {
    return Eventually([&] { return Get(name).state() == state; }, absl::Seconds(60));
  }
  size_t JobCount() {
    JobQuery query;
    query.page_size = 100;
    return server_->manager().List(Everyone(), query)->jobs.size();
  }

  TemporaryFolder folder_;
  ServerOptions options_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<amhex::v1::Mesher::Stub> mesher_;
  std::unique_ptr<amhex::v1::Blobs::Stub> blobs_;
};

TEST_F(MeshCallTest, InlineInputComesBackAsAMesh) {
  MeshCall call(mesher_.get());
  ASSERT_TRUE(call.Send(Inline("progress 1; stage; succeed mesh;")));
  call.EndSending();
  call.ReadAll();
  EXPECT_TRUE(call.status.ok()) << call.status.error_message();
  EXPECT_EQ(call.job.state(), Job::SUCCEEDED);
  EXPECT_EQ(call.mesh, "mesh");
  // The job is one like any other.
  EXPECT_EQ(Get(call.job.name()).state(), Job::SUCCEEDED);
}

TEST_F(MeshCallTest, LargeInputAndLargeMeshMoveInChunks) {
  const std::string input = ScriptInput("large 20000000; " + std::string(5'000'000, ' '));
  MeshCall call(mesher_.get());
  ASSERT_TRUE(call.Send(Named(input)));
  MeshResponse response;
  ASSERT_TRUE(call.Read(&response));
  ASSERT_TRUE(response.has_upload());
  EXPECT_EQ(response.upload().committed_size(), 0);
  constexpr size_t kChunk = 1 << 20;
  for (size_t at = 0; at < input.size(); at += kChunk) {
    ASSERT_TRUE(call.SendData(static_cast<int64_t>(at), input.substr(at, kChunk)));
  }
  call.ReadAll();
  EXPECT_TRUE(call.status.ok()) << call.status.error_message();
  EXPECT_EQ(call.mesh, std::string(20'000'000, 'x'));
}

TEST_F(MeshCallTest, WhatTheServerHasIsNotAskedFor) {
  const std::string input = ScriptInput("succeed mesh;");
  for (int round = 0; round < 2; ++round) {
    MeshCall call(mesher_.get());
    auto first = Named(input);
    first.mutable_submit()->clear_request_id();
    ASSERT_TRUE(call.Send(first));
    MeshResponse response;
    ASSERT_TRUE(call.Read(&response));
    EXPECT_EQ(response.upload().complete(), round == 1);
    if (round == 0) ASSERT_TRUE(call.SendData(0, input));
    call.ReadAll();
    EXPECT_EQ(call.mesh, "mesh");
  }
}

TEST_F(MeshCallTest, FailedJobEndsTheStreamWithOkAndNoMesh) {
  MeshCall call(mesher_.get());
  ASSERT_TRUE(call.Send(Inline("progress 1; fail;")));
  call.ReadAll();
  EXPECT_TRUE(call.status.ok()) << call.status.error_message();
  EXPECT_EQ(call.job.state(), Job::FAILED);
  EXPECT_EQ(ReasonOf(call.job.error()), "INPUT_INVALID");
  EXPECT_EQ(call.mesh, "");
}

TEST_F(MeshCallTest, MessagesInAnyOtherOrderAreRefused) {
  const std::string input = ScriptInput("succeed mesh;");
  const auto data = [](int64_t offset, const std::string& bytes) {
    MeshRequest request;
    request.set_offset(offset);
    request.set_data(bytes);
    return request;
  };
  auto with_data = Named(input);
  with_data.set_data("x");
  auto estimate = Inline("succeed mesh;");
  estimate.mutable_submit()->set_validate_only(true);
  auto unsized_blob = Named(input);
  unsized_blob.mutable_submit()->mutable_input_blob()->clear_size_bytes();
  auto huge = Named(input);
  huge.mutable_submit()->mutable_input_blob()->set_size_bytes(int64_t{1} << 60);
  std::string other = input;
  other.back() = static_cast<char>(other.back() ^ 1);
  struct Case {
    const char* what;
    std::vector<MeshRequest> messages;
    const char* reason;
  };
  const Case cases[] = {
      {"nothing", {}, "BAD_REQUEST"},
      {"an empty message", {MeshRequest()}, "BAD_REQUEST"},
      {"data first", {data(0, "bytes")}, "BAD_REQUEST"},
      {"data with the first", {with_data}, "BAD_REQUEST"},
      {"an estimate", {estimate}, "BAD_REQUEST"},
      {"no size", {unsized_blob}, "BAD_REQUEST"},
      {"too large a size", {huge}, "BAD_REQUEST"},
      {"two submissions", {Named(input), Named(input)}, "BAD_REQUEST"},
      {"a gap", {Named(input), data(5, "bytes")}, "WRONG_OFFSET"},
      {"a negative offset", {Named(input), data(-1, "bytes")}, "WRONG_OFFSET"},
      {"more than announced", {Named(input), data(0, input + "more")}, "BAD_REQUEST"},
      {"other bytes", {Named(input), data(0, other)}, "DIGEST_MISMATCH"},
      {"an early end", {Named(input), data(0, "AMHEX")}, "BLOB_MISSING"},
  };
  for (const Case& tried : cases) {
    MeshCall call(mesher_.get());
    for (const MeshRequest& message : tried.messages) call.Send(message);
    call.EndSending();
    call.ReadAll();
    EXPECT_FALSE(call.status.ok()) << tried.what;
    EXPECT_EQ(Reason(call.status), tried.reason) << tried.what;
  }
  EXPECT_EQ(JobCount(), 0u);
}

TEST_F(MeshCallTest, AllBadFieldsOfTheFirstMessageAreNamedAtOnce) {
  auto request = Named("input");
  request.set_data("x");
  auto& submit = *request.mutable_submit();
  submit.set_validate_only(true);
  submit.set_priority(101);
  submit.mutable_input_blob()->set_sha256("x");
  submit.mutable_input_blob()->clear_size_bytes();
  submit.mutable_params()->mutable_run()->set_seed(-1);
  MeshCall call(mesher_.get());
  call.Send(request);
  call.ReadAll();
  std::vector<std::string> fields = BadFields(call.status);
  std::sort(fields.begin(), fields.end());
  EXPECT_EQ(fields, (std::vector<std::string>{
                        "data", "submit.input_blob.sha256", "submit.input_blob.size_bytes",
                        "submit.params.run.seed", "submit.priority", "submit.validate_only"}));
}

TEST_F(MeshCallTest, UploadThatWasCutGoesOnInTheNextCall) {
  const std::string input = ScriptInput("succeed mesh; " + std::string(2'000'000, ' '));
  {
    MeshCall call(mesher_.get());
    ASSERT_TRUE(call.Send(Named(input)));
    MeshResponse response;
    ASSERT_TRUE(call.Read(&response));
    ASSERT_TRUE(call.SendData(0, input.substr(0, 1'000'000)));
    ASSERT_TRUE(Eventually([&] {
      return server_->manager()
                 .FindUpload(Everyone(), Named(input).submit().input_blob())
                 ->committed_size == 1'000'000;
    }));
  }
  EXPECT_EQ(JobCount(), 0u);
  MeshCall call(mesher_.get());
  ASSERT_TRUE(call.Send(Named(input)));
  MeshResponse response;
  ASSERT_TRUE(call.Read(&response));
  ASSERT_EQ(response.upload().committed_size(), 1'000'000);
  ASSERT_TRUE(call.SendData(1'000'000, input.substr(1'000'000)));
  call.ReadAll();
  EXPECT_EQ(call.mesh, "mesh") << call.status.error_message();
}

TEST_F(MeshCallTest, JobGoesOnWhenTheStreamIsCutAndTheCallRepeatedFindsIt) {
  const std::string go = folder_ / "go";
  auto request = Inline("progress 1; until " + go + "; succeed mesh;");
  request.mutable_submit()->set_request_id(kRequestId);
  std::string name;
  {
    MeshCall call(mesher_.get());
    ASSERT_TRUE(call.Send(request));
    name = call.ReadUntilRunning();
    ASSERT_NE(name, "");
  }
  EXPECT_EQ(Get(name).state(), Job::RUNNING);
  std::ofstream(go) << "x";
  MeshCall again(mesher_.get());
  ASSERT_TRUE(again.Send(request));
  again.ReadAll();
  EXPECT_EQ(again.job.name(), name);
  EXPECT_EQ(again.mesh, "mesh");
  EXPECT_EQ(JobCount(), 1u);
}

TEST_F(MeshCallTest, CutStreamCancelsTheJobWhereTheCallerWantsThat) {
  auto request = Inline("progress 1; sleep 600000;");
  request.set_cancel_with_stream(true);
  std::string name;
  {
    MeshCall call(mesher_.get());
    ASSERT_TRUE(call.Send(request));
    name = call.ReadUntilRunning();
    ASSERT_NE(name, "");
  }
  EXPECT_TRUE(Reaches(name, Job::CANCELLED));
}

TEST_F(MeshCallTest, ServerThatStopsDoesNotCancelTheJob) {
  auto request = Inline("progress 1; sleep 600000;");
  request.set_cancel_with_stream(true);
  MeshCall call(mesher_.get());
  ASSERT_TRUE(call.Send(request));
  const std::string name = call.ReadUntilRunning();
  ASSERT_NE(name, "");
  server_->Stop(absl::Now());
  call.ReadAll();
  EXPECT_EQ(call.status.error_code(), grpc::StatusCode::UNAVAILABLE);
  EXPECT_EQ(Get(name).state(), Job::QUEUED);
  EXPECT_FALSE(Get(name).cancel_requested());
}

TEST_F(MeshCallTest, DownloadThatWasCutGoesOnAsAnOrdinaryOne) {
  MeshCall call(mesher_.get());
  ASSERT_TRUE(call.Send(Inline("large 9000000;")));
  MeshResponse response;
  std::string bytes;
  Job job;
  while (bytes.empty() && call.Read(&response)) {
    if (response.watch().has_job()) job = response.watch().job();
    bytes = response.mesh().data();
  }
  ASSERT_FALSE(bytes.empty());
  call.Cut();
  grpc::ClientContext context;
  amhex::v1::ReadBlobRequest read;
  *read.mutable_blob() = job.result().mesh();
  read.set_offset(static_cast<int64_t>(bytes.size()));
  auto stream = blobs_->ReadBlob(&context, read);
  for (amhex::v1::ReadBlobResponse chunk; stream->Read(&chunk);) bytes += chunk.data();
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(Sha256Hex(bytes), job.result().mesh().sha256());
}

// Streams that end at every moment leave no upload, watcher or job behind that counts.
TEST_F(MeshCallTest, ManyCutStreamsLeaveTheServerWhole) {
  const std::string input = ScriptInput("progress 1; sleep 5; succeed mesh;");
  for (int round = 0; round < 60; ++round) {
    MeshCall call(mesher_.get());
    auto first = Named(input);
    first.mutable_submit()->clear_request_id();
    first.mutable_submit()->set_skip_cache(true);
    call.Send(first);
    MeshResponse response;
    if (round % 6 > 0) call.Read(&response);
    if (round % 6 > 1 && !response.upload().complete()) call.SendData(0, input);
    for (int i = 2; i < round % 6; ++i) call.Read(&response);
    call.Cut();
  }
  MeshCall call(mesher_.get());
  ASSERT_TRUE(call.Send(Inline("succeed mesh;")));
  call.ReadAll();
  EXPECT_EQ(call.mesh, "mesh") << call.status.error_message();
  EXPECT_TRUE(Eventually([&] { return server_->manager().metrics().watchers.Value() == 0; }));
}

}  // namespace
}  // namespace amhex::server
