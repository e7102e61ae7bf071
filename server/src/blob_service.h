// amhex.v1.Blobs: uploads and downloads in chunks.
#pragma once

#include <grpcpp/grpcpp.h>

#include "amhex/v1/blob_service.grpc.pb.h"
#include "authenticator.h"
#include "blocking_executor.h"
#include "job_manager.h"

namespace amhex::server {

class BlobService final : public amhex::v1::Blobs::CallbackService {
 public:
  // All must outlive the gRPC server.
  BlobService(JobManager* manager, Authenticator* authenticator, BlockingExecutor* executor)
      : manager_(manager), authenticator_(authenticator), executor_(executor) {}

  grpc::ServerReadReactor<amhex::v1::WriteBlobRequest>* WriteBlob(
      grpc::CallbackServerContext* context, amhex::v1::WriteBlobResponse* response) override;
  grpc::ServerUnaryReactor* QueryWriteStatus(
      grpc::CallbackServerContext* context, const amhex::v1::QueryWriteStatusRequest* request,
      amhex::v1::QueryWriteStatusResponse* response) override;
  grpc::ServerWriteReactor<amhex::v1::ReadBlobResponse>* ReadBlob(
      grpc::CallbackServerContext* context, const amhex::v1::ReadBlobRequest* request) override;
  grpc::ServerUnaryReactor* FindMissingBlobs(
      grpc::CallbackServerContext* context, const amhex::v1::FindMissingBlobsRequest* request,
      amhex::v1::FindMissingBlobsResponse* response) override;

 private:
  JobManager* const manager_;
  Authenticator* const authenticator_;
  BlockingExecutor* const executor_;
};

}  // namespace amhex::server
