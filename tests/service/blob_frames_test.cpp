// Chunks on the wire, beside protobuf's own reading and writing of the same messages.
#include "blob_frames.h"

#include <gtest/gtest.h>

#include <random>

#include "errors.h"

namespace amhex::server {
namespace {

using amhex::v1::ReadBlobResponse;
using amhex::v1::WriteBlobRequest;

// The bytes in slices of random sizes, as they may come from the network.
grpc::ByteBuffer Sliced(const std::string& bytes, std::mt19937* random) {
  std::vector<grpc::Slice> slices;
  for (size_t begin = 0; begin < bytes.size();) {
    const size_t size = std::min<size_t>(bytes.size() - begin, 1 + (*random)() % 60);
    slices.emplace_back(bytes.data() + begin, size);
    begin += size;
  }
  return {slices.data(), slices.size()};
}

std::string Joined(const BytePieces& pieces) {
  std::string all;
  for (const std::string_view piece : pieces) all += piece;
  return all;
}

std::string Joined(const grpc::ByteBuffer& buffer) {
  std::vector<grpc::Slice> slices;
  EXPECT_TRUE(buffer.Dump(&slices).ok());
  std::string all;
  for (const grpc::Slice& slice : slices) {
    all.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  }
  return all;
}

WriteBlobRequest RandomRequest(std::mt19937* random) {
  WriteBlobRequest request;
  if ((*random)() % 2 != 0) {
    request.mutable_blob()->set_sha256(std::string((*random)() % 70, 'a'));
    request.mutable_blob()->set_size_bytes(static_cast<int64_t>((*random)()) << ((*random)() % 32));
  }
  if ((*random)() % 2 != 0) request.set_offset(static_cast<int64_t>((*random)()) - 1000);
  std::string data((*random)() % 300, '\0');
  for (char& c : data) c = static_cast<char>((*random)());
  request.set_data(data);
  request.set_finish((*random)() % 2 != 0);
  return request;
}

void ExpectReadAlike(const std::string& bytes, std::mt19937* random) {
  WriteBlobRequest expected;
  const bool is_request = expected.ParseFromString(bytes);
  ReceivedChunk chunk;
  chunk.buffer = Sliced(bytes, random);
  const absl::Status status = ParseChunk(&chunk);
  ASSERT_EQ(status.ok(), is_request) << status;
  if (!is_request) {
    EXPECT_EQ(ReasonOf(status), "BAD_REQUEST");
    return;
  }
  EXPECT_EQ(chunk.blob.SerializeAsString(), expected.blob().SerializeAsString());
  EXPECT_EQ(chunk.offset, expected.offset());
  EXPECT_EQ(Joined(chunk.data), expected.data());
  EXPECT_EQ(chunk.finish, expected.finish());
}

TEST(BlobFrames, MessageWithoutABytesIsAnEmptyChunk) {
  std::mt19937 random(1);
  ExpectReadAlike("", &random);
  ReceivedChunk chunk;
  EXPECT_TRUE(ParseChunk(&chunk).ok());
}

TEST(BlobFrames, RequestsAreReadAsProtobufReadsThem) {
  std::mt19937 random(2);
  for (int i = 0; i < 2000; ++i) {
    std::string bytes = RandomRequest(&random).SerializeAsString();
    // Fields that come twice or that are not known.
    if (random() % 3 == 0) bytes += RandomRequest(&random).SerializeAsString();
    if (random() % 3 == 0) bytes += "\x7a\x02hi\x80\x01\x05";
    ExpectReadAlike(bytes, &random);
  }
}

TEST(BlobFrames, DamagedRequestsAreReadOrRefusedAsProtobufDoes) {
  std::mt19937 random(3);
  for (int i = 0; i < 5000; ++i) {
    std::string bytes = RandomRequest(&random).SerializeAsString();
    bytes.resize(random() % (bytes.size() + 1));
    for (int change = static_cast<int>(random() % 4); change > 0 && !bytes.empty(); --change) {
      bytes[random() % std::min<size_t>(bytes.size(), 100)] = static_cast<char>(random());
    }
    ExpectReadAlike(bytes, &random);
  }
}

TEST(BlobFrames, BytesStayWhereTheyWereReceived) {
  WriteBlobRequest request;
  // Bytes of small slices lie within whoever holds the slice.
  request.set_data(std::string(1000, 'x'));
  ReceivedChunk chunk;
  const grpc::Slice large(request.SerializeAsString());
  chunk.buffer = grpc::ByteBuffer(&large, 1);
  ASSERT_TRUE(ParseChunk(&chunk).ok());
  ASSERT_EQ(chunk.data.size(), 1u);
  const auto* begin = reinterpret_cast<const uint8_t*>(chunk.data[0].data());
  EXPECT_GE(begin, large.begin());
  EXPECT_LE(begin + chunk.data[0].size(), large.end());
}

TEST(BlobFrames, AnswersAreWhatProtobufWouldHaveWritten) {
  for (const size_t size : {0u, 1u, 127u, 128u, 70'000u}) {
    ReadBlobResponse fields;
    fields.set_offset(static_cast<int64_t>(size) << 20);
    fields.set_blob_size_bytes(size == 1 ? 12345 : 0);
    const std::string data(size, 'y');
    const grpc::ByteBuffer frame = FrameChunk(fields, grpc::Slice(data));
    ReadBlobResponse read;
    ASSERT_TRUE(read.ParseFromString(Joined(frame)));
    fields.set_data(data);
    EXPECT_EQ(read.SerializeAsString(), fields.SerializeAsString());
  }
}

TEST(BlobFrames, BytesAreSentFromWhereTheyWereReadTo) {
  const grpc::Slice room = MakeRoom(100'000);
  const grpc::ByteBuffer frame = FrameChunk(ReadBlobResponse(), room);
  std::vector<grpc::Slice> slices;
  ASSERT_TRUE(frame.Dump(&slices).ok());
  ASSERT_EQ(slices.size(), 2u);
  EXPECT_EQ(slices[1].begin(), room.begin());
}

}  // namespace
}  // namespace amhex::server
