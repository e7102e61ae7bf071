// amhex.v1.Mesher: each call is checked, given to the JobManager, and answered.
#pragma once

#include <grpcpp/grpcpp.h>

#include <functional>

#include "absl/status/status.h"
#include "amhex/v1/meshing_service.grpc.pb.h"
#include "authenticator.h"
#include "blocking_executor.h"
#include "job_manager.h"
#include "worker_pool.h"

namespace amhex::server {

class MeshingService final : public amhex::v1::Mesher::CallbackService {
 public:
  // All must outlive the gRPC server.
  struct Parts {
    JobManager* manager;
    WorkerPool* pool;
    Authenticator* authenticator;
    BlockingExecutor* executor;
  };
  explicit MeshingService(const Parts& parts)
      : manager_(parts.manager),
        pool_(parts.pool),
        authenticator_(parts.authenticator),
        executor_(parts.executor) {}

  grpc::ServerUnaryReactor* SubmitJob(grpc::CallbackServerContext* context,
                                      const amhex::v1::SubmitJobRequest* request,
                                      amhex::v1::SubmitJobResponse* response) override;
  grpc::ServerUnaryReactor* GetJob(grpc::CallbackServerContext* context,
                                   const amhex::v1::GetJobRequest* request,
                                   amhex::v1::Job* response) override;
  grpc::ServerUnaryReactor* ListJobs(grpc::CallbackServerContext* context,
                                     const amhex::v1::ListJobsRequest* request,
                                     amhex::v1::ListJobsResponse* response) override;
  grpc::ServerWriteReactor<amhex::v1::WatchJobResponse>* WatchJob(
      grpc::CallbackServerContext* context, const amhex::v1::WatchJobRequest* request) override;
  grpc::ServerUnaryReactor* CancelJob(grpc::CallbackServerContext* context,
                                      const amhex::v1::CancelJobRequest* request,
                                      amhex::v1::Job* response) override;
  grpc::ServerUnaryReactor* DeleteJob(grpc::CallbackServerContext* context,
                                      const amhex::v1::DeleteJobRequest* request,
                                      google::protobuf::Empty* response) override;
  grpc::ServerBidiReactor<amhex::v1::MeshRequest, amhex::v1::MeshResponse>* Mesh(
      grpc::CallbackServerContext* context) override;
  grpc::ServerUnaryReactor* GetCapabilities(grpc::CallbackServerContext* context,
                                            const amhex::v1::GetCapabilitiesRequest* request,
                                            amhex::v1::Capabilities* response) override;

 private:
  // Identifies the caller, runs `call` for it on an executor, and finishes with its status.
  struct Order {
    const char* method;  // as in CallRecord
    BlockingExecutor* executor;
    std::initializer_list<Role> roles;
  };
  grpc::ServerUnaryReactor* Answer(grpc::CallbackServerContext* context, const Order& order,
                                   std::function<absl::Status(const Caller&)> call);
  absl::Status Submit(const Caller& caller, const grpc::CallbackServerContext& context,
                      const amhex::v1::SubmitJobRequest& request,
                      amhex::v1::SubmitJobResponse* response);
  absl::StatusOr<amhex::v1::CostEstimate> Estimate(const Caller& caller,
                                                   const amhex::v1::SubmitJobRequest& request);

  static constexpr int kEstimateThreads = 2;

  JobManager* const manager_;
  WorkerPool* const pool_;
  Authenticator* const authenticator_;
  BlockingExecutor* const executor_;
  // Estimates start a worker each and take seconds; they must not hold up other calls.
  BlockingExecutor estimate_executor_{kEstimateThreads};
};

}  // namespace amhex::server
