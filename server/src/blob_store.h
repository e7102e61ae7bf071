// Inputs and results as files named by the SHA-256 of their bytes.
//
// Layout under the root: blobs/ab/<sha256> complete blobs, uploads/<tenant's digest>-<sha256>
// partial ones, scratch/ what workers are writing. A blob appears under its name only when
// complete, checked and durable. Tenants share blobs but not uploads: whoever has not shown all of
// a blob's bytes cannot learn that it is there.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/time/time.h"
#include "amhex/v1/geometry.pb.h"
#include "files.h"
#include "service_limits.h"
#include "sha256.h"

namespace amhex::server {

class BlobStore;

// Bytes that lie in several places.
using BytePieces = std::vector<std::string_view>;

// How much a tenant may own, no quota if that is 0, and how to ask what it owns beside the blob
// that is to come. Asked while no upload can end, so that each counts as one under way or as owned.
struct TenantRoom {
  int64_t quota_bytes = 0;
  std::function<absl::StatusOr<int64_t>()> owned_bytes;
};

// One stream that writes one blob. Thread-compatible, but for Digest, which may run beside Store:
// storing and hashing cost about the same.
class BlobUpload {
 public:
  ~BlobUpload();

  // Bytes stored so far; equal to the blob's size when it is complete.
  int64_t committed_size() const { return committed_size_; }
  bool complete() const { return complete_; }

  // Adds bytes at `offset`. OUT_OF_RANGE WRONG_OFFSET, ABORTED UPLOAD_SUPERSEDED, INVALID_ARGUMENT
  // (beyond the announced size), RESOURCE_EXHAUSTED STORAGE_FULL.
  absl::Status Store(int64_t offset, const BytePieces& pieces);
  // Hashes what has been stored; each time once, in the same order.
  absl::Status Digest(const BytePieces& pieces);
  // Both.
  absl::Status Write(int64_t offset, const void* data, size_t size);

  // After all is stored and hashed: checks size and digest and publishes the blob. INVALID_ARGUMENT
  // DIGEST_MISMATCH drops it. `grant` is called once the blob is there: until it has returned the
  // upload counts as under way.
  absl::Status Finish(const std::function<absl::Status()>& grant = nullptr);

 private:
  friend class BlobStore;
  struct Partial;
  BlobUpload(BlobStore* store, std::shared_ptr<Partial> partial, std::string tenant);

  BlobStore* store_;
  const std::shared_ptr<Partial> partial_;
  const std::string tenant_;
  int64_t session_ = 0;
  int64_t committed_size_ = 0;
  int64_t writeback_begin_ = 0;
  bool complete_ = false;
  // Of other streams' bytes, `unhashed_prefix_` of them, nobody has kept the hash's state.
  int64_t unhashed_prefix_ = 0;
  Sha256 hash_;
};

// Thread-safe.
class BlobStore {
 public:
  // Makes the folders, forgets unfinished work of workers, counts what is there.
  // Several servers may share `root`; what is not complete lies in each one's `private_folder`, on
  // the same file system. Empty: `root` is all this server's.
  static absl::StatusOr<std::unique_ptr<BlobStore>> Open(const std::string& root,
                                                         const Limits& limits,
                                                         const std::string& private_folder = "");
  ~BlobStore();

  bool Contains(const std::string& sha256) const;
  // Size of a complete blob; NOT_FOUND BLOB_NOT_FOUND.
  absl::StatusOr<int64_t> Size(const std::string& sha256) const;
  // Keeps an unused blob from being collected for another while.
  void Touch(const std::string& sha256) const;

  absl::StatusOr<amhex::v1::BlobRef> Put(const std::string& bytes);

  // Begins or continues a tenant's upload, even of a blob that is there; an older stream of the
  // same is superseded. RESOURCE_EXHAUSTED QUOTA_EXCEEDED where the tenant has no room for it
  // beside its other uploads, of which those under way count as a whole and those at rest with what
  // is stored of them.
  absl::StatusOr<std::unique_ptr<BlobUpload>> StartUpload(const std::string& tenant,
                                                          const amhex::v1::BlobRef& blob,
                                                          const TenantRoom& room = {});
  // Bytes stored of a tenant's upload that is not complete.
  int64_t UploadedSize(const std::string& tenant, const std::string& sha256) const;

  // An open descriptor stays readable even if the blob is collected meanwhile.
  absl::StatusOr<UniqueFd> OpenForRead(const std::string& sha256) const;
  // For workers of this machine; never told to clients.
  std::string PathOf(const std::string& sha256) const;

  // A fresh path for a worker to write to, and taking over what it wrote.
  std::string NewWorkPath(const std::string& job_id, int64_t epoch) const;
  absl::StatusOr<amhex::v1::BlobRef> Adopt(const std::string& work_path);

  // Asked before a blob is removed: calls the function, which hides the blob, at a moment when
  // nobody can come to use it, and returns true if it may stay hidden.
  using Release = std::function<bool(const std::string& sha256, const std::function<void()>& hide)>;
  // Removes complete blobs that `release` lets go and that were last touched before `older_than`,
  // and uploads that rested since `uploads_older_than`. Returns the bytes freed.
  int64_t Collect(absl::Time older_than, absl::Time uploads_older_than, const Release& release);

  // Bytes of complete blobs, and of uploads that are not complete.
  int64_t total_bytes() const;
  int64_t uploading_bytes() const;
  // Whether the budget has room for so many bytes more.
  bool HasBudgetFor(int64_t more_bytes) const;
  // What the disk has left for this server.
  absl::StatusOr<int64_t> FreeDiskBytes() const;

 private:
  friend class BlobUpload;
  BlobStore(std::string root, const Limits& limits, std::string private_folder);

  // Both RESOURCE_EXHAUSTED STORAGE_FULL: beyond the budget; the second also where the disk would
  // keep less than its reserve, which only results may use.
  absl::Status CheckRoom(int64_t more_bytes) const;
  absl::Status CheckRoomForInput(int64_t more_bytes) const;
  // Under the lock: RESOURCE_EXHAUSTED TOO_MANY_UPLOADS where all of them, or the tenant's share,
  // are under way.
  absl::Status CheckUploadCount(const std::string& tenant) const;
  // Under the lock: bytes that a tenant's uploads of other blobs take or will take.
  int64_t OtherUploadsOf(const std::string& tenant, const amhex::v1::BlobRef& blob) const;
  // Under the lock: QUOTA_EXCEEDED where all that is the tenant's leaves no room for the blob.
  absl::Status CheckTenantRoom(const std::string& tenant, const amhex::v1::BlobRef& blob,
                               const TenantRoom& room) const;
  std::string UploadPath(const std::string& key) const;
  absl::Status Publish(const std::string& from, const std::string& sha256, int64_t size);
  absl::StatusOr<std::shared_ptr<BlobUpload::Partial>> FindOrMakePartial(
      const std::string& key, const amhex::v1::BlobRef& blob);
  // Removes what is stored of an upload, unless a stream has taken it up.
  void CollectUpload(const std::string& key);
  // Removes a blob, or leaves it; the bytes freed.
  int64_t CollectBlob(const std::string& sha256, absl::Time older_than, const Release& release);
  void Drop(const std::string& key, int64_t committed_size);

  const std::string root_;
  const std::string private_folder_;
  const Limits limits_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<BlobUpload::Partial>> partials_;  // by key
  std::set<std::string> publishing_;     // digests of blobs on their way into the store
  std::atomic<int64_t> total_bytes_{0};  // changed under the lock
  std::atomic<int64_t> uploading_bytes_{0};
  int32_t active_uploads_ = 0;
  std::map<std::string, int32_t> active_uploads_of_;  // by tenant, those that have any
};

}  // namespace amhex::server
