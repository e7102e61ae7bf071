#include "blob_service.h"

#include "absl/strings/str_cat.h"
#include "blob_reactors.h"
#include "call_record.h"
#include "request_checks.h"
#include "status_macros.h"

namespace amhex::server {

grpc::ServerReadReactor<grpc::ByteBuffer>* BlobService::WriteBlob(
    grpc::CallbackServerContext* context, grpc::ByteBuffer* response) {
  return new WriteBlobReactor(authenticator_->Identify(*context, {Role::kSubmit}), response,
                              manager_, executor_);
}

grpc::ServerUnaryReactor* BlobService::QueryWriteStatus(
    grpc::CallbackServerContext* context, const amhex::v1::QueryWriteStatusRequest* request,
    amhex::v1::QueryWriteStatusResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const CallRecord record(&manager_->metrics(), "amhex.v1.Blobs/QueryWriteStatus");
  executor_->Post([this, context, reactor, record, request, response] {
    const auto answer = [&]() -> absl::Status {
      AMHEX_ASSIGN_OR_RETURN(const Caller caller,
                             authenticator_->Identify(*context, {Role::kSubmit}));
      AMHEX_RETURN_IF_ERROR(CheckBlobRef(request->blob()));
      AMHEX_ASSIGN_OR_RETURN(const auto state, manager_->FindUpload(caller, request->blob()));
      response->set_complete(state.complete);
      response->set_committed_size(state.committed_size);
      return absl::OkStatus();
    };
    reactor->Finish(record.End(answer()));
  });
  return reactor;
}

grpc::ServerWriteReactor<grpc::ByteBuffer>* BlobService::ReadBlob(
    grpc::CallbackServerContext* context, const grpc::ByteBuffer* request) {
  return new ReadBlobReactor(authenticator_->Identify(*context, {Role::kRead, Role::kReadAll}),
                             *request, manager_, executor_);
}

grpc::ServerUnaryReactor* BlobService::FindMissingBlobs(
    grpc::CallbackServerContext* context, const amhex::v1::FindMissingBlobsRequest* request,
    amhex::v1::FindMissingBlobsResponse* response) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  const CallRecord record(&manager_->metrics(), "amhex.v1.Blobs/FindMissingBlobs");
  executor_->Post([this, context, reactor, record, request, response] {
    const auto answer = [&]() -> absl::Status {
      AMHEX_ASSIGN_OR_RETURN(const Caller caller,
                             authenticator_->Identify(*context, {Role::kSubmit}));
      AMHEX_RETURN_IF_ERROR(CheckFindMissing(*request));
      FieldViolations bad;
      for (int i = 0; i < request->blobs_size(); ++i) {
        const amhex::v1::BlobRef& blob = request->blobs(i);
        AMHEX_ASSIGN_OR_RETURN(const auto size, manager_->SizeOfBlob(caller, blob));
        if (!size) {
          *response->add_missing_blobs() = blob;
        } else {
          CheckSaidSize(absl::StrCat("blobs[", i, "].size_bytes"), blob, *size, &bad);
        }
      }
      return bad.ToStatus();
    };
    reactor->Finish(record.End(answer()));
  });
  return reactor;
}

}  // namespace amhex::server
