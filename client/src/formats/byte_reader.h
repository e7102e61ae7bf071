// Bounds-checked reading of little- and big-endian numbers from bytes in memory.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace amhex::client {

class ByteReader {
 public:
  ByteReader(std::string_view bytes, std::endian order) : bytes_(bytes), order_(order) {}

  size_t position() const { return position_; }
  size_t remaining() const { return bytes_.size() - position_; }

  // False, moving nowhere, when fewer than sizeof(T) bytes are left.
  template <class T>
  bool Read(T* value) {
    if (remaining() < sizeof(T)) return false;
    std::array<char, sizeof(T)> raw{};
    std::memcpy(raw.data(), bytes_.data() + position_, sizeof(T));
    if (order_ != std::endian::native) std::reverse(raw.begin(), raw.end());
    std::memcpy(value, raw.data(), sizeof(T));
    position_ += sizeof(T);
    return true;
  }

  bool Skip(size_t count) {
    if (remaining() < count) return false;
    position_ += count;
    return true;
  }

 private:
  std::string_view bytes_;
  std::endian order_;
  size_t position_ = 0;
};

}  // namespace amhex::client
