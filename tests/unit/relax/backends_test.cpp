#include "backends.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "absl/strings/match.h"
#include "amhex/mesher.h"
#include "fixtures/solids.h"

namespace amhex {
namespace {

using ::testing::AnyOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;

bool EndsWithMissing(const std::string& note) {
  return absl::EndsWith(note, "; no CUDA library is installed");
}

TEST(Backends, TheCpuIsAlwaysThere) {
  const auto choice = ChooseBackend(Backend::kCpu);
  ASSERT_TRUE(choice.ok());
  EXPECT_EQ(choice->backend, Backend::kCpu);
  EXPECT_THAT(choice->note, HasSubstr("cpu ("));
}

TEST(Backends, ARunOnOneThreadSaysSo) {
  MeshingParams params;
  params.sizing.cell_count = 20;
  params.run.backend = Backend::kCpu;
  params.run.thread_count = 1;
  RunContext run;
  const auto result = Mesh(InputHull(fixtures::MakeBox({1, 1, 1}, 0.5)), params, run);
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->backend_note, "cpu (1 thread)");
}

TEST(Backends, AutoSaysWhatItChoseAndWhy) {
  const auto choice = ChooseBackend(Backend::kAuto);
  ASSERT_TRUE(choice.ok());
  if (choice->backend == Backend::kCpu) {
    EXPECT_THAT(choice->note,
                AnyOf(HasSubstr("; cuda not used: "), EndsWith("; no CUDA library is installed")));
  } else {
    EXPECT_THAT(choice->note, HasSubstr("cuda"));
  }
}

TEST(Backends, TheLoadersWordsAreForThoseWhoAskForCuda) {
  const auto automatic = ChooseBackend(Backend::kAuto);
  ASSERT_TRUE(automatic.ok());
  if (!EndsWithMissing(automatic->note)) GTEST_SKIP() << "a CUDA library is there";
  const auto cuda = ChooseBackend(Backend::kCuda);
  EXPECT_THAT(std::string(cuda.status().message()), HasSubstr("cannot open shared object file"));
  EXPECT_THAT(ListBackends().back().description, HasSubstr("cannot open shared object file"));
}

TEST(Backends, CudaIsListedAsAvailableExactlyWhenItCanBeChosen) {
  const auto choice = ChooseBackend(Backend::kCuda);
  bool is_listed = false;
  for (const BackendInfo& info : ListBackends()) {
    if (info.backend == Backend::kCuda) is_listed = info.available;
  }
  EXPECT_EQ(choice.ok(), is_listed);
  if (!choice.ok()) {
    EXPECT_EQ(choice.status().code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(choice.status().message()), HasSubstr("run.backend"));
  }
}

TEST(EngineVersion, NamesTheProgramAndItsRevision) {
  EXPECT_THAT(EngineVersion(), HasSubstr("amhex "));
  EXPECT_THAT(EngineVersion(), Not(HasSubstr("()")));
}

}  // namespace
}  // namespace amhex
