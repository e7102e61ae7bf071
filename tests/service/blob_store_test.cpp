#include "blob_store.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <filesystem>
#include <functional>
#include <thread>

#include "errors.h"
#include "service_fixtures.h"

namespace amhex::server {
namespace {

constexpr char kTenant[] = "ada";

amhex::v1::BlobRef RefOf(const std::string& bytes) {
  amhex::v1::BlobRef blob;
  blob.set_sha256(Sha256Hex(bytes));
  blob.set_size_bytes(static_cast<int64_t>(bytes.size()));
  return blob;
}

// Lets no blob go.
BlobStore::Release KeepAll() {
  return [](const std::string&, const std::function<void()>&) { return false; };
}

class BlobStoreTest : public ::testing::Test {
 protected:
  void SetUp() override { Reopen(); }

  void Reopen() {
    store_.reset();
    auto opened = BlobStore::Open(folder_.path(), limits_);
    ASSERT_TRUE(opened.ok()) << opened.status();
    store_ = *std::move(opened);
  }

  std::unique_ptr<BlobUpload> Start(const amhex::v1::BlobRef& blob) {
    auto upload = store_->StartUpload(kTenant, blob);
    EXPECT_TRUE(upload.ok()) << upload.status();
    return upload.ok() ? *std::move(upload) : nullptr;
  }

  std::string Content(const std::string& sha256) {
    const auto bytes = ReadWholeFile(store_->PathOf(sha256));
    return bytes.ok() ? *bytes : "";
  }

  const std::string text_ = "twenty-six bytes of a blob";
  const amhex::v1::BlobRef blob_ = RefOf(text_);
  TemporaryFolder folder_;
  Limits limits_;
  std::unique_ptr<BlobStore> store_;
};

TEST_F(BlobStoreTest, KnownDigestOfTheEmptyString) {
  EXPECT_EQ(Sha256Hex(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST_F(BlobStoreTest, PutBytesComeBackAndAreCountedOnce) {
  ASSERT_TRUE(store_->Put(text_).ok());
  ASSERT_TRUE(store_->Put(text_).ok());
  EXPECT_EQ(Content(blob_.sha256()), text_);
  EXPECT_EQ(store_->total_bytes(), blob_.size_bytes());
}

TEST_F(BlobStoreTest, BlobIsInvisibleUntilFinished) {
  auto upload = Start(blob_);
  ASSERT_TRUE(upload->Write(0, text_.data(), text_.size()).ok());
  EXPECT_FALSE(store_->Contains(blob_.sha256()));
  ASSERT_TRUE(upload->Finish().ok());
  EXPECT_TRUE(store_->Contains(blob_.sha256()));
}

TEST_F(BlobStoreTest, BrokenUploadContinuesAfterARestart) {
  ASSERT_TRUE(Start(blob_)->Write(0, text_.data(), 10).ok());
  Reopen();
  EXPECT_EQ(store_->UploadedSize(kTenant, blob_.sha256()), 10);
  auto upload = Start(blob_);
  EXPECT_EQ(upload->committed_size(), 10);
  ASSERT_TRUE(upload->Write(10, text_.data() + 10, text_.size() - 10).ok());
  ASSERT_TRUE(upload->Finish().ok());
  EXPECT_EQ(Content(blob_.sha256()), text_);
}

TEST_F(BlobStoreTest, WrongOffsetTellsWhereToContinue) {
  auto upload = Start(blob_);
  ASSERT_TRUE(upload->Write(0, text_.data(), 10).ok());
  const absl::Status status = upload->Write(11, text_.data(), 1);
  EXPECT_EQ(status.code(), absl::StatusCode::kOutOfRange);
  EXPECT_EQ(ReasonOf(status), "WRONG_OFFSET");
}

TEST_F(BlobStoreTest, BytesBeyondTheAnnouncedSizeAreRefused) {
  auto upload = Start(blob_);
  const std::string more = text_ + "!";
  EXPECT_EQ(ReasonOf(upload->Write(0, more.data(), more.size())), "BAD_REQUEST");
}

TEST_F(BlobStoreTest, WrongDigestDropsTheUpload) {
  auto upload = Start(blob_);
  const std::string other(text_.size(), 'x');
  ASSERT_TRUE(upload->Write(0, other.data(), other.size()).ok());
  EXPECT_EQ(ReasonOf(upload->Finish()), "DIGEST_MISMATCH");
  EXPECT_FALSE(store_->Contains(blob_.sha256()));
  EXPECT_EQ(store_->UploadedSize(kTenant, blob_.sha256()), 0);
}

TEST_F(BlobStoreTest, EarlyFinishIsRefusedAndTheUploadGoesOn) {
  auto upload = Start(blob_);
  ASSERT_TRUE(upload->Write(0, text_.data(), 10).ok());
  EXPECT_EQ(ReasonOf(upload->Finish()), "BAD_REQUEST");
  ASSERT_TRUE(upload->Write(10, text_.data() + 10, text_.size() - 10).ok());
  EXPECT_TRUE(upload->Finish().ok());
}

TEST_F(BlobStoreTest, NewerStreamTakesOver) {
  auto older = Start(blob_);
  ASSERT_TRUE(older->Write(0, text_.data(), 10).ok());
  auto newer = Start(blob_);
  EXPECT_EQ(newer->committed_size(), 10);
  EXPECT_EQ(ReasonOf(older->Write(10, text_.data() + 10, 1)), "UPLOAD_SUPERSEDED");
  older.reset();
  ASSERT_TRUE(newer->Write(10, text_.data() + 10, text_.size() - 10).ok());
  EXPECT_TRUE(newer->Finish().ok());
}

// Else its bytes would go on into a file without a name, and its end publish whatever another
// stream had begun to write under that name.
TEST_F(BlobStoreTest, UploadThatIsTakenUpAgainIsNotCollectedHoweverLongItHasRested) {
  ASSERT_TRUE(Start(blob_)->Write(0, text_.data(), 10).ok());
  const auto rested = Start(blob_);
  store_->Collect(absl::InfinitePast(), absl::InfiniteFuture(), KeepAll());
  const auto next = Start(blob_);
  EXPECT_EQ(next->committed_size(), 10);
  ASSERT_TRUE(next->Write(10, text_.data() + 10, text_.size() - 10).ok());
  EXPECT_EQ(ReasonOf(rested->Write(10, text_.data() + 10, 1)), "UPLOAD_SUPERSEDED");
  ASSERT_TRUE(next->Finish().ok());
  EXPECT_EQ(Content(blob_.sha256()), text_);
}

TEST_F(BlobStoreTest, UploadsOfATenantCountAgainstItsQuotaBeforeTheyAreComplete) {
  const TenantRoom room{10 + 2 * blob_.size_bytes() + 5, [] { return 10; }};
  const auto other = RefOf(text_ + "!");
  const auto start = [&](const std::string& tenant, const amhex::v1::BlobRef& blob) {
    return store_->StartUpload(tenant, blob, room);
  };
  auto first = start(kTenant, blob_);
  ASSERT_TRUE(first.ok()) << first.status();
  auto second = start(kTenant, other);  // under way, both count as a whole
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(ReasonOf(start(kTenant, RefOf("five b")).status()), "QUOTA_EXCEEDED");
  EXPECT_TRUE(start(kTenant, RefOf("four")).ok());
  EXPECT_TRUE(start("bob", RefOf("five b")).ok());
  ASSERT_TRUE((*first)->Write(0, text_.data(), 20).ok());
  first->reset();  // at rest, it counts with what is stored of it
  EXPECT_TRUE(start(kTenant, RefOf("five b")).ok());
  EXPECT_EQ(ReasonOf(start(kTenant, RefOf("thirteen byte")).status()), "QUOTA_EXCEEDED");
  EXPECT_TRUE(start(kTenant, blob_).ok());  // its own bytes do not stand in its way
}

TEST_F(BlobStoreTest, UploadThatEndsCountsAgainstTheQuotaAtEveryMoment) {
  int64_t owned = 0;
  const TenantRoom room{blob_.size_bytes() + 1, [&] { return owned; }};
  const auto start_other = [&] {
    return store_->StartUpload(kTenant, RefOf("other"), room).status();
  };
  auto upload = store_->StartUpload(kTenant, blob_, room);
  ASSERT_TRUE(upload.ok()) << upload.status();
  ASSERT_TRUE((*upload)->Write(0, text_.data(), text_.size()).ok());
  const auto grant = [&] {
    EXPECT_EQ(Content(blob_.sha256()), text_);  // is there already, and not yet the tenant's
    EXPECT_EQ(ReasonOf(start_other()), "QUOTA_EXCEEDED");
    owned = blob_.size_bytes();
    return absl::OkStatus();
  };
  ASSERT_TRUE((*upload)->Finish(grant).ok());
  EXPECT_EQ(ReasonOf(start_other()), "QUOTA_EXCEEDED");
  owned = 0;
  EXPECT_TRUE(start_other().ok());  // nothing else stood in its way
}

TEST_F(BlobStoreTest, StreamsThatSentNothingLeaveNoFile) {
  for (int i = 0; i < 3; ++i) Start(RefOf(text_ + std::to_string(i)));
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "uploads"));
  auto upload = Start(blob_);
  Start(blob_)
      .reset();  // a newer stream that leaves at once takes nothing from an older one's file
  EXPECT_EQ(ReasonOf(upload->Write(0, text_.data(), 1)), "UPLOAD_SUPERSEDED");
}

TEST_F(BlobStoreTest, UploadsOfTenantsAreApartAlsoOfABlobThatIsThere) {
  ASSERT_TRUE(store_->Put(text_).ok());
  auto upload = Start(blob_);
  EXPECT_FALSE(upload->complete());
  EXPECT_EQ(upload->committed_size(), 0);
  ASSERT_TRUE(upload->Write(0, text_.data(), 10).ok());
  EXPECT_EQ(store_->UploadedSize(kTenant, blob_.sha256()), 10);
  EXPECT_EQ(store_->UploadedSize("bob", blob_.sha256()), 0);
  ASSERT_TRUE(upload->Write(10, text_.data() + 10, text_.size() - 10).ok());
  ASSERT_TRUE(upload->Finish().ok());
  EXPECT_EQ(Content(blob_.sha256()), text_);
  EXPECT_EQ(store_->total_bytes(), blob_.size_bytes());
}

TEST_F(BlobStoreTest, NoTenantCanTakeAllUploads) {
  limits_.max_upload_count = 8;
  Reopen();
  std::vector<std::unique_ptr<BlobUpload>> uploads;
  absl::Status refused;
  for (int i = 0; refused.ok(); ++i) {
    auto upload = store_->StartUpload(kTenant, RefOf(std::to_string(i)));
    refused = upload.status();
    if (upload.ok()) uploads.push_back(*std::move(upload));
  }
  EXPECT_EQ(ReasonOf(refused), "TOO_MANY_UPLOADS");
  EXPECT_EQ(uploads.size(), 6u);
  const auto others = store_->StartUpload("bob", blob_);
  EXPECT_TRUE(others.ok()) << others.status();
  uploads.pop_back();
  EXPECT_TRUE(store_->StartUpload(kTenant, RefOf("another")).ok());
}

TEST_F(BlobStoreTest, UploadsBeyondTheLimitAreRefused) {
  limits_.max_upload_count = 1;
  Reopen();
  auto first = Start(blob_);
  const auto second = store_->StartUpload(kTenant, RefOf("other"));
  EXPECT_EQ(ReasonOf(second.status()), "TOO_MANY_UPLOADS");
  first.reset();
  EXPECT_TRUE(store_->StartUpload(kTenant, RefOf("other")).ok());
}

TEST_F(BlobStoreTest, BytesBeyondTheBudgetAreRefused) {
  limits_.max_blob_store_bytes = 10;
  Reopen();
  EXPECT_EQ(ReasonOf(store_->Put(text_).status()), "STORAGE_FULL");
  EXPECT_EQ(ReasonOf(store_->StartUpload(kTenant, blob_).status()), "STORAGE_FULL");
}

TEST_F(BlobStoreTest, InputsLeaveTheDiskItsReserveAndResultsMayUseIt) {
  const auto left = store_->FreeDiskBytes();
  ASSERT_TRUE(left.ok()) << left.status();
  for (const int64_t reserve : {int64_t{0}, *left / 2}) {
    limits_.min_free_disk_bytes = reserve;
    Reopen();
    EXPECT_TRUE(store_->StartUpload(kTenant, blob_).ok()) << reserve;
    amhex::v1::BlobRef large = RefOf("large");
    large.set_size_bytes(*left);
    EXPECT_EQ(store_->StartUpload(kTenant, large).ok(), reserve == 0);
  }
  limits_.min_free_disk_bytes = 2 * *left;
  Reopen();
  EXPECT_EQ(ReasonOf(store_->StartUpload(kTenant, blob_).status()), "STORAGE_FULL");
  EXPECT_EQ(ReasonOf(store_->Put(text_).status()), "STORAGE_FULL");
  const std::string path = store_->NewWorkPath("job", 1);
  ASSERT_TRUE(WriteFileAtomically(path, text_).ok());
  EXPECT_TRUE(store_->Adopt(path).ok());
}

TEST_F(BlobStoreTest, AdoptedWorkBecomesABlob) {
  const std::string path = store_->NewWorkPath("job", 1);
  ASSERT_TRUE(WriteFileAtomically(path, text_).ok());
  const auto blob = store_->Adopt(path);
  ASSERT_TRUE(blob.ok()) << blob.status();
  EXPECT_EQ(blob->sha256(), blob_.sha256());
  EXPECT_EQ(Content(blob->sha256()), text_);
}

TEST_F(BlobStoreTest, UnfinishedWorkIsForgottenOnRestart) {
  const std::string path = store_->NewWorkPath("job", 1);
  ASSERT_TRUE(WriteFileAtomically(path, text_).ok());
  Reopen();
  EXPECT_FALSE(ReadWholeFile(path).ok());
}

TEST_F(BlobStoreTest, CollectRemovesOldUnusedBlobsOnly) {
  const auto used = store_->Put("used");
  const auto unused = store_->Put("unused");
  ASSERT_TRUE(used.ok() && unused.ok());
  const BlobStore::Release release = [&](const std::string& sha256, const auto& hide) {
    if (sha256 == used->sha256()) return false;
    hide();
    return true;
  };
  const absl::Time past = absl::Now() - absl::Hours(1);
  const absl::Time future = absl::Now() + absl::Hours(1);
  EXPECT_EQ(store_->Collect(past, past, release), 0);
  EXPECT_EQ(store_->Collect(future, past, release), unused->size_bytes());
  EXPECT_TRUE(store_->Contains(used->sha256()));
  EXPECT_FALSE(store_->Contains(unused->sha256()));
  EXPECT_EQ(store_->total_bytes(), used->size_bytes());
}

TEST_F(BlobStoreTest, BlobComesBackIfItWasNeededAfterAll) {
  const auto blob = store_->Put(text_);
  ASSERT_TRUE(blob.ok());
  const absl::Time future = absl::Now() + absl::Hours(1);
  const auto refuse_late = [&](const std::string& sha256, const auto& hide) {
    hide();
    EXPECT_FALSE(store_->Contains(sha256));
    return false;
  };
  EXPECT_EQ(store_->Collect(future, future, refuse_late), 0);
  EXPECT_TRUE(store_->Contains(blob->sha256()));
  const auto store_again = [&](const std::string&, const auto& hide) {
    hide();
    EXPECT_TRUE(store_->Put(text_).ok());
    return true;
  };
  store_->Collect(future, future, store_again);
  EXPECT_TRUE(store_->Contains(blob->sha256()));
  const auto fd = store_->OpenForRead(blob->sha256());
  ASSERT_TRUE(fd.ok());
  EXPECT_EQ(*FileSize(fd->get()), blob->size_bytes());
}

TEST_F(BlobStoreTest, BlobTouchedInTheLastMomentStays) {
  const auto blob = store_->Put(text_);
  ASSERT_TRUE(blob.ok());
  const absl::Time now = absl::Now();
  const auto set_time = [&](absl::Time time) {
    const timespec touched = absl::ToTimespec(time);
    const timespec times[] = {touched, touched};
    ASSERT_EQ(utimensat(AT_FDCWD, store_->PathOf(blob->sha256()).c_str(), times, 0), 0);
  };
  set_time(now - absl::Hours(2));
  const auto touch = [&](const std::string& sha256, const auto& hide) {
    store_->Touch(sha256);
    hide();
    return true;
  };
  EXPECT_EQ(store_->Collect(now - absl::Hours(1), now, touch), 0);
  EXPECT_TRUE(store_->Contains(blob->sha256()));
}

TEST_F(BlobStoreTest, NamesThatAreNoDigestsNeverReachTheDisk) {
  for (const char* name : {"", "../jobs.db", "ABCDEF", "/etc/passwd"}) {
    EXPECT_EQ(ReasonOf(store_->Size(name).status()), "BLOB_NOT_FOUND") << name;
    EXPECT_EQ(ReasonOf(store_->OpenForRead(name).status()), "BLOB_NOT_FOUND") << name;
  }
}

TEST_F(BlobStoreTest, ServersThatShareAFolderSeeEachOthersBlobsButNotTheirDrafts) {
  const auto open = [this](const std::string& name) {
    EXPECT_TRUE(MakeFolders(folder_ / name).ok());
    return *BlobStore::Open(folder_.path(), limits_, folder_ / name);
  };
  const auto here = open("nodes/here");
  const auto blob = here->Put(text_);
  ASSERT_TRUE(blob.ok());
  const std::string draft = here->NewWorkPath("job", 1);
  ASSERT_TRUE(WriteFileAtomically(draft, "a mesh").ok());
  const auto upload = here->StartUpload(kTenant, RefOf("other bytes"));
  ASSERT_TRUE(upload.ok() && (*upload)->Write(0, "other", 5).ok());

  const auto there = open("nodes/there");
  EXPECT_TRUE(there->Contains(blob->sha256()));
  EXPECT_EQ(there->UploadedSize(kTenant, RefOf("other bytes").sha256()), 0);
  const auto adopted = here->Adopt(draft);
  ASSERT_TRUE(adopted.ok()) << adopted.status();
  EXPECT_TRUE(there->Contains(adopted->sha256()));
  const absl::Time past = absl::Now() - absl::Hours(1);
  there->Collect(past, past, [](const std::string&, const auto&) { return false; });
  EXPECT_EQ(there->total_bytes(), blob->size_bytes() + adopted->size_bytes());
}

TEST_F(BlobStoreTest, WriteThatFailsHalfWayLeavesNothingBehind) {
  constexpr size_t kRoom = 1 << 20;
  const std::string bytes(2 * kRoom, 'x');
  const auto upload = Start(RefOf(bytes));
  ASSERT_TRUE(upload->Write(0, bytes.data(), 1000).ok());
  // No file may become longer: the disk seems to be full in the middle of the write.
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto ignored = signal(SIGXFSZ, SIG_IGN);
  const rlimit full{kRoom, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &full);
  const absl::Status status = upload->Write(1000, bytes.data(), bytes.size() - 1000);
  setrlimit(RLIMIT_FSIZE, &before);
  signal(SIGXFSZ, ignored);
  EXPECT_EQ(ReasonOf(status), "STORAGE_FULL") << status;
  EXPECT_EQ(store_->UploadedSize(kTenant, RefOf(bytes).sha256()), 1000);
  EXPECT_EQ(store_->uploading_bytes(), 1000);
  ASSERT_TRUE(upload->Write(1000, bytes.data(), bytes.size() - 1000).ok());
  EXPECT_TRUE(upload->Finish().ok());
  EXPECT_EQ(store_->uploading_bytes(), 0);
}

TEST_F(BlobStoreTest, BytesThatManyPublishAtOnceCountOnce) {
  const std::string bytes(100'000, 'x');
  constexpr int kTenants = 8;
  std::vector<std::thread> tenants;
  for (int i = 0; i < kTenants; ++i) {
    tenants.emplace_back([&, i] {
      const auto upload = store_->StartUpload("tenant" + std::to_string(i), RefOf(bytes));
      ASSERT_TRUE(upload.ok()) << upload.status();
      EXPECT_TRUE((*upload)->Write(0, bytes.data(), bytes.size()).ok());
      EXPECT_TRUE((*upload)->Finish().ok());
    });
  }
  for (std::thread& tenant : tenants) tenant.join();
  EXPECT_EQ(store_->total_bytes(), static_cast<int64_t>(bytes.size()));
  EXPECT_EQ(store_->uploading_bytes(), 0);
}

}  // namespace
}  // namespace amhex::server
