#include "formats/vtk_arrays.h"

#include <zlib.h>

#include <algorithm>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace amhex::client {
namespace {

constexpr size_t kSizeBytes = sizeof(uint64_t);

void AppendSize(uint64_t size, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&size), kSizeBytes);
}

uint64_t SizeAt(const std::string& bytes, size_t index) {
  uint64_t size = 0;
  std::memcpy(&size, bytes.data() + index * kSizeBytes, kSizeBytes);
  return size;
}

size_t Base64Length(size_t byte_count) { return (byte_count + 2) / 3 * 4; }

absl::Status Damaged(const char* what) {
  return absl::InvalidArgumentError(absl::StrCat("a binary data array is damaged: ", what));
}

absl::StatusOr<std::string> FromBase64(std::string_view text) {
  std::string bytes;
  if (!absl::Base64Unescape(absl::string_view(text.data(), text.size()), &bytes)) {
    return Damaged("it is not base64");
  }
  return bytes;
}

}  // namespace

std::string EncodeVtkArray(std::string_view raw) {
  const size_t block_count = (raw.size() + kVtkBlockBytes - 1) / kVtkBlockBytes;
  std::string sizes, blocks;
  AppendSize(block_count, &sizes);
  AppendSize(kVtkBlockBytes, &sizes);
  AppendSize(raw.size() % kVtkBlockBytes, &sizes);  // 0 = the last block is full
  for (size_t i = 0; i < block_count; ++i) {
    const std::string_view block = raw.substr(i * kVtkBlockBytes, kVtkBlockBytes);
    uLongf length = compressBound(block.size());
    std::string packed(length, '\0');
    compress2(reinterpret_cast<Bytef*>(packed.data()), &length,
              reinterpret_cast<const Bytef*>(block.data()), block.size(), Z_DEFAULT_COMPRESSION);
    blocks.append(packed, 0, length);
    AppendSize(length, &sizes);
  }
  return absl::StrCat(absl::Base64Escape(sizes), absl::Base64Escape(blocks));
}

absl::StatusOr<std::string> DecodeVtkArray(std::string_view text, size_t most_bytes) {
  constexpr size_t kFixedSizes = 3;
  const size_t fixed_length = Base64Length(kFixedSizes * kSizeBytes);
  if (text.size() < fixed_length) return Damaged("it is shorter than its table of sizes");
  absl::StatusOr<std::string> fixed = FromBase64(text.substr(0, fixed_length));
  if (!fixed.ok()) return fixed.status();
  if (fixed->size() < kFixedSizes * kSizeBytes) return Damaged("its table of sizes is cut off");
  const uint64_t block_count = SizeAt(*fixed, 0), block_bytes = SizeAt(*fixed, 1);
  const uint64_t last_bytes = SizeAt(*fixed, 2);
  if (block_count == 0) return std::string();
  constexpr uint64_t kLargestBlock = uint64_t{1} << 30;
  if (block_count > text.size() / kSizeBytes || block_bytes > kLargestBlock ||
      last_bytes > block_bytes ||
      (block_count - 1) * block_bytes + (last_bytes != 0 ? last_bytes : block_bytes) > most_bytes) {
    return Damaged("its table of sizes promises too much");
  }
  const size_t table_length = Base64Length((kFixedSizes + block_count) * kSizeBytes);
  if (text.size() < table_length) return Damaged("it is shorter than its table of sizes");
  absl::StatusOr<std::string> table = FromBase64(text.substr(0, table_length));
  if (!table.ok()) return table.status();
  absl::StatusOr<std::string> packed = FromBase64(text.substr(table_length));
  if (!packed.ok()) return packed.status();
  if (table->size() < (kFixedSizes + block_count) * kSizeBytes) return Damaged("table cut off");
  std::string raw;
  size_t offset = 0;
  for (uint64_t i = 0; i < block_count; ++i) {
    const uint64_t packed_bytes = SizeAt(*table, kFixedSizes + i);
    const bool is_short = i + 1 == block_count && last_bytes != 0;
    uLongf length = is_short ? last_bytes : block_bytes;
    if (packed_bytes > packed->size() - offset) return Damaged("it ends inside a block");
    std::string block(length, '\0');
    const uLongf expected = length;
    if (uncompress(reinterpret_cast<Bytef*>(block.data()), &length,
                   reinterpret_cast<const Bytef*>(packed->data() + offset), packed_bytes) != Z_OK ||
        length != expected) {
      return Damaged("a block does not inflate to its size");
    }
    offset += packed_bytes;
    raw += block;
  }
  return raw;
}

}  // namespace amhex::client
