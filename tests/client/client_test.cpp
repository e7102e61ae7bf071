#include "amhex/client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <thread>

#include "absl/time/clock.h"
#include "fake_service.h"
#include "rpc/digest.h"
#include "test_cells.h"

namespace amhex::client {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::string Bytes(size_t count) {
  std::string bytes;
  for (size_t i = 0; i < count; ++i) bytes += static_cast<char>(i * 31 + i / 256);
  return bytes;
}

v1::WatchJobResponse StateFrame(v1::Job::State state) {
  v1::WatchJobResponse frame;
  frame.mutable_job()->set_name("jobs/one");
  frame.mutable_job()->set_state(state);
  return frame;
}

v1::WatchJobResponse ProgressFrame(int iteration) {
  v1::WatchJobResponse frame;
  frame.mutable_progress()->set_iteration(iteration);
  return frame;
}

// MESH_ENCODING_ARRAYS as geometry.proto describes it.
std::string EncodeForTest(const AtMostHexaMesh& mesh) {
  std::string bytes = "AMHEXVOL";
  const auto append = [&bytes](const void* data, size_t size) {
    bytes.append(static_cast<const char*>(data), size);
  };
  const int32_t version[] = {1, 0};
  const int64_t counts[] = {static_cast<int64_t>(mesh.vertices.size()),
                            static_cast<int64_t>(mesh.corners.size())};
  append(version, sizeof(version));
  append(counts, sizeof(counts));
  append(mesh.vertices.data(), mesh.vertices.size() * sizeof(Vec3d));
  append(mesh.corners.data(), mesh.corners.size() * sizeof(CellCorners));
  append(mesh.quality.data(), mesh.quality.size() * sizeof(float));
  append(mesh.types.data(), mesh.types.size());
  return bytes;
}

v1::MeshingResult ResultFor(const AtMostHexaMesh& mesh, const std::string& bytes) {
  v1::MeshingResult result;
  result.set_encoding(v1::MESH_ENCODING_ARRAYS);
  result.mutable_mesh()->set_sha256(Sha256Hex(bytes));
  result.mutable_mesh()->set_size_bytes(static_cast<int64_t>(bytes.size()));
  result.mutable_statistics()->set_cell_count(static_cast<int64_t>(mesh.corners.size()));
  result.mutable_statistics()->set_vertex_count(static_cast<int64_t>(mesh.vertices.size()));
  return result;
}

// The frames of a job that succeeds with `mesh`, which the fake server then holds.
void PlaySuccess(const AtMostHexaMesh& mesh, FakeServer* server) {
  const std::string bytes = EncodeForTest(mesh);
  server->mesher.mesh = bytes;
  server->blobs.stored[Sha256Hex(bytes)] = bytes;
  auto last = StateFrame(v1::Job::SUCCEEDED);
  *last.mutable_job()->mutable_result() = ResultFor(mesh, bytes);
  server->mesher.frames = {StateFrame(v1::Job::RUNNING), ProgressFrame(1), ProgressFrame(2), last};
}

class ClientTest : public ::testing::Test {
 protected:
  FakeServer server_;
  Client client_{{.address = server_.address, .patience = absl::Seconds(20)}};
};

TEST_F(ClientTest, UploadsGoOnWhereTheyBrokeOff) {
  const std::string bytes = Bytes(12'345);
  server_.blobs.bytes_per_stream = 3000;
  const auto blob = client_.Upload(bytes);
  ASSERT_TRUE(blob.ok()) << blob.status();
  EXPECT_EQ(server_.blobs.stored[blob->sha256()], bytes);
  EXPECT_GT(server_.blobs.write_streams, 3);
  EXPECT_EQ(server_.blobs.bytes_received, 12'345) << "no byte travels twice";
}

TEST_F(ClientTest, WhatTheServerHasIsNotUploadedAgain) {
  const std::string bytes = Bytes(5000);
  ASSERT_TRUE(client_.Upload(bytes).ok());
  ASSERT_TRUE(client_.Upload(bytes).ok());
  EXPECT_EQ(server_.blobs.write_streams, 1);
}

TEST_F(ClientTest, DownloadsGoOnWhereTheyBrokeOff) {
  const std::string bytes = Bytes(12'345);
  v1::BlobRef blob;
  blob.set_sha256(Sha256Hex(bytes));
  blob.set_size_bytes(12'345);
  server_.blobs.stored[blob.sha256()] = bytes;
  server_.blobs.bytes_per_stream = 3000;
  const auto downloaded = client_.Download(blob);
  ASSERT_TRUE(downloaded.ok()) << downloaded.status();
  EXPECT_EQ(*downloaded, bytes);
  EXPECT_GT(server_.blobs.read_streams, 3);
}

TEST_F(ClientTest, DamagedDownloadsAreDataLoss) {
  const std::string bytes = Bytes(2500);
  v1::BlobRef blob;
  blob.set_sha256(Sha256Hex(bytes));
  blob.set_size_bytes(2500);
  server_.blobs.stored[blob.sha256()] = bytes;
  server_.blobs.corrupts = true;
  EXPECT_EQ(client_.Download(blob).status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(ClientTest, DownloadsLongerThanAnnouncedAreDataLoss) {
  v1::BlobRef blob;
  blob.set_sha256(std::string(64, 'a'));
  blob.set_size_bytes(10);
  server_.blobs.stored[blob.sha256()] = Bytes(5000);
  EXPECT_EQ(client_.Download(blob).status().code(), absl::StatusCode::kDataLoss);
}

TEST_F(ClientTest, MissingBlobsKeepTheirReason) {
  v1::BlobRef blob;
  blob.set_sha256(std::string(64, 'b'));
  blob.set_size_bytes(10);
  const auto downloaded = client_.Download(blob);
  EXPECT_EQ(downloaded.status().code(), absl::StatusCode::kNotFound);
  EXPECT_EQ(ReasonOf(downloaded.status()), "BLOB_NOT_FOUND");
}

TEST_F(ClientTest, SmallInputsTravelInlineAndLargeOnesAsBlobs) {
  const auto small = client_.Submit({v1::INPUT_ENCODING_DRACO, Bytes(100)}, {});
  ASSERT_TRUE(small.ok()) << small.status();
  EXPECT_EQ(server_.mesher.last_submission.inline_input(), Bytes(100));
  const auto large = client_.Submit({v1::INPUT_ENCODING_DRACO, Bytes(101)}, {});
  ASSERT_TRUE(large.ok()) << large.status();
  EXPECT_EQ(server_.mesher.last_submission.input_blob().sha256(), Sha256Hex(Bytes(101)));
}

TEST_F(ClientTest, RepeatedSubmissionsCarryTheSameRequestId) {
  server_.mesher.busy_submissions = 2;
  SubmitOptions options;
  options.request_id = "3f1c9a52-6d34-4d4e-9d0e-0a8f7f2f6c11";
  const auto job = client_.Submit({v1::INPUT_ENCODING_DRACO, "bytes"}, {}, options);
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(server_.mesher.submissions, 3);
  EXPECT_EQ(server_.mesher.last_submission.request_id(), options.request_id);
}

TEST_F(ClientTest, CallsThatTheServerHadNoRoomForAreRepeated) {
  server_.mesher.busy_submissions = 2;
  server_.mesher.busy = {grpc::StatusCode::RESOURCE_EXHAUSTED, "Received RST_STREAM with code 11"};
  const auto job = client_.Submit({v1::INPUT_ENCODING_DRACO, "bytes"}, {});
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(server_.mesher.submissions, 3);
}

TEST_F(ClientTest, LimitsThatStayAreNotTriedAgain) {
  server_.mesher.busy_submissions = 1000;
  for (const grpc::Status& limit :
       {ErrorWithReason(grpc::StatusCode::RESOURCE_EXHAUSTED, "STORAGE_FULL"),
        grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED,
                     "Received message larger than max (9 vs. 4)"),
        grpc::Status(grpc::StatusCode::RESOURCE_EXHAUSTED,
                     "received initial metadata size exceeds limit (9 vs. 4)")}) {
    server_.mesher.submissions = 0;
    server_.mesher.busy = limit;
    const auto job = client_.Submit({v1::INPUT_ENCODING_DRACO, "bytes"}, {});
    EXPECT_EQ(job.status().code(), absl::StatusCode::kResourceExhausted) << job.status();
    EXPECT_EQ(server_.mesher.submissions, 1) << limit.error_message();
  }
}

TEST(Client, AServerThatHasNoRoomIsNamed) {
  FakeServer server;
  Client client({.address = server.address, .patience = absl::Milliseconds(300)});
  server.mesher.busy_submissions = 1000;
  server.mesher.busy = {grpc::StatusCode::RESOURCE_EXHAUSTED, "Received RST_STREAM with code 11"};
  const auto job = client.Submit({v1::INPUT_ENCODING_DRACO, "bytes"}, {});
  EXPECT_EQ(job.status().code(), absl::StatusCode::kResourceExhausted);
  EXPECT_THAT(std::string(job.status().message()), HasSubstr(server.address));
  EXPECT_GT(server.mesher.submissions, 1);
}

// Patience is for what does not move.
TEST(Client, UploadsThatTakeLongerThanPatienceGoOnWhereTheyBrokeOff) {
  FakeServer server;
  Client client({.address = server.address, .patience = absl::Milliseconds(700)});
  server.blobs.bytes_per_stream = 10'000;
  server.blobs.milliseconds_per_chunk = 100;
  const std::string bytes = Bytes(15'000);
  const auto blob = client.Upload(bytes);
  ASSERT_TRUE(blob.ok()) << blob.status();
  EXPECT_EQ(server.blobs.write_streams, 2);
  EXPECT_EQ(server.blobs.bytes_received, 15'000) << "no byte travels twice";
}

TEST_F(ClientTest, WatchingGoesOnAfterTheLastFrameSeen) {
  server_.mesher.frames = {StateFrame(v1::Job::QUEUED),
                           StateFrame(v1::Job::RUNNING),
                           ProgressFrame(1),
                           ProgressFrame(2),
                           ProgressFrame(3),
                           StateFrame(v1::Job::SUCCEEDED)};
  server_.mesher.frames_per_stream = 2;
  std::vector<int64_t> seen;
  int reconnections = 0;
  WatchOptions options;
  options.on_frame = [&](const v1::WatchJobResponse& frame) { seen.push_back(frame.seq()); };
  options.on_reconnect = [&](const absl::Status&) { ++reconnections; };
  const auto job = client_.Watch("one", options);
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->state(), v1::Job::SUCCEEDED);
  EXPECT_THAT(seen, ElementsAre(1, 2, 3, 4, 5, 6));
  EXPECT_EQ(reconnections, 2);
}

TEST_F(ClientTest, FailedJobsAreGivenAndCarryTheirError) {
  v1::WatchJobResponse frame = StateFrame(v1::Job::FAILED);
  google::rpc::ErrorInfo info;
  info.set_reason("NO_VALID_MESH");
  frame.mutable_job()->mutable_error()->set_code(13);
  frame.mutable_job()->mutable_error()->set_message("near (1, 2, 3)");
  frame.mutable_job()->mutable_error()->add_details()->PackFrom(info);
  server_.mesher.frames = {frame};
  const auto job = client_.Watch("jobs/one", {});
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(ErrorOf(*job).code(), absl::StatusCode::kInternal);
  EXPECT_EQ(ReasonOf(ErrorOf(*job)), "NO_VALID_MESH");
}

TEST(Client, AWatchThatFallsSilentIsBegunAnewWhereItWas) {
  FakeServer server;
  server.mesher.frames = {StateFrame(v1::Job::RUNNING), ProgressFrame(1),
                          StateFrame(v1::Job::SUCCEEDED)};
  server.mesher.silent_streams = 2;
  Client client({.address = server.address, .longest_silence = absl::Milliseconds(100)});
  std::vector<int64_t> seen;
  WatchOptions options;
  options.on_frame = [&](const v1::WatchJobResponse& frame) { seen.push_back(frame.seq()); };
  const auto job = client.Watch("one", options);
  ASSERT_TRUE(job.ok()) << job.status();
  EXPECT_EQ(job->state(), v1::Job::SUCCEEDED);
  EXPECT_EQ(seen, (std::vector<int64_t>{1, 2, 3}));
  EXPECT_EQ(server.mesher.watch_streams, 3);
}

TEST(Client, TransfersThatFallSilentAreBegunAnewWhereTheyWere) {
  FakeServer server;
  server.blobs.silent_streams = 2;
  Client client({.address = server.address, .longest_silence = absl::Milliseconds(100)});
  const std::string bytes = Bytes(5000);
  const auto blob = client.Upload(bytes);
  ASSERT_TRUE(blob.ok()) << blob.status();
  EXPECT_EQ(server.blobs.stored[blob->sha256()], bytes);
  EXPECT_GE(server.blobs.write_streams, 3);
  const auto read = client.Download(*blob);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(*read, bytes);
  EXPECT_GE(server.blobs.read_streams, 3);
}

TEST(Client, OneCallThatFallsSilentIsTakenUpByOrdinaryCalls) {
  const AtMostHexaMesh mesh = Block(3, 1);
  FakeServer server;
  PlaySuccess(mesh, &server);
  server.mesher.silent_streams = 1;
  Client client({.address = server.address, .longest_silence = absl::Milliseconds(100)});
  const auto meshed = client.Mesh({v1::INPUT_ENCODING_DRACO, "small"}, {});
  ASSERT_TRUE(meshed.ok()) << meshed.status();
  EXPECT_EQ(meshed->mesh.corners, mesh.corners);
  EXPECT_EQ(server.mesher.mesh_streams, 1);
  EXPECT_GE(server.mesher.watch_streams, 1);
}

TEST(Client, AnInterruptEndsWatchingSoon) {
  FakeServer server;
  server.mesher.frames = {StateFrame(v1::Job::RUNNING)};
  server.mesher.hangs = true;
  Interrupt interrupt;
  Client client({.address = server.address, .interrupt = &interrupt});
  std::thread watcher(
      [&] { EXPECT_EQ(client.Watch("one", {}).status().code(), absl::StatusCode::kCancelled); });
  while (server.mesher.watch_streams == 0) absl::SleepFor(absl::Milliseconds(5));
  interrupt.Request();
  watcher.join();
}

TEST(Client, AServerThatIsNotThereIsNamed) {
  Client client({.address = "127.0.0.1:1", .patience = absl::Milliseconds(300)});
  const absl::Status status = client.GetCapabilities().status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_THAT(std::string(status.message()), HasSubstr("127.0.0.1:1 cannot be reached"));
}

TEST_F(ClientTest, MeshesThatPassTheChecksAreGiven) {
  const AtMostHexaMesh mesh = Block(4, 3);
  const std::string bytes = EncodeForTest(mesh);
  server_.blobs.stored[Sha256Hex(bytes)] = bytes;
  const auto fetched = client_.FetchMesh(ResultFor(mesh, bytes));
  ASSERT_TRUE(fetched.ok()) << fetched.status();
  EXPECT_EQ(fetched->vertices, mesh.vertices);
  EXPECT_EQ(fetched->corners, mesh.corners);
  EXPECT_EQ(fetched->types, mesh.types);
  EXPECT_EQ(fetched->quality, mesh.quality);
}

TEST_F(ClientTest, MeshesThatDifferFromTheirStatisticsAreRefused) {
  const AtMostHexaMesh mesh = Block(2, 0);
  const std::string bytes = EncodeForTest(mesh);
  server_.blobs.stored[Sha256Hex(bytes)] = bytes;
  v1::MeshingResult result = ResultFor(mesh, bytes);
  result.mutable_statistics()->set_cell_count(9);
  EXPECT_THAT(std::string(client_.FetchMesh(result).status().message()),
              HasSubstr("8 cells and 27 vertices, but 9"));
  result = ResultFor(mesh, bytes);
  v1::CellTypeCount* count = result.mutable_statistics()->add_cells_by_type();
  count->set_type(v1::CELL_TYPE_HEXAHEDRON);
  count->set_cell_count(7);
  EXPECT_THAT(std::string(client_.FetchMesh(result).status().message()),
              HasSubstr("8 cells of type 8, but 7"));
}

TEST_F(ClientTest, OneCallGivesJobAndMesh) {
  const AtMostHexaMesh mesh = Block(3, 1);
  PlaySuccess(mesh, &server_);
  std::vector<int64_t> seen;
  WatchOptions watch;
  watch.on_frame = [&](const v1::WatchJobResponse& frame) { seen.push_back(frame.seq()); };
  const EncodedInput input{v1::INPUT_ENCODING_DRACO, Bytes(2500)};
  const auto meshed = client_.Mesh(input, {}, {}, watch);
  ASSERT_TRUE(meshed.ok()) << meshed.status();
  EXPECT_EQ(meshed->job.state(), v1::Job::SUCCEEDED);
  EXPECT_EQ(meshed->mesh.corners, mesh.corners);
  EXPECT_EQ(server_.mesher.mesh_input, input.bytes);
  EXPECT_THAT(seen, ElementsAre(1, 2, 3, 4));
  EXPECT_EQ(server_.mesher.mesh_streams, 1);
  EXPECT_EQ(server_.mesher.watch_streams + server_.blobs.read_streams, 0);
}

TEST_F(ClientTest, OneCallThatBreaksInTheUploadIsRepeatedWithTheSameRequestId) {
  PlaySuccess(Block(2, 0), &server_);
  server_.mesher.breaks_in_upload = true;
  SubmitOptions options;
  options.request_id = RandomUuid();
  const EncodedInput input{v1::INPUT_ENCODING_DRACO, Bytes(2500)};
  const auto meshed = client_.Mesh(input, {}, options);
  ASSERT_TRUE(meshed.ok()) << meshed.status();
  EXPECT_EQ(server_.mesher.mesh_streams, 2);
  EXPECT_EQ(server_.mesher.mesh_input, input.bytes);
  EXPECT_EQ(server_.mesher.last_submission.request_id(), options.request_id);
}

TEST_F(ClientTest, OneCallThatBreaksLaterIsTakenUpByOrdinaryCalls) {
  const AtMostHexaMesh mesh = Block(4, 2);
  PlaySuccess(mesh, &server_);
  server_.mesher.frames_per_stream = 2;
  const EncodedInput input{v1::INPUT_ENCODING_DRACO, "small"};
  auto meshed = client_.Mesh(input, {});
  ASSERT_TRUE(meshed.ok()) << meshed.status();
  EXPECT_EQ(meshed->mesh.corners, mesh.corners);
  EXPECT_EQ(server_.mesher.mesh_streams, 1);
  EXPECT_GE(server_.mesher.watch_streams, 1);
  server_.mesher.frames_per_stream = 1000;
  server_.mesher.breaks_in_mesh = true;
  const int reads_before = server_.blobs.read_streams;
  meshed = client_.Mesh(input, {});
  ASSERT_TRUE(meshed.ok()) << meshed.status();
  EXPECT_EQ(meshed->mesh.corners, mesh.corners);
  EXPECT_EQ(server_.blobs.read_streams, reads_before + 1);
}

TEST_F(ClientTest, OneCallGivesAFailedJobAndNoMesh) {
  server_.mesher.frames = {StateFrame(v1::Job::RUNNING), StateFrame(v1::Job::FAILED)};
  const auto meshed = client_.Mesh({v1::INPUT_ENCODING_DRACO, "small"}, {});
  ASSERT_TRUE(meshed.ok()) << meshed.status();
  EXPECT_EQ(meshed->job.state(), v1::Job::FAILED);
  EXPECT_TRUE(meshed->mesh.corners.empty());
}

TEST_F(ClientTest, MeshesThatBreakTheLawAreRefused) {
  AtMostHexaMesh mesh = Block(2, 0);
  std::swap(mesh.vertices[0], mesh.vertices[26]);
  const std::string bytes = EncodeForTest(mesh);
  server_.blobs.stored[Sha256Hex(bytes)] = bytes;
  EXPECT_EQ(client_.FetchMesh(ResultFor(mesh, bytes)).status().code(), absl::StatusCode::kDataLoss);
}

TEST(DecodeMesh, RefusesEveryOtherLength) {
  const std::string bytes = EncodeForTest(Block(2, 0));
  EXPECT_TRUE(DecodeMesh(bytes).ok());
  for (size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_FALSE(DecodeMesh(std::string_view(bytes).substr(0, length)).ok()) << length;
  }
  EXPECT_FALSE(DecodeMesh(bytes + "x").ok());
}

TEST(DecodeMesh, RefusesCountsThatWouldOverflow) {
  std::string bytes = EncodeForTest(Block(2, 0));
  for (size_t offset : {size_t{16}, size_t{24}}) {
    for (int64_t count : {int64_t{-1}, int64_t{1} << 62, int64_t{1} << 59}) {
      std::string damaged = bytes;
      std::memcpy(damaged.data() + offset, &count, sizeof(count));
      EXPECT_FALSE(DecodeMesh(damaged).ok());
    }
  }
}

TEST(Digest, IsSha256) {
  EXPECT_EQ(Sha256Hex("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Digest, UuidsHaveTheirFormAndDiffer) {
  const std::string uuid = RandomUuid();
  EXPECT_THAT(uuid, ::testing::MatchesRegex(
                        "[0-9a-f]{8}-[0-9a-f]{4}-4[0-9a-f]{3}-[89ab][0-9a-f]{3}-[0-9a-f]{12}"));
  EXPECT_NE(uuid, RandomUuid());
}

}  // namespace
}  // namespace amhex::client
