// The side of JobManager that moves blobs: what is a caller's, and admission of inputs.
#include <algorithm>
#include <limits>
#include <utility>

#include "errors.h"
#include "input_preflight.h"
#include "job_manager.h"
#include "job_record.h"
#include "logging.h"
#include "sha256.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

// Enough of an input to reach its counts, unless it carries much metadata.
constexpr size_t kPreflightBytes = 65'536;

absl::Status BlobNotFound(const std::string& sha256) {
  return MakeError(absl::StatusCode::kNotFound, amhex::v1::BLOB_NOT_FOUND,
                   "no blob " + sha256 + " is stored");
}

}  // namespace

void CheckSaidSize(const std::string& field, const amhex::v1::BlobRef& blob, int64_t stored_size,
                   FieldViolations* bad) {
  if (blob.size_bytes() == 0 || blob.size_bytes() == stored_size) return;
  bad->Add(field, "is " + std::to_string(blob.size_bytes()) + ", but the blob has " +
                      std::to_string(stored_size) + " bytes");
}

absl::StatusOr<std::optional<int64_t>> JobManager::SizeOfBlob(const Caller& caller,
                                                              const amhex::v1::BlobRef& blob) {
  const absl::StatusOr<int64_t> size = blobs_->Size(blob.sha256());
  if (!size.ok()) return std::nullopt;
  AMHEX_ASSIGN_OR_RETURN(const bool owned, store_->OwnsBlob(caller.tenant.name, blob.sha256()));
  if (!owned) return std::nullopt;
  blobs_->Touch(blob.sha256());
  return *size;
}

// What the tenant owns counts once, so that a submission can be repeated however little is left.
absl::Status JobManager::CheckBlobQuota(const Tenant& tenant, const std::string& bytes) {
  if (tenant.max_blob_bytes <= 0) return absl::OkStatus();
  AMHEX_ASSIGN_OR_RETURN(const int64_t owned, store_->OwnedBytes(tenant.name));
  if (owned + static_cast<int64_t>(bytes.size()) <= tenant.max_blob_bytes) return absl::OkStatus();
  AMHEX_ASSIGN_OR_RETURN(const bool is_owned, store_->OwnsBlob(tenant.name, Sha256Hex(bytes)));
  return is_owned ? absl::OkStatus() : QuotaExceeded("bytes of blobs", tenant.max_blob_bytes);
}

absl::StatusOr<JobManager::UploadState> JobManager::FindUpload(const Caller& caller,
                                                               const amhex::v1::BlobRef& blob) {
  AMHEX_ASSIGN_OR_RETURN(const auto size, SizeOfBlob(caller, blob));
  if (!size) return UploadState{blobs_->UploadedSize(caller.tenant.name, blob.sha256()), false};
  FieldViolations bad;
  CheckSaidSize("blob.size_bytes", blob, *size, &bad);
  AMHEX_RETURN_IF_ERROR(bad.ToStatus());
  return UploadState{*size, true};
}

absl::StatusOr<std::unique_ptr<BlobUpload>> JobManager::StartUpload(
    const Caller& caller, const amhex::v1::BlobRef& blob) {
  const std::string& tenant = caller.tenant.name;
  const auto owned_beside = [&]() -> absl::StatusOr<int64_t> {
    AMHEX_ASSIGN_OR_RETURN(const int64_t owned, store_->OwnedBytes(tenant));
    AMHEX_ASSIGN_OR_RETURN(const bool is_owned, store_->OwnsBlob(tenant, blob.sha256()));
    return is_owned ? std::max<int64_t>(owned - blob.size_bytes(), 0) : owned;
  };
  const auto start = [&] {
    return blobs_->StartUpload(tenant, blob, {caller.tenant.max_blob_bytes, owned_beside});
  };
  auto upload = start();
  if (ReasonOf(upload.status()) != "STORAGE_FULL") return upload;
  const int64_t missing = blob.size_bytes() - blobs_->UploadedSize(tenant, blob.sha256());
  return MakeRoomForInput(missing) ? start() : std::move(upload);
}

absl::Status JobManager::FinishUpload(const Caller& caller, const amhex::v1::BlobRef& blob,
                                      BlobUpload* upload) {
  return upload->Finish([&] {
    absl::Status granted = store_->GrantBlob(caller.tenant.name, blob, absl::Now());
    if (!absl::IsFailedPrecondition(granted)) return granted;
    // It was there before, unused, and another node has just collected it.
    return MakeError(absl::StatusCode::kAborted, amhex::v1::UPLOAD_SUPERSEDED,
                     "the blob was removed while it was completed; upload it again");
  });
}

absl::StatusOr<UniqueFd> JobManager::OpenBlob(const Caller& caller, const std::string& sha256) {
  if (!caller.Has(Role::kReadAll)) {
    AMHEX_ASSIGN_OR_RETURN(const bool owned, store_->OwnsBlob(caller.tenant.name, sha256));
    if (!owned) return BlobNotFound(sha256);
  }
  return blobs_->OpenForRead(sha256);
}

absl::StatusOr<amhex::v1::BlobRef> JobManager::CheckBlob(const Caller& caller,
                                                         const amhex::v1::BlobRef& blob) {
  AMHEX_ASSIGN_OR_RETURN(const auto size, SizeOfBlob(caller, blob));
  if (!size) return BlobMissing(blob.sha256());
  FieldViolations bad;
  CheckSaidSize("input_blob.size_bytes", blob, *size, &bad);
  AMHEX_RETURN_IF_ERROR(bad.ToStatus());
  amhex::v1::BlobRef whole = blob;
  whole.set_size_bytes(*size);
  return whole;
}

absl::StatusOr<AdmittedInput> JobManager::AdmitInput(const Caller& caller,
                                                     const amhex::v1::SubmitJobRequest& request) {
  amhex::v1::BlobRef input;
  std::string head;
  if (request.has_input_blob()) {
    AMHEX_ASSIGN_OR_RETURN(input, CheckBlob(caller, request.input_blob()));
    AMHEX_ASSIGN_OR_RETURN(const UniqueFd fd, blobs_->OpenForRead(input.sha256()));
    head.resize(kPreflightBytes);
    AMHEX_ASSIGN_OR_RETURN(const size_t got, ReadAt(fd.get(), head.data(), head.size(), 0));
    head.resize(got);
  } else {
    input.set_size_bytes(static_cast<int64_t>(request.inline_input().size()));
  }
  const std::string& bytes = request.has_input_blob() ? head : request.inline_input();
  const absl::StatusOr<int64_t> elements = PreflightInput(
      request.input_encoding(),
      {reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size(), input.size_bytes()},
      options_.limits);
  if (!elements.ok()) {
    metrics_->DecodeRejected(ReasonOf(elements.status())).Increment();
    return elements.status();
  }
  if (request.has_input_blob()) return AdmittedInput{input, *elements};
  AMHEX_RETURN_IF_ERROR(CheckBlobQuota(caller.tenant, request.inline_input()));
  AMHEX_ASSIGN_OR_RETURN(input, blobs_->Put(request.inline_input()));
  return AdmittedInput{input, *elements};
}

void JobManager::OwnRefusedInput(const Caller& caller, const amhex::v1::SubmitJobRequest& request,
                                 const AdmittedInput& input) {
  if (request.has_input_blob()) return;
  // Asked first, because refusals come in floods and a grant waits for the disk.
  const auto is_owned = store_->OwnsBlob(caller.tenant.name, input.blob.sha256());
  if (is_owned.ok() && *is_owned) return;
  const absl::Status status = store_->GrantBlob(caller.tenant.name, input.blob, absl::Now());
  // Another node may have collected it just now.
  if (status.ok() || absl::IsFailedPrecondition(status)) return;
  LogError("grant_failed", {{"message", std::string(status.message())}});
}

absl::StatusOr<AdmittedInput> JobManager::AdmitInputOfEstimate(
    const Caller& caller, const amhex::v1::SubmitJobRequest& request) {
  MakeRoomForInput(static_cast<int64_t>(request.inline_input().size()));
  std::lock_guard<std::mutex> lock(admission_mutex_);
  AMHEX_ASSIGN_OR_RETURN(AdmittedInput input, AdmitInput(caller, request));
  OwnRefusedInput(caller, request, input);
  return input;
}

absl::StatusOr<ExpectedCost> JobManager::AdmitCost(const amhex::v1::MeshingParams& params,
                                                   const AdmittedInput& input) const {
  if (!options_.predict_cost) return ExpectedCost();
  ExpectedCost cost = options_.predict_cost(params, input.element_count);
  const int64_t predicted = cost.memory_bytes;
  if (predicted <= 0) cost.memory_bytes = options_.unknown_memory_bytes;
  const int64_t limit = MostMemoryOfOneJob();
  if (predicted <= limit) return cost;
  return MakeError(
      absl::StatusCode::kResourceExhausted, amhex::v1::OUT_OF_MEMORY,
      "the job is expected to need " + std::to_string(predicted) + " bytes; a job may take " +
          std::to_string(limit),
      {{"expected_bytes", std::to_string(predicted)}, {"limit_bytes", std::to_string(limit)}});
}

int64_t JobManager::MostMemoryOfOneJob() const {
  int64_t most = std::numeric_limits<int64_t>::max();
  for (const int64_t bound :
       {options_.limits.max_worker_memory_bytes, options_.limits.max_running_memory_bytes}) {
    if (bound > 0) most = std::min(most, bound);
  }
  return most;
}

}  // namespace amhex::server
