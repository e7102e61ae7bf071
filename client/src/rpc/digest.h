// SHA-256 and random UUIDs.
#pragma once

#include <string>
#include <string_view>

namespace amhex::client {

// 64 lower-case hexadecimal digits.
std::string Sha256Hex(std::string_view bytes);

// A random UUID of version 4, 36 characters.
std::string RandomUuid();

}  // namespace amhex::client
