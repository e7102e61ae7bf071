#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <variant>

#include "amhex/client.h"
#include "cli/exit_codes.h"
#include "cli/json.h"
#include "cli/load_input.h"
#include "cli/progress_display.h"
#include "cli/report.h"
#include "cli/shared_flags.h"
#include "demo/shapes.h"
#include "demo/surface.h"
#include "formats/hull_writer.h"
#include "google/rpc/error_details.pb.h"

namespace amhex::client {
namespace {

namespace v1 = amhex::v1;
using ::testing::HasSubstr;
using ::testing::Not;

v1::Job DoneJob() {
  v1::Job job;
  job.set_name("jobs/one");
  job.set_state(v1::Job::SUCCEEDED);
  v1::MeshStatistics* statistics = job.mutable_result()->mutable_statistics();
  statistics->set_cell_count(12);
  statistics->set_vertex_count(30);
  statistics->set_hexahedra_volume_ratio(0.9);
  v1::CellTypeCount* count = statistics->add_cells_by_type();
  count->set_type(v1::CELL_TYPE_HEXAHEDRON);
  count->set_cell_count(9);
  count = statistics->add_cells_by_type();
  count->set_type(v1::CELL_TYPE_PRISM);
  count->set_cell_count(3);
  job.mutable_result()->mutable_effective_params()->mutable_sizing()->set_cell_count(10);
  job.mutable_result()->add_warnings("the input has \"holes\"\nclosed");
  v1::StageReport* stage = job.add_stages();
  stage->set_stage(v1::STAGE_MATCH_AND_MERGE);
  stage->mutable_wall_duration()->set_seconds(1);
  stage->mutable_wall_duration()->set_nanos(250'000'000);
  return job;
}

TEST(ExitCodes, FollowTheReasonBeforeTheCode) {
  google::rpc::ErrorInfo info;
  info.set_reason("NO_VALID_MESH");
  absl::Status status = absl::InternalError("x");
  EXPECT_EQ(ExitCodeOf(status), kExitFault);
  status.SetPayload("type.googleapis.com/google.rpc.ErrorInfo",
                    absl::Cord(info.SerializeAsString()));
  EXPECT_EQ(ExitCodeOf(status), kExitNoMesh);
}

TEST(Progress, GuessesTheRestOfAStageFromItsSpeed) {
  EXPECT_EQ(DescribeRemaining(0.25, absl::Seconds(10)), "this stage about 30 s more");
  EXPECT_EQ(DescribeRemaining(0.01, absl::Seconds(10)), "");
  EXPECT_EQ(DescribeRemaining(0.5, absl::Seconds(1)), "");
  EXPECT_EQ(DescribeRemaining(1, absl::Seconds(10)), "");
}

TEST(ExitCodes, TellTheCausesApart) {
  EXPECT_EQ(ExitCodeOf(absl::OkStatus()), 0);
  EXPECT_EQ(ExitCodeOf(absl::InvalidArgumentError("")), 3);
  EXPECT_EQ(ExitCodeOf(absl::UnavailableError("")), 4);
  EXPECT_EQ(ExitCodeOf(absl::ResourceExhaustedError("")), 6);
  EXPECT_EQ(ExitCodeOf(absl::DeadlineExceededError("")), 6);
  EXPECT_EQ(ExitCodeOf(absl::DataLossError("")), 8);
  EXPECT_EQ(ExitCodeOf(absl::UnauthenticatedError("")), 11);
  EXPECT_EQ(ExitCodeOf(absl::PermissionDeniedError("")), 11);
  EXPECT_EQ(ExitCodeOf(absl::NotFoundError("")), 9);
  EXPECT_EQ(ExitCodeOf(absl::FailedPreconditionError("")), 10);
  EXPECT_EQ(ExitCodeOf(absl::CancelledError("")), 130);
}

TEST(Json, KeepsWholeNumbersAndNamesStagesAndTypes) {
  const std::string json = JsonOf(DoneJob(), {"a.drc", "8 points", "Draco"}, 2.5);
  EXPECT_THAT(json, HasSubstr("\"cell_count\": 12"));
  EXPECT_THAT(json, HasSubstr("\"hexahedron\": 9"));
  EXPECT_THAT(json, HasSubstr("\"tetrahedron\": 0"));
  EXPECT_THAT(json, HasSubstr("\"stage\": \"match_and_merge\""));
  EXPECT_THAT(json, HasSubstr("\"wall_seconds\": 1.25"));
  EXPECT_THAT(json, HasSubstr("\"state\": \"succeeded\""));
}

TEST(Json, EscapesTexts) {
  EXPECT_EQ(JsonString("a\"b\\c\nd\x01"), "\"a\\\"b\\\\c\\nd\\u0001\"");
  EXPECT_THAT(JsonOf(DoneJob(), {}, 0), HasSubstr("the input has \\\"holes\\\"\\nclosed"));
}

TEST(Json, OfAFailedJobHoldsTheError) {
  v1::Job job;
  job.set_state(v1::Job::FAILED);
  job.mutable_error()->set_code(3);
  job.mutable_error()->set_message("flat");
  const std::string json = JsonOf(job, {}, 0);
  EXPECT_THAT(json, HasSubstr("\"code\": \"INVALID_ARGUMENT\""));
  EXPECT_THAT(json, HasSubstr("\"message\": \"flat\""));
  EXPECT_THAT(json, Not(HasSubstr("statistics")));
}

TEST(Facts, HoldStatisticsParametersAndTimings) {
  const auto facts = FactsOfJob(DoneJob());
  const auto number = [&](const std::string& name) {
    for (const MeshFact& fact : facts) {
      if (fact.name == name) return std::get<double>(fact.value);
    }
    return -1.0;
  };
  EXPECT_EQ(number("statistics.cell_count"), 12);
  EXPECT_EQ(number("statistics.cells_by_type.prism"), 3);
  EXPECT_EQ(number("parameters.sizing.cell_count"), 10);
  EXPECT_EQ(number("timings.match_and_merge"), 1.25);
}

TEST(Summary, NamesCellsAndWarnings) {
  const std::string summary = SummaryOf(DoneJob());
  EXPECT_THAT(summary, HasSubstr("12 cells, 30 vertices"));
  EXPECT_THAT(summary, HasSubstr("75.0 %"));
  EXPECT_THAT(summary, HasSubstr("warning: the input has \"holes\""));
}

TEST(Progress, SaysWhatIsKnown) {
  v1::Progress progress;
  progress.set_iteration(60);
  progress.set_iteration_count(150);
  progress.set_mean_movement(0.0125);
  progress.set_cell_count(200);
  progress.set_hexahedron_count(150);
  EXPECT_EQ(DescribeProgress(progress),
            "iteration 60/150, movement 0.0125, 150 of 200 cells hexahedra so far (75.0 %)");
  EXPECT_EQ(DescribeProgress(v1::Progress()), "");
  EXPECT_EQ(StageWords(v1::STAGE_MATCH_AND_MERGE), "match and merge");
}

// Every field of MeshingParams must be reachable from the command line.
int CountSetFields(const google::protobuf::Message& message) {
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  message.GetReflection()->ListFields(message, &fields);
  int count = 0;
  for (const auto* field : fields) {
    const bool is_group = field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE;
    count += is_group ? CountSetFields(message.GetReflection()->GetMessage(message, field)) : 1;
  }
  return count;
}

int CountFields(const google::protobuf::Descriptor* descriptor) {
  int count = 0;
  for (int i = 0; i < descriptor->field_count(); ++i) {
    const auto* field = descriptor->field(i);
    const bool is_group = field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE;
    count += is_group ? CountFields(field->message_type()) : 1;
  }
  return count;
}

v1::MeshingParams Parse(const std::string& line) {
  CLI::App app;
  ParameterFlags flags;
  AddParameterFlags(&app, &flags);
  app.parse(line);
  return ParamsFrom(app, flags);
}

TEST(ParameterFlags, ReachEveryParameter) {
  const v1::MeshingParams params = Parse(
      "--cells 9 --trials 3 --sharp-angle 40 --initialization grid --iterations 7 --lattice-points "
      "64 "
      "--regularity-weight 0.5 --split-limit 9 --jitter 0.1 --min-quality 0.3 --extraction paper "
      "--backend cpu --threads 2 --seed 5 --memory-limit 1000000 --volume-use hull");
  // All but edge_length, which excludes cell_count.
  EXPECT_EQ(CountSetFields(params), CountFields(v1::MeshingParams::descriptor()) - 1);
  EXPECT_EQ(Parse("--edge-length 2.5").sizing().edge_length(), 2.5);
}

TEST(ParameterFlags, SetNothingThatWasNotGiven) { EXPECT_EQ(CountSetFields(Parse("")), 0); }

TEST(JobNames, MayBeGivenWithoutTheirPrefix) {
  EXPECT_EQ(FullJobName("abc"), "jobs/abc");
  EXPECT_EQ(FullJobName("jobs/abc"), "jobs/abc");
}

class LoadInputTest : public ::testing::Test {
 protected:
  // A folder of this process's own: tests run side by side.
  LoadInputTest()
      : folder_(std::filesystem::temp_directory_path() /
                ("amhex_load_input_test_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~LoadInputTest() override { std::filesystem::remove_all(folder_); }

  std::string Write(const std::string& name, const std::string& bytes) {
    const std::string path = (folder_ / name).string();
    EXPECT_TRUE(WriteWholeFile(path, bytes).ok());
    return path;
  }
  std::string WriteCube(const std::string& name, const Vec3d& origin) {
    TriangleMesh cube = *ContourShape(*MakeShape("cube"), 8);
    for (Vec3d& v : cube.vertices) v += origin;
    const std::string path = (folder_ / name).string();
    EXPECT_TRUE(WriteHullFile(cube, path).ok());
    return path;
  }

  std::filesystem::path folder_;
};

TEST_F(LoadInputTest, DracoFilesTravelAsTheyAre) {
  const std::string path = WriteCube("cube.drc", {});
  const auto input = LoadInput(path, {});
  ASSERT_TRUE(input.ok()) << input.status();
  EXPECT_EQ(input->encoded.bytes, *ReadWholeFile(path));
  EXPECT_EQ(input->encoded.encoding, v1::INPUT_ENCODING_DRACO);
}

TEST_F(LoadInputTest, FinerCellsMakeFinerEncodings) {
  const std::string path = WriteCube("cube.obj", {});
  v1::SizingParams coarse, fine;
  coarse.set_cell_count(100);
  fine.set_cell_count(1'000'000);
  const auto coarse_input = LoadInput(path, coarse), fine_input = LoadInput(path, fine);
  ASSERT_TRUE(coarse_input.ok() && fine_input.ok());
  EXPECT_LT(coarse_input->encoded.bytes.size(), fine_input->encoded.bytes.size());
}

TEST_F(LoadInputTest, FarFromTheOriginArraysOfDoublesTravel) {
  const auto input = LoadInput(WriteCube("cube.ply", {1e9, 0, 0}), {});
  ASSERT_TRUE(input.ok()) << input.status();
  EXPECT_EQ(input->encoded.encoding, v1::INPUT_ENCODING_ARRAYS);
  EXPECT_EQ(input->encoded.bytes.substr(0, 8), "AMHEXHUL");
  EXPECT_THAT(input->note.encoding, HasSubstr("64-bit"));
}

TEST_F(LoadInputTest, DamagedFilesAreNamedWithTheirPath) {
  const std::string path = Write("part.stl", "solid\nfacet\n");
  EXPECT_THAT(std::string(LoadInput(path, {}).status().message()), HasSubstr("part.stl: "));
  EXPECT_THAT(std::string(LoadInput(Write("e.drc", ""), {}).status().message()),
              HasSubstr("the file is empty"));
}

TEST(EncodeArrays, HasTheLengthThatTheProtoPromises) {
  EXPECT_EQ(EncodeArrays({PointCloud{{{1, 2, 3}}, {{0, 0, 1}}}, {}}).size(), 32u + 24 + 24);
  EXPECT_EQ(EncodeArrays({TriangleMesh{{{}, {}, {}}, {{0, 1, 2}}}, {}}).size(), 32u + 72 + 12);
}

}  // namespace
}  // namespace amhex::client
