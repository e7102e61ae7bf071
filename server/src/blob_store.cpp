#include "blob_store.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <utility>
#include <vector>

#include "errors.h"
#include "status_macros.h"

namespace amhex::server {
namespace {

namespace fs = std::filesystem;

constexpr size_t kHashBlockBytes = 1 << 20;
// Enough for a disk to work well.
constexpr int64_t kWritebackBytes = 8 << 20;
constexpr absl::Duration kUploadRetryDelay = absl::Seconds(2);

// Hashes the first `size` bytes of an open file.
absl::Status HashPrefix(int fd, int64_t size, Sha256* hash) {
  std::vector<char> block(kHashBlockBytes);
  for (int64_t offset = 0; offset < size;) {
    const auto wanted =
        static_cast<size_t>(std::min<int64_t>(size - offset, static_cast<int64_t>(block.size())));
    auto got = ReadAt(fd, block.data(), wanted, offset);
    if (!got.ok()) return got.status();
    if (*got != wanted) return ServerFault("a file of the store became shorter");
    hash->Update(block.data(), wanted);
    offset += static_cast<int64_t>(wanted);
  }
  return absl::OkStatus();
}

// Begins the names of a tenant's uploads.
std::string UploadPrefix(const std::string& tenant) {
  constexpr size_t kTenantDigits = 16;
  return Sha256Hex(tenant).substr(0, kTenantDigits) + "-";
}

std::string UploadKey(const std::string& tenant, const std::string& sha256) {
  return UploadPrefix(tenant) + sha256;
}

absl::Status NotFound(const std::string& sha256) {
  return MakeError(absl::StatusCode::kNotFound, amhex::v1::BLOB_NOT_FOUND,
                   "no blob " + sha256 + " is stored");
}

absl::Status Superseded() {
  return MakeError(absl::StatusCode::kAborted, amhex::v1::UPLOAD_SUPERSEDED,
                   "another stream uploads or completes the same blob");
}

}  // namespace

// The state of the streams that write one blob; locked after BlobStore::mutex_, never before.
struct BlobUpload::Partial {
  std::mutex mutex;
  std::string key;
  amhex::v1::BlobRef blob;
  UniqueFd fd;
  int64_t committed_size = 0;
  int64_t session = 0;  // of the stream that may write
  bool done = false;
};

BlobUpload::BlobUpload(BlobStore* store, std::shared_ptr<Partial> partial, std::string tenant)
    : store_(store),
      partial_(std::move(partial)),
      tenant_(std::move(tenant)),
      session_(++partial_->session) {
  ++store_->active_uploads_;
  ++store_->active_uploads_of_[tenant_];
  committed_size_ = writeback_begin_ = unhashed_prefix_ = partial_->committed_size;
}

BlobUpload::~BlobUpload() {
  std::lock_guard<std::mutex> lock(store_->mutex_);
  --store_->active_uploads_;
  if (--store_->active_uploads_of_[tenant_] == 0) store_->active_uploads_of_.erase(tenant_);
  // The bytes stay on disk; only the open file and the digest's state are let go.
  const auto entry = store_->partials_.find(partial_->key);
  if (entry == store_->partials_.end() || entry->second != partial_) return;
  std::lock_guard<std::mutex> partial_lock(partial_->mutex);
  if (partial_->session != session_) return;
  if (partial_->committed_size == 0) unlink(store_->UploadPath(partial_->key).c_str());
  store_->partials_.erase(entry);
}

absl::Status BlobUpload::Write(int64_t offset, const void* data, size_t size) {
  const BytePieces pieces{{static_cast<const char*>(data), size}};
  if (auto status = Store(offset, pieces); !status.ok()) return status;
  return Digest(pieces);
}

absl::Status BlobUpload::Digest(const BytePieces& pieces) {
  if (unhashed_prefix_ > 0) {
    auto status = HashPrefix(partial_->fd.get(), unhashed_prefix_, &hash_);
    if (!status.ok()) return status;
    unhashed_prefix_ = 0;
  }
  for (const std::string_view piece : pieces) hash_.Update(piece.data(), piece.size());
  return absl::OkStatus();
}

absl::Status BlobUpload::Store(int64_t offset, const BytePieces& pieces) {
  if (complete_) return absl::OkStatus();
  int64_t more = 0;
  for (const std::string_view piece : pieces) more += static_cast<int64_t>(piece.size());
  if (auto status = store_->CheckRoomForInput(more); !status.ok()) return status;
  std::lock_guard<std::mutex> lock(partial_->mutex);
  if (partial_->session != session_ || partial_->done) return Superseded();
  if (offset != partial_->committed_size) {
    return MakeError(absl::StatusCode::kOutOfRange, amhex::v1::WRONG_OFFSET,
                     "offset is " + std::to_string(offset) + ", but " +
                         std::to_string(partial_->committed_size) + " bytes are stored",
                     {{"committed_size", std::to_string(partial_->committed_size)}});
  }
  if (more > partial_->blob.size_bytes() - offset) {
    FieldViolations bad;
    bad.Add("data", "goes beyond blob.size_bytes, " + std::to_string(partial_->blob.size_bytes()));
    return bad.ToStatus();
  }
  if (auto status = WritePiecesAt(partial_->fd.get(), pieces, offset); !status.ok()) {
    // What did get written is not counted, and on a full disk its room is wanted.
    if (ftruncate(partial_->fd.get(), offset) != 0) return FileError("cannot cut an upload", errno);
    return status;
  }
  partial_->committed_size += more;
  committed_size_ = partial_->committed_size;
  store_->uploading_bytes_ += more;
  if (committed_size_ - writeback_begin_ >= kWritebackBytes) {
    StartWriteback(partial_->fd.get(), writeback_begin_, committed_size_ - writeback_begin_);
    writeback_begin_ = committed_size_;
  }
  return absl::OkStatus();
}

absl::Status BlobUpload::Finish(const std::function<absl::Status()>& grant) {
  if (complete_) return absl::OkStatus();
  const std::string& name = partial_->blob.sha256();
  if (auto status = Digest({}); !status.ok()) return status;
  {
    std::lock_guard<std::mutex> lock(partial_->mutex);
    if (partial_->session != session_ || partial_->done) return Superseded();
    if (partial_->committed_size != partial_->blob.size_bytes()) {
      FieldViolations bad;
      bad.Add("finish", "set after " + std::to_string(partial_->committed_size) + " of " +
                            std::to_string(partial_->blob.size_bytes()) + " bytes");
      return bad.ToStatus();
    }
    partial_->done = true;
  }
  const std::string digest = hash_.HexDigest();
  if (digest != name) {
    store_->Drop(partial_->key, partial_->committed_size);
    return MakeError(absl::StatusCode::kInvalidArgument, amhex::v1::DIGEST_MISMATCH,
                     "the bytes have the SHA-256 " + digest + ", not " + name);
  }
  absl::Status status = SyncFile(partial_->fd.get());
  if (status.ok()) {
    status = store_->Publish(store_->UploadPath(partial_->key), name, partial_->blob.size_bytes());
  }
  if (status.ok() && grant) status = grant();
  store_->Drop(partial_->key, partial_->committed_size);
  complete_ = status.ok();
  return status;
}

BlobStore::BlobStore(std::string root, const Limits& limits, std::string private_folder)
    : root_(std::move(root)), private_folder_(std::move(private_folder)), limits_(limits) {}
BlobStore::~BlobStore() = default;

absl::StatusOr<std::unique_ptr<BlobStore>> BlobStore::Open(const std::string& root,
                                                           const Limits& limits,
                                                           const std::string& private_folder) {
  const std::string own = private_folder.empty() ? root : private_folder;
  std::unique_ptr<BlobStore> store(new BlobStore(root, limits, own));
  std::error_code error;
  fs::remove_all(own + "/scratch", error);
  for (const std::string& folder : {root + "/blobs", own + "/uploads", own + "/scratch"}) {
    if (auto status = MakeFolders(folder); !status.ok()) return status;
  }
  store->total_bytes_ = BytesBelow(root + "/blobs");
  store->uploading_bytes_ = BytesBelow(own + "/uploads");
  return store;
}

std::string BlobStore::PathOf(const std::string& sha256) const {
  return root_ + "/blobs/" + sha256.substr(0, 2) + "/" + sha256;
}

std::string BlobStore::UploadPath(const std::string& key) const {
  return private_folder_ + "/uploads/" + key;
}

std::string BlobStore::NewWorkPath(const std::string& job_id, int64_t epoch) const {
  return private_folder_ + "/scratch/" + job_id + "-" + std::to_string(epoch);
}

bool BlobStore::Contains(const std::string& sha256) const { return Size(sha256).ok(); }

absl::StatusOr<int64_t> BlobStore::Size(const std::string& sha256) const {
  struct stat info;
  if (!IsSha256Hex(sha256) || stat(PathOf(sha256).c_str(), &info) != 0) return NotFound(sha256);
  return static_cast<int64_t>(info.st_size);
}

void BlobStore::Touch(const std::string& sha256) const {
  utimensat(AT_FDCWD, PathOf(sha256).c_str(), nullptr, 0);
}

absl::StatusOr<amhex::v1::BlobRef> BlobStore::Put(const std::string& bytes) {
  amhex::v1::BlobRef blob;
  blob.set_sha256(Sha256Hex(bytes));
  blob.set_size_bytes(static_cast<int64_t>(bytes.size()));
  if (Contains(blob.sha256())) {
    Touch(blob.sha256());
    return blob;
  }
  if (auto status = CheckRoomForInput(blob.size_bytes()); !status.ok()) return status;
  std::string draft = private_folder_ + "/scratch/put-XXXXXX";
  UniqueFd fd(mkostemp(draft.data(), O_CLOEXEC));
  if (!fd.valid()) return FileError("cannot make a file of the store", errno);
  absl::Status status = WriteAllAt(fd.get(), bytes.data(), bytes.size(), 0);
  if (status.ok()) status = SyncFile(fd.get());
  if (status.ok()) status = Publish(draft, blob.sha256(), blob.size_bytes());
  if (!status.ok()) {
    unlink(draft.c_str());
    return status;
  }
  return blob;
}

absl::StatusOr<std::unique_ptr<BlobUpload>> BlobStore::StartUpload(const std::string& tenant,
                                                                   const amhex::v1::BlobRef& blob,
                                                                   const TenantRoom& room) {
  const int64_t missing = blob.size_bytes() - UploadedSize(tenant, blob.sha256());
  std::lock_guard<std::mutex> lock(mutex_);
  if (auto status = CheckUploadCount(tenant); !status.ok()) return status;
  // First, as room is made at the cost of others' results, never for more than a tenant may have.
  if (auto status = CheckTenantRoom(tenant, blob, room); !status.ok()) return status;
  if (auto status = CheckRoomForInput(missing); !status.ok()) return status;
  auto partial = FindOrMakePartial(UploadKey(tenant, blob.sha256()), blob);
  if (!partial.ok()) return partial.status();
  std::lock_guard<std::mutex> partial_lock((*partial)->mutex);
  return std::unique_ptr<BlobUpload>(new BlobUpload(this, *partial, tenant));
}

absl::Status BlobStore::CheckUploadCount(const std::string& tenant) const {
  const auto own = active_uploads_of_.find(tenant);
  const bool has_share =
      own == active_uploads_of_.end() || own->second < limits_.max_tenant_upload_count();
  if (active_uploads_ < limits_.max_upload_count && has_share) return absl::OkStatus();
  const char* what = has_share ? "too many uploads are under way" : "too many of them are yours";
  return WithRetryDelay(
      MakeError(absl::StatusCode::kResourceExhausted, amhex::v1::TOO_MANY_UPLOADS, what),
      kUploadRetryDelay);
}

int64_t BlobStore::OtherUploadsOf(const std::string& tenant, const amhex::v1::BlobRef& blob) const {
  const std::string prefix = UploadPrefix(tenant);
  const std::string own = UploadKey(tenant, blob.sha256());
  int64_t bytes = 0;
  // By name, as the file of one that ends has left already.
  for (auto active = partials_.lower_bound(prefix);
       active != partials_.end() && active->first.starts_with(prefix); ++active) {
    if (active->first != own) bytes += active->second->blob.size_bytes();
  }
  for (const fs::path& file : FilesBelow(private_folder_ + "/uploads")) {
    const std::string key = file.filename().string();
    if (key == own || !key.starts_with(prefix) || partials_.contains(key)) continue;
    std::error_code error;
    const auto stored = fs::file_size(file, error);
    if (!error) bytes += static_cast<int64_t>(stored);
  }
  return bytes;
}

absl::Status BlobStore::CheckTenantRoom(const std::string& tenant, const amhex::v1::BlobRef& blob,
                                        const TenantRoom& room) const {
  if (room.quota_bytes <= 0) return absl::OkStatus();
  AMHEX_ASSIGN_OR_RETURN(const int64_t owned, room.owned_bytes());
  const int64_t taken = owned + OtherUploadsOf(tenant, blob);
  if (taken + blob.size_bytes() <= room.quota_bytes) return absl::OkStatus();
  return QuotaExceeded("bytes of blobs", room.quota_bytes);
}

absl::StatusOr<std::shared_ptr<BlobUpload::Partial>> BlobStore::FindOrMakePartial(
    const std::string& key, const amhex::v1::BlobRef& blob) {
  if (const auto found = partials_.find(key); found != partials_.end()) {
    BlobUpload::Partial& other = *found->second;
    std::lock_guard<std::mutex> lock(other.mutex);
    if (other.done) return Superseded();
    if (other.blob.size_bytes() == blob.size_bytes()) return found->second;
    other.done = true;  // one of the two sizes is wrong; the digest will tell which
  }
  auto partial = std::make_shared<BlobUpload::Partial>();
  partial->key = key;
  partial->blob = blob;
  auto fd = OpenFile(UploadPath(key), O_RDWR | O_CREAT);
  if (!fd.ok()) return fd.status();
  auto size = FileSize(fd->get());
  if (!size.ok()) return size.status();
  partial->fd = std::move(*fd);
  if (*size > blob.size_bytes()) {
    if (ftruncate(partial->fd.get(), 0) != 0) return FileError("cannot restart an upload", errno);
    uploading_bytes_ -= *size;
    *size = 0;
  }
  partial->committed_size = *size;
  partials_[key] = partial;
  return partial;
}

int64_t BlobStore::UploadedSize(const std::string& tenant, const std::string& sha256) const {
  std::error_code error;
  const auto size = fs::file_size(UploadPath(UploadKey(tenant, sha256)), error);
  return error ? 0 : static_cast<int64_t>(size);
}

absl::StatusOr<UniqueFd> BlobStore::OpenForRead(const std::string& sha256) const {
  if (!IsSha256Hex(sha256)) return NotFound(sha256);
  const int fd = open(PathOf(sha256).c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0) return errno == ENOENT ? NotFound(sha256) : FileError("cannot open a blob", errno);
  return UniqueFd(fd);
}

absl::StatusOr<amhex::v1::BlobRef> BlobStore::Adopt(const std::string& work_path) {
  AMHEX_ASSIGN_OR_RETURN(const UniqueFd fd, OpenFile(work_path, O_RDONLY));
  AMHEX_ASSIGN_OR_RETURN(const int64_t size, FileSize(fd.get()));
  AMHEX_RETURN_IF_ERROR(CheckRoom(size));
  StartWriteback(fd.get(), 0, size);  // the disk works while the bytes are hashed
  Sha256 hash;
  AMHEX_RETURN_IF_ERROR(HashPrefix(fd.get(), size, &hash));
  AMHEX_RETURN_IF_ERROR(SyncFile(fd.get()));
  amhex::v1::BlobRef blob;
  blob.set_sha256(hash.HexDigest());
  blob.set_size_bytes(size);
  AMHEX_RETURN_IF_ERROR(Publish(work_path, blob.sha256(), size));
  return blob;
}

absl::Status BlobStore::Publish(const std::string& from, const std::string& sha256, int64_t size) {
  const std::string to = PathOf(sha256);
  if (auto status = MakeFolders(fs::path(to).parent_path().string()); !status.ok()) return status;
  bool is_first = false;  // of those that publish the same bytes now; they count once
  {
    std::lock_guard<std::mutex> lock(mutex_);
    is_first = !Contains(sha256) && publishing_.insert(sha256).second;
  }
  absl::Status status = RenameDurably(from, to);
  if (is_first) {
    std::lock_guard<std::mutex> lock(mutex_);
    publishing_.erase(sha256);
    if (status.ok()) total_bytes_ += size;
  }
  if (!status.ok()) return status;
  Touch(sha256);
  return absl::OkStatus();
}

void BlobStore::Drop(const std::string& key, int64_t committed_size) {
  unlink(UploadPath(key).c_str());
  uploading_bytes_ -= committed_size;
  std::lock_guard<std::mutex> lock(mutex_);
  partials_.erase(key);
}

}  // namespace amhex::server
