// ListJobs over a real channel: pages, their tokens, and requests as large as messages may be.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "request_checks.h"
#include "scripted_server_fixture.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;

class ListTest : public ScriptedServerTest {
 protected:
  void SetUp() override { Start(); }

  void Submit(const amhex::v1::SubmitJobRequest& request) {
    grpc::ClientContext context;
    amhex::v1::SubmitJobResponse response;
    const grpc::Status status = mesher_->SubmitJob(&context, request, &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
  }

  grpc::Status List(const amhex::v1::ListJobsRequest& request,
                    amhex::v1::ListJobsResponse* response) {
    grpc::ClientContext context;
    return mesher_->ListJobs(&context, request, response);
  }

  // The numbers of jobs of all pages.
  std::vector<int> PageSizes(amhex::v1::ListJobsRequest request) {
    std::vector<int> sizes;
    do {
      amhex::v1::ListJobsResponse response;
      const grpc::Status status = List(request, &response);
      EXPECT_TRUE(status.ok()) << status.error_message();
      sizes.push_back(response.jobs_size());
      request.set_page_token(response.next_page_token());
    } while (!request.page_token().empty());
    return sizes;
  }
};

TEST_F(ListTest, PagesCoverAllJobsAndTokensAreBoundToTheirFilters) {
  for (int i = 0; i < 5; ++i) Submit(ScriptRequest("succeed mesh;"));
  amhex::v1::ListJobsRequest request;
  request.set_page_size(2);
  EXPECT_EQ(PageSizes(request), (std::vector<int>{2, 2, 1}));
  amhex::v1::ListJobsResponse response;
  ASSERT_TRUE(List(request, &response).ok());
  request.set_page_token(response.next_page_token());
  request.add_states(Job::QUEUED);
  EXPECT_EQ(List(request, &response).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST_F(ListTest, PagesOfLargeJobsFitIntoAMessage) {
  constexpr int kLargeJobs = 300;  // of 16 KiB of labels each: more than a message holds
  amhex::v1::SubmitJobRequest large = ScriptRequest("succeed mesh;");
  for (int i = 0; i < options_.limits.max_label_count; ++i) {
    std::string key = std::to_string(i);
    key.resize(static_cast<size_t>(options_.limits.max_label_bytes), 'k');
    (*large.mutable_labels())[key] = key;
  }
  for (int i = 0; i < kLargeJobs; ++i) Submit(large);
  amhex::v1::ListJobsRequest request;
  request.set_page_size(options_.limits.max_page_size);
  const std::vector<int> sizes = PageSizes(request);
  ASSERT_EQ(sizes.size(), 2u);
  EXPECT_EQ(sizes[0] + sizes[1], kLargeJobs);
}

TEST_F(ListTest, StateNamedMillionsOfTimesIsLookedForOnce) {
  for (int i = 0; i < 2; ++i) Submit(ScriptRequest("succeed mesh;"));
  amhex::v1::ListJobsRequest request;
  request.set_page_size(1);
  request.add_states(Job::RUNNING);
  for (int i = 0; i < 4'000'000; ++i) {
    request.add_states(i % 2 == 0 ? Job::QUEUED : Job::SUCCEEDED);
  }
  const auto query = CheckList(request, options_.limits);
  ASSERT_TRUE(query.ok()) << query.status();
  EXPECT_EQ(query->states, (std::vector<Job::State>{Job::RUNNING, Job::QUEUED, Job::SUCCEEDED}));
  EXPECT_EQ(PageSizes(request), (std::vector<int>{1, 1}));
}

}  // namespace
}  // namespace amhex::server
