// The header of a PLY file: which elements follow, in which encoding.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace amhex::client {

enum class PlyEncoding : uint8_t { kAscii, kLittleEndian, kBigEndian };
enum class PlyType : uint8_t {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kFloat32,
  kFloat64
};

// Bytes of one number of that type in the binary encodings.
size_t SizeOf(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;  // of the number, or of a list's items
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;  // of a list's length
};

struct PlyElement {
  std::string name;
  int64_t count = 0;
  std::vector<PlyProperty> properties;

  // Index of the property called `wanted`, or -1.
  int Find(std::string_view wanted) const;
  // Fewest bytes one instance can take: in ascii a digit and a separator per number.
  size_t SmallestBytes(PlyEncoding encoding) const;
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  size_t body_offset = 0;  // byte after the header's last line
  int64_t body_line = 1;   // line number there
};

// INVALID_ARGUMENT naming the line. Element counts that cannot fit the bytes are refused here.
absl::StatusOr<PlyHeader> ReadPlyHeader(std::string_view bytes);

}  // namespace amhex::client
