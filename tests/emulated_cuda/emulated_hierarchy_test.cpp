// What hierarchies over triangles leave behind on a device.
#include <gtest/gtest.h>

#include <cstdint>

#include "base/status_error.h"
#include "cuda/device_use.h"
#include "emulated_cuda/emulated_cuda_fixture.h"
#include "fixtures/solids.h"
#include "input/build_hull.h"
#include "input/hull_queries.h"

namespace amhex {
namespace {

using EmulatedHierarchy = EmulatedDeviceTest;

// One that fails leaves the lane to those that follow, and nothing that is still to arrive.
TEST_F(EmulatedHierarchy, AHierarchyIsFetchedAfterFetchingItHasFailed) {
  const TriangleMesh sphere = fixtures::MakeSphere(2, 0.08);
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  const HullQueries here(sphere.vertices, sphere.triangles);
  const HullQueries first(sphere.vertices, sphere.triangles, {}, &*device, HullAskers::kDevice);
  const HullQueries second(sphere.vertices, sphere.triangles, {}, &*device, HullAskers::kDevice);
  for (const int64_t call : {0, 1, 2, 5, 8}) {
    controls().failing_call = controls().calls + call;
    EXPECT_THROW(first.view(), StatusError) << "call " << call;
    EXPECT_FALSE(first.is_here());
  }
  for (const HullQueries* there : {&second, &first}) {
    EXPECT_EQ(there->Closest({1, 2, 3}).point, here.Closest({1, 2, 3}).point);
  }
}

// Sharp edges, and what a device is asked before there is an edge length, need no copy for the
// host.
TEST_F(EmulatedHierarchy, AHullIsBuiltWithoutTheHostAskingForItsHierarchy) {
  const InputHull input = fixtures::MakeBracket(1, 0.125);
  MeshingParams params;
  RunContext run;
  const auto here = BuildHull(input, params, run);
  ASSERT_TRUE(here.ok()) << here.status();
  params.run.backend = Backend::kCuda;
  const auto there = BuildHull(input, params, run);
  ASSERT_TRUE(there.ok()) << there.status();
  EXPECT_FALSE(there->queries->is_here());
  EXPECT_EQ(there->frame.scale, here->frame.scale);
  EXPECT_EQ(there->patch, here->patch);
  ASSERT_GT(here->sharp_edges.size(), 0U);
  EXPECT_EQ(there->sharp_degree, here->sharp_degree);
}

// The host waits for events, at which a pool gives nothing back.
TEST_F(EmulatedHierarchy, OfWhatATaskHasFreedThePoolKeepsAnEighthOfTheDeviceAtMost) {
  constexpr int64_t kShare = 8;
  const TriangleMesh sphere = fixtures::MakeSphere(2, 0.08);
  auto device = DeviceUse::Choose(Backend::kCuda);
  ASSERT_TRUE(device.ok()) << device.status();
  const auto build = [&] {
    return HullQueries(sphere.vertices, sphere.triangles, {}, &*device, HullAskers::kDevice);
  };
  build();
  const int64_t capacity = 2 * controls().peak;
  device_->Restart();
  controls().capacity = capacity;
  const HullQueries there = build();
  EXPECT_GT(controls().used, capacity / kShare);
  EXPECT_GT(controls().peak - controls().used, capacity / kShare);
  EXPECT_EQ(controls().unused, 0);
}

}  // namespace
}  // namespace amhex
