// Chunks of blobs as they are on the wire, read and written without copying their bytes: what came
// stays where gRPC has put it, what goes is read from disk to where gRPC takes it from.
#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/slice.h>

#include <cstdint>

#include "absl/status/status.h"
#include "amhex/v1/blob_service.pb.h"
#include "blob_store.h"

namespace amhex::server {

// A WriteBlobRequest. `data` points into `buffer`.
struct ReceivedChunk {
  grpc::ByteBuffer buffer;
  amhex::v1::BlobRef blob;
  int64_t offset = 0;
  BytePieces data;
  bool finish = false;
};

// Reads the fields of `chunk->buffer`. INVALID_ARGUMENT BAD_REQUEST if it is no WriteBlobRequest.
absl::Status ParseChunk(ReceivedChunk* chunk);

// Room for `size` bytes that a slice frees when nobody needs them any more; not set to anything.
grpc::Slice MakeRoom(size_t size);

// A ReadBlobResponse: its fields but `data`, and the bytes of `data`.
grpc::ByteBuffer FrameChunk(const amhex::v1::ReadBlobResponse& fields, const grpc::Slice& data);

}  // namespace amhex::server
