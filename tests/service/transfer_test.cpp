// Uploads and downloads of many chunks through the real amhexd: what goes wrong half way, and what
// they cost in memory.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "amhex/v1/blob_service.grpc.pb.h"
#include "daemon_fixture.h"
#include "error_reason.h"
#include "job.h"
#include "process_view.h"
#include "sha256.h"

namespace amhex::server {
namespace {

using amhex::v1::Job;
using amhex::v1::ReadBlobResponse;
using amhex::v1::WriteBlobRequest;
using amhex::v1::WriteBlobResponse;

constexpr size_t kChunkBytes = 1 << 20;
// More than the server takes at a time, and no whole number of chunks.
constexpr size_t kBlobBytes = 20 * kChunkBytes + 12345;

// What many downloads at once may add, whatever their sizes: per client two chunks that are read
// and sent, and what HTTP/2 lets be under way; per thread that reads chunks (kBlockingThreads of
// server.cpp) the freed ones that its part of the heap keeps (kKeptBytes there); how many threads
// come to read is the scheduler's choice; and room to breathe.
constexpr int kClients = 8;
constexpr int64_t kBoundBytes =
    (kClients * int64_t{8 << 20}) + (8 * int64_t{16 << 20}) + (32 << 20) + kQuarantineBytes;

std::string SomeBytes(size_t size) {
  std::string bytes(size, '\0');
  uint32_t state = 1;
  for (char& c : bytes) {
    state = state * 1664525u + 1013904223u;  // Numerical Recipes' generator
    c = static_cast<char>(state >> 24);
  }
  return bytes;
}

class TransferTest : public DaemonTest {
 protected:
  void SetUp() override {
    Start();
    blobs_ = amhex::v1::Blobs::NewStub(channel());
    blob_.set_sha256(Sha256Hex(bytes_));
    blob_.set_size_bytes(static_cast<int64_t>(bytes_.size()));
  }

  WriteBlobRequest ChunkAt(size_t offset) const {
    WriteBlobRequest chunk;
    *chunk.mutable_blob() = blob_;
    chunk.set_offset(static_cast<int64_t>(offset));
    chunk.set_data(bytes_.substr(offset, kChunkBytes));
    chunk.set_finish(offset + kChunkBytes >= bytes_.size());
    return chunk;
  }

  // Sends chunks of [begin, end).
  grpc::Status Upload(size_t begin, size_t end, WriteBlobResponse* response) {
    grpc::ClientContext context;
    const auto stream = blobs_->WriteBlob(&context, response);
    for (size_t offset = begin; offset < end; offset += kChunkBytes) {
      if (!stream->Write(ChunkAt(offset))) break;
    }
    stream->WritesDone();
    return stream->Finish();
  }

  // The size of what came, and its digest.
  std::pair<int64_t, std::string> Download(const std::string& sha256) {
    grpc::ClientContext context;
    amhex::v1::ReadBlobRequest request;
    request.mutable_blob()->set_sha256(sha256);
    const auto stream = blobs_->ReadBlob(&context, request);
    Sha256 hash;
    int64_t size = 0;
    for (ReadBlobResponse chunk; stream->Read(&chunk);) {
      EXPECT_EQ(chunk.offset(), size);
      hash.Update(chunk.data().data(), chunk.data().size());
      size += static_cast<int64_t>(chunk.data().size());
    }
    const grpc::Status status = stream->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message();
    return {size, hash.HexDigest()};
  }

  int64_t PeakMemoryOfServer() const {
    std::ifstream status(absl::StrCat("/proc/", pid(), "/status"));
    for (std::string word; status >> word;) {
      int64_t kibibytes = 0;
      if (word == "VmHWM:" && status >> kibibytes) return kibibytes << 10;
    }
    ADD_FAILURE() << "no VmHWM";
    return 0;
  }

  const std::string bytes_ = SomeBytes(kBlobBytes);
  amhex::v1::BlobRef blob_;
  std::unique_ptr<amhex::v1::Blobs::Stub> blobs_;
};

TEST_F(TransferTest, ManyChunksComeBackAsTheyWere) {
  WriteBlobResponse response;
  const grpc::Status status = Upload(0, bytes_.size(), &response);
  ASSERT_TRUE(status.ok()) << status.error_message();
  EXPECT_TRUE(response.complete());
  EXPECT_EQ(response.committed_size(), blob_.size_bytes());
  EXPECT_EQ(Download(blob_.sha256()), std::make_pair(blob_.size_bytes(), blob_.sha256()));
}

TEST_F(TransferTest, HalfAnUploadIsStoredAndContinued) {
  WriteBlobResponse response;
  ASSERT_TRUE(Upload(0, 7 * kChunkBytes, &response).ok());
  EXPECT_FALSE(response.complete());
  EXPECT_EQ(response.committed_size(), static_cast<int64_t>(7 * kChunkBytes));
  ASSERT_TRUE(Upload(7 * kChunkBytes, bytes_.size(), &response).ok());
  EXPECT_TRUE(response.complete());
  // All is there already: the answer comes although nothing but the first chunk is looked at.
  ASSERT_TRUE(Upload(0, bytes_.size(), &response).ok());
  EXPECT_TRUE(response.complete());
}

TEST_F(TransferTest, WrongChunkInTheMiddleEndsTheStreamAndKeepsWhatCameBefore) {
  grpc::ClientContext context;
  WriteBlobResponse response;
  const auto stream = blobs_->WriteBlob(&context, &response);
  ASSERT_TRUE(stream->Write(ChunkAt(0)));
  // The second is missing. The server ends the stream while the client still sends.
  for (size_t offset = 2 * kChunkBytes; offset < bytes_.size(); offset += kChunkBytes) {
    if (!stream->Write(ChunkAt(offset))) break;
  }
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::OUT_OF_RANGE);
  EXPECT_EQ(Reason(status), "WRONG_OFFSET");
  ASSERT_TRUE(Upload(kChunkBytes, bytes_.size(), &response).ok());
  EXPECT_TRUE(response.complete());
}

TEST_F(TransferTest, ErrorIsToldToAClientThatSendsNoMore) {
  grpc::ClientContext context;
  WriteBlobResponse response;
  const auto stream = blobs_->WriteBlob(&context, &response);
  ASSERT_TRUE(stream->Write(ChunkAt(kChunkBytes)));
  // Neither more chunks nor the end of the stream: the server must not wait for either.
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(Reason(status), "WRONG_OFFSET");
}

TEST_F(TransferTest, StreamWithoutAMessageIsRefused) {
  WriteBlobResponse response;
  const grpc::Status status = Upload(0, 0, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(Reason(status), "BAD_REQUEST");
}

TEST_F(TransferTest, ClientsThatVanishLeaveWhatTheyHaveSent) {
  for (int round = 0; round < 5; ++round) {
    grpc::ClientContext context;
    WriteBlobResponse response;
    const auto stream = blobs_->WriteBlob(&context, &response);
    for (int i = 0; i < 3; ++i) stream->Write(ChunkAt(static_cast<size_t>(i) * kChunkBytes));
    context.TryCancel();
    stream->Finish();
  }
  amhex::v1::QueryWriteStatusRequest request;
  *request.mutable_blob() = blob_;
  grpc::ClientContext context;
  amhex::v1::QueryWriteStatusResponse there;
  ASSERT_TRUE(blobs_->QueryWriteStatus(&context, request, &there).ok());
  WriteBlobResponse response;
  // A stream that was cut may still be writing; a newer one takes over from wherever it is.
  ASSERT_TRUE(Eventually([&] {
    grpc::ClientContext another;
    if (!blobs_->QueryWriteStatus(&another, request, &there).ok()) return false;
    return Upload(static_cast<size_t>(there.committed_size()), bytes_.size(), &response).ok();
  }));
  EXPECT_TRUE(response.complete());
}

TEST_F(TransferTest, EightParallelDownloadsOfHalfAGigabyteStayWithinConstantMemory) {
  constexpr int64_t kResultBytes = 500'000'000;
  static_assert(kBoundBytes < kResultBytes + kQuarantineBytes, "less than one of them is held");
  const std::string name = Submit(absl::StrCat("hollow ", kResultBytes, ";"));
  ASSERT_TRUE(Reaches(name, Job::SUCCEEDED)) << Get(name).ShortDebugString();
  const std::string sha256 = Get(name).result().mesh().sha256();
  const int64_t before = PeakMemoryOfServer();
  std::atomic<int> whole{0};
  std::vector<std::thread> clients;
  for (int i = 0; i < kClients; ++i) {
    clients.emplace_back([&] {
      // A connection of its own.
      grpc::ChannelArguments arguments;
      arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
      const auto blobs = amhex::v1::Blobs::NewStub(
          grpc::CreateCustomChannel(Port("grpc"), grpc::InsecureChannelCredentials(), arguments));
      grpc::ClientContext context;
      // gRPC 1.51 now and then takes another call's error for one of connect(), and tries again.
      context.set_wait_for_ready(true);
      amhex::v1::ReadBlobRequest request;
      request.mutable_blob()->set_sha256(sha256);
      const auto stream = blobs->ReadBlob(&context, request);
      int64_t size = 0;
      for (ReadBlobResponse chunk; stream->Read(&chunk);) {
        size += static_cast<int64_t>(chunk.data().size());
      }
      const grpc::Status status = stream->Finish();
      EXPECT_TRUE(status.ok()) << status.error_code() << ": " << status.error_message();
      if (status.ok() && size == kResultBytes) ++whole;
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(whole, kClients);
  EXPECT_LE(PeakMemoryOfServer() - before, kBoundBytes);
}

TEST_F(TransferTest, ClientsThatDoNotReadCostNoMoreThanWhatIsUnderWay) {
  const std::string name = Submit(absl::StrCat("hollow ", 150'000'000, ";"));
  ASSERT_TRUE(Reaches(name, Job::SUCCEEDED)) << Get(name).ShortDebugString();
  const int64_t before = PeakMemoryOfServer();
  amhex::v1::ReadBlobRequest request;
  request.mutable_blob()->set_sha256(Get(name).result().mesh().sha256());
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReader<ReadBlobResponse>>> streams;
  for (int i = 0; i < kClients; ++i) {
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(blobs_->ReadBlob(contexts.back().get(), request));
    ReadBlobResponse chunk;
    ASSERT_TRUE(streams.back()->Read(&chunk));
  }
  // Meanwhile everything else goes on.
  EXPECT_EQ(Get(name).state(), Job::SUCCEEDED);
  EXPECT_LE(PeakMemoryOfServer() - before, kBoundBytes);
  for (int i = 0; i < kClients; ++i) {
    contexts[static_cast<size_t>(i)]->TryCancel();
    streams[static_cast<size_t>(i)]->Finish();
  }
}

}  // namespace
}  // namespace amhex::server
