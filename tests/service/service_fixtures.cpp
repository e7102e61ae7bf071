#include "service_fixtures.h"

#include <cstdlib>
#include <filesystem>

#include "absl/time/clock.h"

namespace amhex::server {
namespace {

template <class T>
void Append(T value, std::string* bytes) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

std::string ArraysHeader(int64_t point_count, int64_t triangle_count) {
  std::string bytes = "AMHEXHUL";
  Append(int32_t{1}, &bytes);
  Append(int32_t{0}, &bytes);
  Append(point_count, &bytes);
  Append(triangle_count, &bytes);
  return bytes;
}

constexpr size_t kPointBytes = 24;

}  // namespace

TemporaryFolder::TemporaryFolder() {
  path_ = (std::filesystem::temp_directory_path() / "amhex-test-XXXXXX").string();
  if (mkdtemp(path_.data()) == nullptr) std::abort();
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  std::filesystem::remove_all(path_, error);
}

std::string ScriptInput(const std::string& script) {
  std::string body = script;
  body.resize((body.size() + kPointBytes - 1) / kPointBytes * kPointBytes, ' ');
  return ArraysHeader(static_cast<int64_t>(body.size() / kPointBytes), 0) + body;
}

amhex::v1::SubmitJobRequest ScriptRequest(const std::string& script) {
  amhex::v1::SubmitJobRequest request;
  request.set_input_encoding(amhex::v1::INPUT_ENCODING_ARRAYS);
  request.set_inline_input(ScriptInput(script));
  return request;
}

std::string CubeInput() {
  std::string bytes = ArraysHeader(8, 12);
  for (int corner = 0; corner < 8; ++corner) {
    for (int axis = 0; axis < 3; ++axis) Append(double((corner >> axis) & 1), &bytes);
  }
  // Two triangles per side, counter-clockwise from outside; corner c is at bits (x, y, z) of c.
  constexpr int32_t kTriangles[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6},
                                         {0, 1, 5}, {0, 5, 4}, {2, 6, 7}, {2, 7, 3},
                                         {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  for (const auto& triangle : kTriangles) {
    for (const int32_t corner : triangle) Append(corner, &bytes);
  }
  return bytes;
}

std::string DracoFileHeader(int major, int minor, int type, int method, int flags) {
  std::string bytes = "DRACO";
  for (const int byte : {major, minor, type, method, flags & 0xff, flags >> 8}) {
    bytes.push_back(static_cast<char>(byte));
  }
  return bytes;
}

std::string Varint(uint64_t value) {
  std::string bytes;
  do {
    const auto low = static_cast<char>(value & 0x7f);
    value >>= 7;
    bytes.push_back(static_cast<char>(value != 0 ? low | '\x80' : low));
  } while (value != 0);
  return bytes;
}

std::string LittleEndian(uint64_t value, int byte_count) {
  std::string bytes;
  for (int i = 0; i < byte_count; ++i) bytes.push_back(static_cast<char>(value >> (8 * i)));
  return bytes;
}

bool Eventually(const std::function<bool()>& condition, absl::Duration patience) {
  const absl::Time deadline = absl::Now() + patience;
  while (absl::Now() < deadline) {
    if (condition()) return true;
    absl::SleepFor(absl::Milliseconds(5));
  }
  return condition();
}

}  // namespace amhex::server
