// Jobs on the real worker: decoding, meshing, and everything that users do wrong.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "amhex/v1/meshing_service.grpc.pb.h"
#include "errors.h"
#include "files.h"
#include "hull_arrays.h"
#include "job.h"
#include "job_id.h"
#include "job_manager.h"
#include "mesh_codec.h"
#include "server.h"
#include "service_fixtures.h"
#include "status_macros.h"
#include "surface_codec.h"
#include "worker_pool.h"
#include "worker_process.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

constexpr absl::Duration kMeshingPatience = absl::Seconds(90);
constexpr int64_t kCubeCells = 64;

TriangleMesh Cube() {
  const auto hull = DecodeInput(amhex::v1::INPUT_ENCODING_ARRAYS, CubeInput(), Limits());
  return hull.ok() ? std::get<TriangleMesh>(hull->hull) : TriangleMesh();
}

class RealWorkerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    options_.listen = {"unix:" + (folder_ / "amhex.sock")};
    options_.metrics_listen = "";
    options_.ephemeral = true;
    options_.worker = AMHEX_REAL_WORKER;
    auto created = Server::Create(options_);
    ASSERT_TRUE(created.ok()) << created.status();
    server_ = *std::move(created);
  }

  JobManager& manager() { return server_->manager(); }

  amhex::v1::SubmitJobRequest Request(const InputHull& hull, int64_t cell_count = kCubeCells) {
    amhex::v1::SubmitJobRequest request;
    request.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
    request.set_inline_input(EncodeHullArrays({hull, {}}));
    request.mutable_params()->mutable_sizing()->set_cell_count(cell_count);
    return request;
  }

  std::string Submit(const amhex::v1::SubmitJobRequest& request) {
    const auto job = manager().Submit(Everyone(), request);
    EXPECT_TRUE(job.ok()) << job.status();
    return job.ok() ? JobIdFromName(job->name()) : "";
  }

  Job Run(const amhex::v1::SubmitJobRequest& request) {
    const std::string id = Submit(request);
    EXPECT_TRUE(Eventually([&] { return IsFinal(manager().Get(Everyone(), id)->state()); },
                           kMeshingPatience));
    return *manager().Get(Everyone(), id);
  }

  std::string FailureOf(const InputHull& hull) {
    const Job job = Run(Request(hull));
    EXPECT_EQ(job.state(), Job::FAILED);
    EXPECT_EQ(job.attempt_count(), 1);
    return ReasonOf(job.error());
  }

  TemporaryFolder folder_;
  ServerOptions options_;
  std::unique_ptr<Server> server_;
};

TEST_F(RealWorkerTest, CubeBecomesAMeshWithEveryStageReportedOnce) {
  const auto request = Request(Cube());
  const Job job = Run(request);
  ASSERT_EQ(job.state(), Job::SUCCEEDED) << job.error().message();
  const auto bytes = ReadWholeFile(manager().PathOfBlob(job.result().mesh().sha256()));
  ASSERT_TRUE(bytes.ok());
  const auto mesh = DecodeMesh(*bytes);
  ASSERT_TRUE(mesh.ok()) << mesh.status();
  EXPECT_EQ(static_cast<int64_t>(mesh->corners.size()), job.result().statistics().cell_count());
  EXPECT_NEAR(job.result().statistics().volume(), 1.0, 0.05);
  ASSERT_EQ(job.stages_size(), amhex::v1::Stage_MAX);
  for (int i = 0; i < job.stages_size(); ++i) {
    const amhex::v1::StageReport& stage = job.stages(i);
    EXPECT_EQ(stage.stage(), i + 1);
    EXPECT_TRUE(stage.has_wall_duration());
    EXPECT_FALSE(stage.has_device_duration());  // on the CPU
    EXPECT_GT(stage.peak_memory_bytes(), 1 << 20);
    const int64_t moved = stage.stage() == amhex::v1::STAGE_DECODE_INPUT
                              ? static_cast<int64_t>(request.inline_input().size())
                          : stage.stage() == amhex::v1::STAGE_ENCODE_RESULT
                              ? static_cast<int64_t>(bytes->size())
                              : 0;
    EXPECT_EQ(stage.io_bytes(), moved) << Stage_Name(stage.stage());
  }
}

TEST_F(RealWorkerTest, EffectiveParametersReproduceTheMesh) {
  auto request = Request(Cube());
  const Job first = Run(request);
  ASSERT_EQ(first.state(), Job::SUCCEEDED) << first.error().message();
  *request.mutable_params() = first.result().effective_params();
  const Job second = Run(request);
  ASSERT_EQ(second.state(), Job::SUCCEEDED) << second.error().message();
  EXPECT_EQ(first.result().mesh().sha256(), second.result().mesh().sha256());
}

TEST_F(RealWorkerTest, CoordinateThatIsNoNumberFailsWithTheReason) {
  TriangleMesh cube = Cube();
  cube.vertices[3].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(FailureOf(cube), "INPUT_INVALID");
}

TEST_F(RealWorkerTest, SurfaceWithoutVolumeFailsWithTheReason) {
  TriangleMesh flat = Cube();
  for (Vec3d& vertex : flat.vertices) vertex.z = 0;
  EXPECT_EQ(FailureOf(flat), "INPUT_INVALID");
  EXPECT_EQ(FailureOf(TriangleMesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}),
            "INPUT_INVALID");
  EXPECT_EQ(FailureOf(PointCloud{{{1, 2, 3}}, {}}), "INPUT_INVALID");
}

TEST_F(RealWorkerTest, DamagedDracoFileFailsWithTheReason) {
  amhex::v1::SubmitJobRequest request;
  request.set_inline_input(DracoFileHeader(2, 2, 1, 1) + '\0' + Varint(50) + Varint(90) + '\1' +
                           Varint(85) + Varint(0) + std::string(200, '\x5a'));
  const Job job = Run(request);
  EXPECT_EQ(job.state(), Job::FAILED);
  EXPECT_EQ(ReasonOf(job.error()), "INPUT_MALFORMED");
  EXPECT_EQ(job.failed_stage(), amhex::v1::STAGE_DECODE_INPUT);
}

TEST_F(RealWorkerTest, CancelFreesTheWorker) {
  const std::string id = Submit(Request(Cube(), 100'000));
  ASSERT_TRUE(Eventually([&] {
    return manager().Get(Everyone(), id)->progress().stage() >= amhex::v1::STAGE_CHECK_INPUT;
  }));
  ASSERT_TRUE(manager().Cancel(Everyone(), id).ok());
  ASSERT_TRUE(Eventually([&] { return IsFinal(manager().Get(Everyone(), id)->state()); }));
  EXPECT_EQ(manager().Get(Everyone(), id)->state(), Job::CANCELLED);
  EXPECT_EQ(Run(Request(Cube())).state(), Job::SUCCEEDED);
}

TEST_F(RealWorkerTest, RunTimeoutEndsTheJob) {
  auto request = Request(Cube(), 1'000'000);
  request.mutable_run_timeout()->set_nanos(200'000'000);
  const Job job = Run(request);
  EXPECT_EQ(job.state(), Job::FAILED);
  EXPECT_EQ(ReasonOf(job.error()), "RUN_TIMEOUT");
}

TEST_F(RealWorkerTest, EstimateNamesCellsMemoryAndTime) {
  const auto input = manager().AdmitInputOfEstimate(Everyone(), Request(Cube()));
  ASSERT_TRUE(input.ok());
  amhex::worker::RunJob order;
  order.set_input_path(manager().PathOfBlob(input->blob.sha256()));
  order.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
  const Limits limits;
  order.mutable_input_limits()->set_max_point_count(limits.max_point_count);
  order.mutable_input_limits()->set_max_triangle_count(limits.max_triangle_count);
  order.mutable_params()->mutable_sizing()->set_cell_count(1000);
  const auto estimate = server_->pool().Estimate(order);
  ASSERT_TRUE(estimate.ok()) << estimate.status();
  EXPECT_GT(estimate->cell_count(), 0);
  EXPECT_GT(estimate->memory_bytes(), 0);
  EXPECT_GT(estimate->duration().seconds() + estimate->duration().nanos(), 0);
}

// What a worker says of a job in the end.
absl::Status Verdict(WorkerProcess* worker, const amhex::worker::RunJob& order) {
  amhex::worker::ToWorker frame;
  *frame.mutable_run() = order;
  AMHEX_RETURN_IF_ERROR(worker->channel().Send(frame));
  while (true) {
    amhex::worker::FromWorker news;
    AMHEX_ASSIGN_OR_RETURN(const auto outcome, worker->channel().Receive(&news, kMeshingPatience));
    if (outcome != FrameChannel::Outcome::kFrame) return absl::DeadlineExceededError("silence");
    if (news.has_finished()) return FromRpcStatus(news.finished().error());
  }
}

TEST(WorkerMemory, JobBeyondTheLimitFailsWithItsReasonAndTheWorkerGoesOn) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizers take more memory than any limit";
#endif
  constexpr int64_t kLimitBytes = int64_t{1} << 30;
  constexpr int64_t kPoints =
      45'000'000;  // as many bytes as the limit has, and those of the worker
  const TemporaryFolder folder;
  const std::string path = folder / "input";
  ASSERT_TRUE(WriteFileAtomically(path, std::string("AMHEXHUL") + LittleEndian(1, 4) +
                                            LittleEndian(0, 4) + LittleEndian(kPoints, 8) +
                                            LittleEndian(0, 8))
                  .ok());
  std::filesystem::resize_file(path, 32 + 24 * kPoints);  // takes no room on disk
  auto worker = WorkerProcess::Start({AMHEX_REAL_WORKER, kLimitBytes}, kMeshingPatience);
  ASSERT_TRUE(worker.ok()) << worker.status();
  amhex::worker::RunJob order;
  order.set_input_path(path);
  order.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
  order.mutable_input_limits()->set_max_point_count(kPoints);
  order.set_output_path(folder / "mesh");
  const absl::Status verdict = Verdict(worker->get(), order);
  EXPECT_EQ(verdict.code(), absl::StatusCode::kResourceExhausted) << verdict;
  EXPECT_EQ(ReasonOf(verdict), "OUT_OF_MEMORY");
  ASSERT_TRUE(WriteFileAtomically(path, CubeInput()).ok());
  order.mutable_input_limits()->set_max_triangle_count(kPoints);
  order.mutable_params()->mutable_sizing()->set_cell_count(kCubeCells);
  const absl::Status after = Verdict(worker->get(), order);
  EXPECT_TRUE(after.ok()) << after;
}

}  // namespace
}  // namespace amhex::server
