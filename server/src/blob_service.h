// amhex.v1.Blobs: uploads and downloads in chunks.
#pragma once

#include <grpcpp/grpcpp.h>

#include "amhex/v1/blob_service.grpc.pb.h"
#include "authenticator.h"
#include "blocking_executor.h"
#include "job_manager.h"

namespace amhex::server {

// The two calls that carry bytes see messages as they are on the wire (blob_frames.h).
using BlobCallbacks = amhex::v1::Blobs::WithRawCallbackMethod_WriteBlob<
    amhex::v1::Blobs::WithRawCallbackMethod_ReadBlob<
        amhex::v1::Blobs::WithCallbackMethod_QueryWriteStatus<
            amhex::v1::Blobs::WithCallbackMethod_FindMissingBlobs<amhex::v1::Blobs::Service>>>>;

class BlobService final : public BlobCallbacks {
 public:
  // All must outlive the gRPC server.
  BlobService(JobManager* manager, Authenticator* authenticator, BlockingExecutor* executor)
      : manager_(manager), authenticator_(authenticator), executor_(executor) {}

  grpc::ServerReadReactor<grpc::ByteBuffer>* WriteBlob(grpc::CallbackServerContext* context,
                                                       grpc::ByteBuffer* response) override;
  grpc::ServerUnaryReactor* QueryWriteStatus(
      grpc::CallbackServerContext* context, const amhex::v1::QueryWriteStatusRequest* request,
      amhex::v1::QueryWriteStatusResponse* response) override;
  grpc::ServerWriteReactor<grpc::ByteBuffer>* ReadBlob(grpc::CallbackServerContext* context,
                                                       const grpc::ByteBuffer* request) override;
  grpc::ServerUnaryReactor* FindMissingBlobs(
      grpc::CallbackServerContext* context, const amhex::v1::FindMissingBlobsRequest* request,
      amhex::v1::FindMissingBlobsResponse* response) override;

 private:
  JobManager* const manager_;
  Authenticator* const authenticator_;
  BlockingExecutor* const executor_;
};

}  // namespace amhex::server
