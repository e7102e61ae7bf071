#include "blob_service.h"

#include "blob_reactors.h"
#include "grpc_status.h"
#include "request_checks.h"

namespace amhex::server {

grpc::ServerReadReactor<amhex::v1::WriteBlobRequest>* BlobService::WriteBlob(
    grpc::CallbackServerContext*, amhex::v1::WriteBlobResponse* response) {
  return new WriteBlobReactor(response, manager_, executor_);
}

grpc::ServerUnaryReactor* BlobService::QueryWriteStatus(
    grpc::CallbackServerContext* context, const amhex::v1::QueryWriteStatusRequest* request,
    amhex::v1::QueryWriteStatusResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  executor_->Post([this, reactor, request, response] {
    const absl::Status status = CheckBlobRef(request->blob());
    if (status.ok()) {
      const std::string& sha256 = request->blob().sha256();
      response->set_complete(manager_->blobs().Contains(sha256));
      response->set_committed_size(manager_->blobs().CommittedSize(sha256));
    }
    reactor->Finish(ToGrpc(status));
  });
  return reactor;
}

grpc::ServerWriteReactor<amhex::v1::ReadBlobResponse>* BlobService::ReadBlob(
    grpc::CallbackServerContext*, const amhex::v1::ReadBlobRequest* request) {
  return new ReadBlobReactor(*request, manager_, executor_);
}

grpc::ServerUnaryReactor* BlobService::FindMissingBlobs(
    grpc::CallbackServerContext* context, const amhex::v1::FindMissingBlobsRequest* request,
    amhex::v1::FindMissingBlobsResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  executor_->Post([this, reactor, request, response] {
    const absl::Status status = CheckFindMissing(*request);
    if (status.ok()) {
      for (const auto& blob : request->blobs()) {
        if (manager_->blobs().Contains(blob.sha256())) {
          manager_->blobs().Touch(blob.sha256());
        } else {
          *response->add_missing_blobs() = blob;
        }
      }
    }
    reactor->Finish(ToGrpc(status));
  });
  return reactor;
}

}  // namespace amhex::server
