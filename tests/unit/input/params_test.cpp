#include "amhex/params.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>

namespace amhex {
namespace {

using ::testing::HasSubstr;

std::string MessageFor(const MeshingParams& params) {
  return std::string(Validate(params).message());
}

TEST(ValidateParams, DefaultsArePermitted) { EXPECT_TRUE(Validate(MeshingParams{}).ok()); }

TEST(ValidateParams, RangesIncludeTheirEnds) {
  MeshingParams params;
  params.sizing.cell_count = 20'000'000;
  params.sizing.trial_count = 12;
  params.input.sharp_angle_degrees = 180;
  params.relaxation.iteration_count = 1000;
  params.relaxation.lattice_points_per_site = 8;
  params.relaxation.regularity_weight = 0;
  params.relaxation.split_limit = 26;
  params.relaxation.jitter = 0.5;
  params.assembly.min_quality = 0.01;
  params.run.thread_count = 1024;
  EXPECT_TRUE(Validate(params).ok()) << MessageFor(params);
}

TEST(ValidateParams, ABadFieldIsNamedWithValueAndRange) {
  MeshingParams params;
  params.relaxation.split_limit = 27;
  EXPECT_EQ(Validate(params).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(MessageFor(params), HasSubstr("relaxation.split_limit is 27"));
  EXPECT_THAT(MessageFor(params), HasSubstr("[7, 26]"));
}

TEST(ValidateParams, AllBadFieldsAreNamedAtOnce) {
  MeshingParams params;
  params.sizing.cell_count = -1;
  params.sizing.trial_count = 13;
  params.input.sharp_angle_degrees = 5;
  params.relaxation.initialization = static_cast<Initialization>(3);
  params.relaxation.iteration_count = -2;
  params.relaxation.lattice_points_per_site = 5000;
  params.relaxation.regularity_weight = 1.5;
  params.relaxation.jitter = -0.1;
  params.assembly.min_quality = 0;
  params.run.backend = static_cast<Backend>(9);
  params.run.thread_count = 2000;
  params.run.memory_limit_bytes = -5;
  for (const char* field :
       {"sizing.cell_count", "sizing.trial_count", "input.sharp_angle_degrees",
        "relaxation.initialization", "relaxation.iteration_count",
        "relaxation.lattice_points_per_site", "relaxation.regularity_weight", "relaxation.jitter",
        "assembly.min_quality", "run.backend", "run.thread_count", "run.memory_limit_bytes"}) {
    EXPECT_THAT(MessageFor(params), HasSubstr(field));
  }
}

TEST(ValidateParams, NumbersThatAreNoneAreRefusedEverywhere) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  MeshingParams params;
  params.sizing.edge_length = nan;
  params.input.sharp_angle_degrees = nan;
  params.relaxation.regularity_weight = nan;
  params.assembly.min_quality = nan;
  const std::string message = MessageFor(params);
  EXPECT_THAT(message, HasSubstr("sizing.edge_length"));
  EXPECT_THAT(message, HasSubstr("input.sharp_angle_degrees"));
  EXPECT_THAT(message, HasSubstr("relaxation.regularity_weight"));
  EXPECT_THAT(message, HasSubstr("assembly.min_quality"));
}

TEST(ValidateParams, AnInfiniteEdgeLengthIsRefused) {
  MeshingParams params;
  params.sizing.edge_length = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(Validate(params).ok());
}

TEST(ValidateParams, CellCountAndEdgeLengthExcludeEachOther) {
  MeshingParams params;
  params.sizing.cell_count = 1000;
  params.sizing.edge_length = 0.1;
  EXPECT_THAT(MessageFor(params), HasSubstr("at most one"));
}

}  // namespace
}  // namespace amhex
