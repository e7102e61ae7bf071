// From arbitrary bytes to inputs of the engine, small enough to be meshed in a moment.
#pragma once

#include <cstddef>
#include <cstdint>

#include "amhex/input_hull.h"

namespace amhex::fuzz {

// Takes numbers from bytes; zeros once they are used up.
class ByteSource {
 public:
  ByteSource(const uint8_t* data, size_t size) : data_(data), size_(size) {}

  uint8_t Byte() { return at_ < size_ ? data_[at_++] : uint8_t{0}; }
  int Below(int count) { return Byte() % count; }
  bool AtEnd() const { return at_ >= size_; }
  // Mostly a point of a coarse grid, so that points coincide and triangles touch; now and then any
  // 64 bits.
  double Number();

 private:
  const uint8_t* data_;
  size_t size_;
  size_t at_ = 0;
};

// Lists may contradict each other and name what is not there.
MeshingInput AnyInput(ByteSource* bytes);

// Up to 48 triangles over up to 24 points, all of them there.
TriangleMesh SmallSoup(ByteSource* bytes);

// What a fuzzer calls. Both end the process when the engine breaks its promise: a crash, a status
// without a message, an INTERNAL one other than that no mesh was found, or a mesh that breaks the
// law.
void CheckAnyInput(const uint8_t* data, size_t size);
void MeshSmallSoup(const uint8_t* data, size_t size);

}  // namespace amhex::fuzz
