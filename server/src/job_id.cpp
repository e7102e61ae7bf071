#include "job_id.h"

#include <array>
#include <cctype>
#include <cstdint>
#include <random>

namespace amhex::server {
namespace {

constexpr char kJobPrefix[] = "jobs/";
constexpr size_t kUuidLength = 36;
constexpr int kUuidBytes = 16;
constexpr int kTimestampBytes = 6;

bool IsDashPosition(size_t position) {
  return position == 8 || position == 13 || position == 18 || position == 23;
}

std::string FormatUuid(const std::array<uint8_t, kUuidBytes>& bytes) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  text.reserve(kUuidLength);
  for (const uint8_t byte : bytes) {
    if (IsDashPosition(text.size())) text.push_back('-');
    text.push_back(kDigits[byte >> 4]);
    text.push_back(kDigits[byte & 0xf]);
  }
  return text;
}

}  // namespace

std::string MakeUuid(absl::Time now) {
  std::array<uint8_t, kUuidBytes> bytes;
  const auto milliseconds = static_cast<uint64_t>(absl::ToUnixMillis(now));
  for (int i = 0; i < kTimestampBytes; ++i) {
    bytes[i] = static_cast<uint8_t>(milliseconds >> (8 * (kTimestampBytes - 1 - i)));
  }
  static thread_local std::random_device random;
  for (int i = kTimestampBytes; i < kUuidBytes; ++i) bytes[i] = static_cast<uint8_t>(random());
  bytes[6] = static_cast<uint8_t>((bytes[6] & 0x0f) | 0x70);  // version 7
  bytes[8] = static_cast<uint8_t>((bytes[8] & 0x3f) | 0x80);  // variant of RFC 9562
  return FormatUuid(bytes);
}

bool IsUuid(const std::string& text) {
  if (text.size() != kUuidLength) return false;
  for (size_t i = 0; i < text.size(); ++i) {
    const bool ok = IsDashPosition(i) ? text[i] == '-'
                                      : std::isxdigit(static_cast<unsigned char>(text[i])) != 0;
    if (!ok) return false;
  }
  return true;
}

std::string JobIdFromName(const std::string& name) {
  const std::string prefix = kJobPrefix;
  if (name.compare(0, prefix.size(), prefix) != 0) return "";
  const std::string id = name.substr(prefix.size());
  return IsUuid(id) ? id : "";
}

std::string JobName(const std::string& job_id) { return kJobPrefix + job_id; }

}  // namespace amhex::server
