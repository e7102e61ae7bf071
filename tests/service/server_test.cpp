// The service over a real channel, with scripted workers.
#include "server.h"

#include <google/protobuf/descriptor.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <thread>

#include "amhex/v1/blob_service.grpc.pb.h"
#include "amhex/v1/meshing_service.grpc.pb.h"
#include "error_reason.h"
#include "job.h"
#include "job_manager.h"
#include "scripted_server_fixture.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

class ServerTest : public ScriptedServerTest {
 protected:
  void SetUp() override { Start(); }

  grpc::Status Submit(const amhex::v1::SubmitJobRequest& request, Job* job) {
    grpc::ClientContext context;
    amhex::v1::SubmitJobResponse response;
    const grpc::Status status = mesher_->SubmitJob(&context, request, &response);
    *job = response.job();
    return status;
  }

  std::string SubmitScript(const std::string& script) {
    Job job;
    const grpc::Status status = Submit(ScriptRequest(script), &job);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return job.name();
  }

  // Watches to the end; returns the frames and checks that their numbers grow.
  std::vector<amhex::v1::WatchJobResponse> Watch(const std::string& name, int64_t after_seq = 0) {
    grpc::ClientContext context;
    amhex::v1::WatchJobRequest request;
    request.set_name(name);
    request.set_after_seq(after_seq);
    auto stream = mesher_->WatchJob(&context, request);
    std::vector<amhex::v1::WatchJobResponse> frames;
    for (amhex::v1::WatchJobResponse frame; stream->Read(&frame);) {
      if (!frames.empty()) EXPECT_GT(frame.seq(), frames.back().seq());
      frames.push_back(frame);
    }
    watch_status_ = stream->Finish();
    return frames;
  }

  Job Finish(const std::string& name) {
    const auto frames = Watch(name);
    EXPECT_TRUE(watch_status_.ok()) << watch_status_.error_message();
    return frames.empty() ? Job() : frames.back().job();
  }

  std::string Read(const std::string& sha256, int64_t offset = 0, int64_t limit = 0) {
    grpc::ClientContext context;
    amhex::v1::ReadBlobRequest request;
    request.mutable_blob()->set_sha256(sha256);
    request.set_offset(offset);
    request.set_limit(limit);
    auto stream = blobs_->ReadBlob(&context, request);
    std::string bytes;
    for (amhex::v1::ReadBlobResponse chunk; stream->Read(&chunk);) bytes += chunk.data();
    read_status_ = stream->Finish();
    return bytes;
  }

  // Writes `bytes` from `offset` on in chunks of `chunk_bytes`; `finish` ends the blob.
  grpc::Status Write(const amhex::v1::BlobRef& blob, const std::string& bytes, size_t offset,
                     size_t chunk_bytes, bool finish, amhex::v1::WriteBlobResponse* response) {
    grpc::ClientContext context;
    auto stream = blobs_->WriteBlob(&context, response);
    amhex::v1::WriteBlobRequest chunk;
    *chunk.mutable_blob() = blob;
    do {
      chunk.set_offset(static_cast<int64_t>(offset));
      chunk.set_data(bytes.substr(offset, chunk_bytes));
      offset += chunk.data().size();
      chunk.set_finish(finish && offset == bytes.size());
      if (!stream->Write(chunk)) break;
    } while (offset < bytes.size());
    stream->WritesDone();
    return stream->Finish();
  }

  grpc::Status watch_status_;
  grpc::Status read_status_;
};

amhex::v1::BlobRef RefOf(const std::string& bytes) {
  amhex::v1::BlobRef blob;
  blob.set_sha256(Sha256Hex(bytes));
  blob.set_size_bytes(static_cast<int64_t>(bytes.size()));
  return blob;
}

TEST_F(ServerTest, JobIsSubmittedWatchedAndFetched) {
  const std::string name = SubmitScript("progress 1; stage; succeed mesh;");
  const auto frames = Watch(name);
  ASSERT_TRUE(watch_status_.ok()) << watch_status_.error_message();
  ASSERT_GE(frames.size(), 1u);
  EXPECT_TRUE(frames.front().has_job());
  const Job& job = frames.back().job();
  ASSERT_EQ(job.state(), Job::SUCCEEDED);
  EXPECT_EQ(job.stages_size(), 1);
  EXPECT_EQ(Read(job.result().mesh().sha256()), "mesh");
}

TEST_F(ServerTest, AllBadFieldsAreNamedAtOnce) {
  amhex::v1::SubmitJobRequest request;
  request.set_request_id("not a uuid");
  request.set_priority(101);
  request.mutable_params()->mutable_sizing()->set_cell_count(-1);
  request.mutable_params()->mutable_relaxation()->set_split_limit(1000);
  request.mutable_params()->mutable_run()->set_seed(-5);
  request.mutable_run_timeout()->set_seconds(-1);
  request.mutable_ttl()->set_seconds(int64_t{1} << 60);
  Job job;
  const grpc::Status status = Submit(request, &job);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Reason(status), "BAD_REQUEST");
  const std::vector<std::string> fields = BadFields(status);
  for (const char* field : {"request_id", "priority", "params.sizing.cell_count", "ttl", "input",
                            "params.relaxation.split_limit", "params.run.seed", "run_timeout"}) {
    EXPECT_NE(std::find(fields.begin(), fields.end(), field), fields.end()) << field;
  }
}

TEST_F(ServerTest, SpanWhoseNanosecondsAreASecondOrMoreIsRefused) {
  const int32_t second = 1'000'000'000;
  for (const int32_t nanos : {std::numeric_limits<int32_t>::min(), -second, second,
                              std::numeric_limits<int32_t>::max()}) {
    auto request = ScriptRequest("succeed mesh;");
    request.mutable_run_timeout()->set_seconds(60);
    request.mutable_run_timeout()->set_nanos(nanos);
    Job job;
    const grpc::Status status = Submit(request, &job);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << nanos;
    EXPECT_EQ(BadFields(status), std::vector<std::string>{"run_timeout"}) << nanos;
  }
}

TEST_F(ServerTest, InlineInputsEndAtTheLimitThatIsTold) {
  const auto limit = static_cast<size_t>(options_.limits.max_inline_input_bytes);
  const std::string script = "succeed mesh;";
  const std::string padding(limit - ScriptInput(script).size(), ' ');
  auto request = ScriptRequest(script);
  Job job;
  request.set_inline_input(ScriptInput(script + padding));
  ASSERT_LE(request.inline_input().size(), limit);
  EXPECT_TRUE(Submit(request, &job).ok());
  request.set_inline_input(std::string(limit + 1, ' '));
  EXPECT_EQ(BadFields(Submit(request, &job)), std::vector<std::string>{"inline_input"});
}

TEST_F(ServerTest, BlobsNamedWithAnotherSizeThanTheyHaveAreRefused) {
  const std::string bytes = ScriptInput("succeed mesh;");
  amhex::v1::WriteBlobResponse written;
  ASSERT_TRUE(Write(RefOf(bytes), bytes, 0, bytes.size(), true, &written).ok());
  for (const int64_t wrong : {int64_t{1}, int64_t{-1}, written.committed_size() + 1}) {
    auto blob = RefOf(bytes);
    blob.set_size_bytes(wrong);
    grpc::ClientContext read_context, query_context, find_context;
    amhex::v1::ReadBlobRequest read;
    *read.mutable_blob() = blob;
    const auto stream = blobs_->ReadBlob(&read_context, read);
    amhex::v1::ReadBlobResponse chunk;
    EXPECT_FALSE(stream->Read(&chunk));
    const std::vector<std::string> of_blob = {"blob.size_bytes"};
    EXPECT_EQ(BadFields(stream->Finish()), of_blob);
    amhex::v1::QueryWriteStatusRequest query;
    *query.mutable_blob() = blob;
    amhex::v1::QueryWriteStatusResponse status;
    EXPECT_EQ(BadFields(blobs_->QueryWriteStatus(&query_context, query, &status)), of_blob);
    EXPECT_EQ(BadFields(Write(blob, bytes, 0, bytes.size(), true, &written)), of_blob);
    amhex::v1::FindMissingBlobsRequest find;
    *find.add_blobs() = RefOf(bytes);
    *find.add_blobs() = blob;
    amhex::v1::FindMissingBlobsResponse missing;
    EXPECT_EQ(BadFields(blobs_->FindMissingBlobs(&find_context, find, &missing)),
              std::vector<std::string>{"blobs[1].size_bytes"});
    amhex::v1::SubmitJobRequest submit;
    submit.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
    *submit.mutable_input_blob() = blob;
    Job job;
    EXPECT_EQ(BadFields(Submit(submit, &job)), std::vector<std::string>{"input_blob.size_bytes"});
  }
}

TEST_F(ServerTest, RepeatedRequestIdGivesTheSameJob) {
  auto request = ScriptRequest("succeed mesh;");
  request.set_request_id("6f9619ff-8b86-4011-b42d-00c04fc964ff");
  Job first;
  Job second;
  ASSERT_TRUE(Submit(request, &first).ok());
  ASSERT_TRUE(Submit(request, &second).ok());
  EXPECT_EQ(first.name(), second.name());
  request.set_priority(1);
  const grpc::Status status = Submit(request, &second);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::ALREADY_EXISTS);
  EXPECT_EQ(Reason(status), "REQUEST_ID_REUSED");
}

TEST_F(ServerTest, ValidateOnlyEstimatesAndMakesNoJob) {
  auto request = ScriptRequest("succeed mesh;");
  request.set_validate_only(true);
  grpc::ClientContext context;
  amhex::v1::SubmitJobResponse response;
  const grpc::Status status = mesher_->SubmitJob(&context, request, &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_FALSE(response.has_job());
  EXPECT_EQ(response.estimate().cell_count(), 42);
}

TEST_F(ServerTest, UnknownAndMalformedNamesAreToldApart) {
  for (const auto& [name, code] :
       {std::pair{"jobs/018f0000-0000-7000-8000-000000000000", grpc::StatusCode::NOT_FOUND},
        std::pair{"jobs/1", grpc::StatusCode::INVALID_ARGUMENT},
        std::pair{"", grpc::StatusCode::INVALID_ARGUMENT}}) {
    grpc::ClientContext get_context;
    amhex::v1::GetJobRequest get;
    get.set_name(name);
    Job job;
    EXPECT_EQ(mesher_->GetJob(&get_context, get, &job).error_code(), code) << name;
    Watch(name);
    EXPECT_EQ(watch_status_.error_code(), code) << name;
    grpc::ClientContext cancel_context;
    amhex::v1::CancelJobRequest cancel;
    cancel.set_name(name);
    EXPECT_EQ(mesher_->CancelJob(&cancel_context, cancel, &job).error_code(), code) << name;
  }
}

TEST_F(ServerTest, WatchEndsAfterCancel) {
  const std::string name = SubmitScript("progress 7; sleep 60000;");
  std::thread canceller([&] {
    EXPECT_TRUE(Eventually(
        [&] { return server_->manager().Get(Everyone(), name.substr(5))->has_progress(); }));
    grpc::ClientContext context;
    amhex::v1::CancelJobRequest cancel;
    cancel.set_name(name);
    Job job;
    EXPECT_TRUE(mesher_->CancelJob(&context, cancel, &job).ok());
  });
  EXPECT_EQ(Finish(name).state(), Job::CANCELLED);
  canceller.join();
}

TEST_F(ServerTest, EndingAWatchLeavesTheJobRunning) {
  const std::string name = SubmitScript("progress 1; sleep 200; succeed mesh;");
  {
    grpc::ClientContext context;
    amhex::v1::WatchJobRequest request;
    request.set_name(name);
    auto stream = mesher_->WatchJob(&context, request);
    amhex::v1::WatchJobResponse frame;
    ASSERT_TRUE(stream->Read(&frame));
    context.TryCancel();
    EXPECT_FALSE(stream->Finish().ok());
  }
  EXPECT_EQ(Finish(name).state(), Job::SUCCEEDED);
}

TEST_F(ServerTest, BrokenUploadIsContinuedAndSubmitted) {
  const std::string bytes = ScriptInput("succeed mesh; " + std::string(3'000'000, ' '));
  const auto blob = RefOf(bytes);
  amhex::v1::WriteBlobResponse written;
  const std::string half = bytes.substr(0, bytes.size() / 2);
  ASSERT_TRUE(Write(blob, half, 0, 100'000, false, &written).ok());
  EXPECT_EQ(written.committed_size(), static_cast<int64_t>(half.size()));
  EXPECT_FALSE(written.complete());
  grpc::ClientContext context;
  amhex::v1::QueryWriteStatusRequest query;
  *query.mutable_blob() = blob;
  amhex::v1::QueryWriteStatusResponse status;
  ASSERT_TRUE(blobs_->QueryWriteStatus(&context, query, &status).ok());
  ASSERT_EQ(status.committed_size(), written.committed_size());
  ASSERT_TRUE(Write(blob, bytes, half.size(), 1'000'000, true, &written).ok());
  EXPECT_TRUE(written.complete());
  amhex::v1::SubmitJobRequest request;
  *request.mutable_input_blob() = blob;
  request.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
  Job job;
  ASSERT_TRUE(Submit(request, &job).ok());
  EXPECT_EQ(Finish(job.name()).state(), Job::SUCCEEDED);
}

TEST_F(ServerTest, ReadsContinueAtAnyByte) {
  std::string bytes(2'500'000, ' ');
  for (size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i % 251);
  amhex::v1::WriteBlobResponse written;
  ASSERT_TRUE(Write(RefOf(bytes), bytes, 0, 1'000'000, true, &written).ok());
  const std::string sha256 = RefOf(bytes).sha256();
  EXPECT_EQ(Read(sha256), bytes);
  EXPECT_EQ(Read(sha256, 1'234'567), bytes.substr(1'234'567));
  EXPECT_EQ(Read(sha256, 1'234'567, 10), bytes.substr(1'234'567, 10));
  EXPECT_EQ(Read(sha256, static_cast<int64_t>(bytes.size())), "");
  EXPECT_TRUE(read_status_.ok());
  Read(sha256, static_cast<int64_t>(bytes.size()) + 1);
  EXPECT_EQ(read_status_.error_code(), grpc::StatusCode::OUT_OF_RANGE);
  Read(std::string(64, '0'));
  EXPECT_EQ(read_status_.error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(ServerTest, FindMissingNamesOnlyWhatIsMissing) {
  const std::string bytes = "stored";
  amhex::v1::WriteBlobResponse written;
  ASSERT_TRUE(Write(RefOf(bytes), bytes, 0, 10, true, &written).ok());
  grpc::ClientContext context;
  amhex::v1::FindMissingBlobsRequest request;
  *request.add_blobs() = RefOf(bytes);
  *request.add_blobs() = RefOf("absent");
  amhex::v1::FindMissingBlobsResponse response;
  ASSERT_TRUE(blobs_->FindMissingBlobs(&context, request, &response).ok());
  ASSERT_EQ(response.missing_blobs_size(), 1);
  EXPECT_EQ(response.missing_blobs(0).sha256(), RefOf("absent").sha256());
}

TEST_F(ServerTest, CapabilitiesTellLimitsAndWorkers) {
  amhex::v1::Capabilities capabilities;
  ASSERT_TRUE(Eventually([&] {
    grpc::ClientContext context;
    return mesher_->GetCapabilities(&context, {}, &capabilities).ok() &&
           capabilities.worker_count() == 1;
  }));
  EXPECT_EQ(capabilities.limits().SerializeAsString(),
            ToProto(options_.limits).SerializeAsString());
  EXPECT_EQ(capabilities.engine_version(), "scripted");
  ASSERT_EQ(capabilities.backends_size(), 1);
}

// What reflection answers to one request. Debian does not install its proto: requests are written
// by hand, and of an answer it is enough to find names in it.
std::string Reflect(const std::shared_ptr<grpc::Channel>& channel, const std::string& request) {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
  grpc::CompletionQueue queue;
  const auto wait = [&queue] {
    void* tag = nullptr;
    bool ok = false;
    return queue.Next(&tag, &ok) && ok;
  };
  auto call = stub.PrepareCall(
      &context, "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", &queue);
  call->StartCall(nullptr);
  wait();
  grpc::Slice slice(request);
  call->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
  wait();
  grpc::ByteBuffer response;
  call->Read(&response, nullptr);
  wait();
  grpc::Slice answer;
  EXPECT_TRUE(response.DumpToSingleSlice(&answer).ok());
  grpc::Status status;
  call->Finish(&status, nullptr);
  wait();
  return std::string(answer.begin(), answer.end());
}

TEST_F(ServerTest, ReflectionTellsTheServicesAndTheirCalls) {
  constexpr char kListServices = 7 << 3 | 2, kFileContainingSymbol = 4 << 3 | 2;
  const std::string services = Reflect(channel_, {kListServices, 0});
  for (const std::string name : {"amhex.v1.Mesher", "amhex.v1.Blobs"}) {
    EXPECT_NE(services.find(name), std::string::npos) << name;
    const std::string file = Reflect(
        channel_, std::string{kFileContainingSymbol, static_cast<char>(name.size())} + name);
    const auto* descriptor =
        google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(name);
    ASSERT_NE(descriptor, nullptr);
    for (int i = 0; i < descriptor->method_count(); ++i) {
      EXPECT_NE(file.find(descriptor->method(i)->name()), std::string::npos);
    }
  }
}

TEST_F(ServerTest, StopEndsStreamsAndTheNextServerContinuesTheJob) {
  const std::string name = SubmitScript("progress 7; sleep 60000;");
  std::thread stopper([&] {
    EXPECT_TRUE(Eventually(
        [&] { return server_->manager().Get(Everyone(), name.substr(5))->has_progress(); }));
    server_->Stop(absl::Now());
  });
  const auto frames = Watch(name);
  stopper.join();
  EXPECT_EQ(watch_status_.error_code(), grpc::StatusCode::UNAVAILABLE);
  ASSERT_FALSE(frames.empty());
  server_.reset();
  Start();
  grpc::ClientContext context;
  amhex::v1::WatchJobRequest request;
  request.set_name(name);
  request.set_after_seq(frames.back().seq());
  auto stream = mesher_->WatchJob(&context, request);
  amhex::v1::WatchJobResponse frame;
  ASSERT_TRUE(stream->Read(&frame));
  EXPECT_GT(frame.seq(), frames.back().seq());
  EXPECT_FALSE(IsFinal(frame.job().state()));
  context.TryCancel();
  stream->Finish();
}

TEST_F(ServerTest, OldConnectionsTakeNoNewCallsAndKeepThoseUnderWay) {
  server_.reset();
  options_.limits.max_connection_age = absl::Milliseconds(200);
  Start();
  const std::string go = folder_ / "go";
  const std::string name = SubmitScript("progress 1; until " + go + "; succeed mesh;");
  grpc::ClientContext context;
  amhex::v1::WatchJobRequest request;
  request.set_name(name);
  const auto stream = mesher_->WatchJob(&context, request);
  amhex::v1::WatchJobResponse frame;
  ASSERT_TRUE(stream->Read(&frame));
  for (int connection = 0; connection < 3; ++connection) {
    EXPECT_TRUE(Eventually([&] { return channel_->GetState(false) != GRPC_CHANNEL_READY; }));
    grpc::ClientContext call;
    amhex::v1::ListJobsResponse jobs;
    EXPECT_TRUE(mesher_->ListJobs(&call, {}, &jobs).ok());
    EXPECT_EQ(jobs.jobs_size(), 1);
  }
  std::ofstream(go) << "x";
  while (stream->Read(&frame)) {
  }
  EXPECT_TRUE(stream->Finish().ok());
  EXPECT_EQ(frame.job().state(), Job::SUCCEEDED);
}

TEST_F(ServerTest, SecondServerOnTheSameFolderIsRefused) {
  EXPECT_EQ(Server::Create(options_).status().code(), absl::StatusCode::kFailedPrecondition);
}

TEST_F(ServerTest, TakenAddressIsRefused) {
  ServerOptions second = options_;
  second.data_dir = folder_ / "other";
  second.listen = server_->addresses();
  EXPECT_EQ(Server::Create(second).status().code(), absl::StatusCode::kUnavailable);
}

TEST_F(ServerTest, UnixSocketServesToo) {
  server_.reset();
  options_.listen = {"unix:" + (folder_ / "amhex.sock")};
  Start();
  EXPECT_EQ(Finish(SubmitScript("succeed mesh;")).state(), Job::SUCCEEDED);
}

TEST_F(ServerTest, EphemeralServerLeavesNothingBehind) {
  server_.reset();
  options_.ephemeral = true;
  options_.data_dir = folder_ / "unused";
  Start();
  EXPECT_EQ(Finish(SubmitScript("succeed mesh;")).state(), Job::SUCCEEDED);
  server_.reset();
  EXPECT_FALSE(std::filesystem::exists(folder_ / "unused"));
}

}  // namespace
}  // namespace amhex::server
