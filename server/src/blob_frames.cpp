#include "blob_frames.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <grpcpp/support/proto_buffer_reader.h>

#include <algorithm>
#include <array>
#include <string>

#include "errors.h"

namespace amhex::server {
namespace {

using amhex::v1::ReadBlobResponse;
using amhex::v1::WriteBlobRequest;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;
using google::protobuf::io::CodedOutputStream;

constexpr uint32_t Tag(int field, WireFormatLite::WireType type) {
  return static_cast<uint32_t>(field << WireFormatLite::kTagTypeBits) | type;
}

constexpr uint32_t kBlobTag =
    Tag(WriteBlobRequest::kBlobFieldNumber, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
constexpr uint32_t kOffsetTag =
    Tag(WriteBlobRequest::kOffsetFieldNumber, WireFormatLite::WIRETYPE_VARINT);
constexpr uint32_t kDataTag =
    Tag(WriteBlobRequest::kDataFieldNumber, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
constexpr uint32_t kFinishTag =
    Tag(WriteBlobRequest::kFinishFieldNumber, WireFormatLite::WIRETYPE_VARINT);
constexpr uint32_t kSentDataTag =
    Tag(ReadBlobResponse::kDataFieldNumber, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);

// Notes where the next bytes lie, and passes over them.
bool TakePieces(CodedInputStream* in, BytePieces* pieces) {
  uint32_t size = 0;
  if (!in->ReadVarint32(&size)) return false;
  pieces->clear();  // of a field that comes twice, the last counts
  while (size > 0) {
    const void* bytes = nullptr;
    int there = 0;
    if (!in->GetDirectBufferPointer(&bytes, &there) || there <= 0) return false;
    const uint32_t taken = std::min(size, static_cast<uint32_t>(there));
    pieces->emplace_back(static_cast<const char*>(bytes), taken);
    if (!in->Skip(static_cast<int>(taken))) return false;
    size -= taken;
  }
  return true;
}

bool ReadBlobField(CodedInputStream* in, amhex::v1::BlobRef* blob) {
  uint32_t size = 0;
  std::string bytes;
  return in->ReadVarint32(&size) && in->ReadString(&bytes, static_cast<int>(size)) &&
         blob->MergeFromString(bytes);
}

bool ReadField(uint32_t tag, CodedInputStream* in, ReceivedChunk* chunk) {
  uint64_t number = 0;
  switch (tag) {
    case kBlobTag:
      return ReadBlobField(in, &chunk->blob);
    case kOffsetTag:
      if (!in->ReadVarint64(&number)) return false;
      chunk->offset = static_cast<int64_t>(number);
      return true;
    case kDataTag:
      return TakePieces(in, &chunk->data);
    case kFinishTag:
      if (!in->ReadVarint64(&number)) return false;
      chunk->finish = number != 0;
      return true;
    default:
      return WireFormatLite::SkipField(in, tag);
  }
}

bool ReadFields(ReceivedChunk* chunk) {
  grpc::ProtoBufferReader reader(&chunk->buffer);
  if (!reader.status().ok()) return false;
  CodedInputStream in(&reader);
  for (uint32_t tag = in.ReadTag(); tag != 0; tag = in.ReadTag()) {
    if (!ReadField(tag, &in, chunk)) return false;
  }
  return in.ConsumedEntireMessage();
}

}  // namespace

absl::Status ParseChunk(ReceivedChunk* chunk) {
  // A message without a byte has no slice to read.
  if (!chunk->buffer.Valid() || chunk->buffer.Length() == 0 || ReadFields(chunk)) {
    return absl::OkStatus();
  }
  FieldViolations bad;
  bad.Add("message", "is no WriteBlobRequest");
  return bad.ToStatus();
}

grpc::Slice MakeRoom(size_t size) {
  // Not std::string or std::vector, which would write zeros first.
  return {new char[size], size, [](void* room) { delete[] static_cast<char*>(room); }};
}

grpc::ByteBuffer FrameChunk(const ReadBlobResponse& fields, const grpc::Slice& data) {
  std::string head = fields.SerializeAsString();
  constexpr size_t kLongestTagAndSize = size_t{2} * 5;
  std::array<uint8_t, kLongestTagAndSize> prefix;
  if (data.size() > 0) {
    uint8_t* end = CodedOutputStream::WriteTagToArray(kSentDataTag, prefix.data());
    end = CodedOutputStream::WriteVarint32ToArray(static_cast<uint32_t>(data.size()), end);
    head.append(reinterpret_cast<const char*>(prefix.data()),
                static_cast<size_t>(end - prefix.data()));
  }
  const std::array<grpc::Slice, 2> slices = {grpc::Slice(head), data};
  return {slices.data(), slices.size()};
}

}  // namespace amhex::server
