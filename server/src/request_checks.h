// Checks the fields of requests; names all bad ones at once.
#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "amhex/v1/blob_service.pb.h"
#include "amhex/v1/meshing_service.pb.h"
#include "job_store.h"
#include "service_limits.h"

namespace amhex::server {

// Each gives OK, or INVALID_ARGUMENT BAD_REQUEST with one violation per bad field.
absl::Status CheckSubmit(const amhex::v1::SubmitJobRequest& request, const Limits& limits);
// The first message of Mesh.
absl::Status CheckMeshBegin(const amhex::v1::MeshRequest& request, const Limits& limits);
absl::Status CheckWatch(const amhex::v1::WatchJobRequest& request);
absl::Status CheckFindMissing(const amhex::v1::FindMissingBlobsRequest& request);
absl::Status CheckRead(const amhex::v1::ReadBlobRequest& request);
// Which bytes of a blob of `blob_size` a request that CheckRead has passed asks for. OUT_OF_RANGE
// BAD_REQUEST beyond its end.
struct ByteRange {
  int64_t begin = 0;
  int64_t end = 0;
};
absl::StatusOr<ByteRange> RangeToRead(const amhex::v1::ReadBlobRequest& request, int64_t blob_size);
// For writing, the size is required and bounded as well.
absl::Status CheckBlobToWrite(const amhex::v1::BlobRef& blob, const Limits& limits);
absl::Status CheckBlobRef(const amhex::v1::BlobRef& blob);

// The id in "jobs/{uuid}".
absl::StatusOr<std::string> CheckJobName(const std::string& name);

// Page tokens are opaque to clients and only good for the filters they were made with.
absl::StatusOr<JobQuery> CheckList(const amhex::v1::ListJobsRequest& request, const Limits& limits);
std::string MakePageToken(const amhex::v1::ListJobsRequest& request, int64_t before_number);

}  // namespace amhex::server
