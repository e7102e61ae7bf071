#include "rpc/digest.h"

#include <openssl/evp.h>
#include <openssl/rand.h>

#include <array>

#include "absl/strings/escaping.h"

namespace amhex::client {

std::string Sha256Hex(std::string_view bytes) {
  constexpr size_t kDigestBytes = 32;
  std::array<unsigned char, kDigestBytes> digest{};
  EVP_Digest(bytes.data(), bytes.size(), digest.data(), nullptr, EVP_sha256(), nullptr);
  return absl::BytesToHexString(
      absl::string_view(reinterpret_cast<const char*>(digest.data()), digest.size()));
}

std::string RandomUuid() {
  std::array<unsigned char, 16> random{};
  RAND_bytes(random.data(), static_cast<int>(random.size()));
  random[6] = static_cast<unsigned char>((random[6] & 0x0f) | 0x40);  // version 4
  random[8] = static_cast<unsigned char>((random[8] & 0x3f) | 0x80);  // variant of RFC 4122
  std::string uuid = absl::BytesToHexString(
      absl::string_view(reinterpret_cast<const char*>(random.data()), random.size()));
  for (size_t dash : {20u, 16u, 12u, 8u}) uuid.insert(dash, 1, '-');
  return uuid;
}

}  // namespace amhex::client
