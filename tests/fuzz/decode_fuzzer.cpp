// The whole way from an input's bytes to a surface, decoder included, under small limits. What
// comes back holds together: every triangle names points that are there. The first byte chooses
// the encoding.
#include <cstdint>
#include <cstdlib>
#include <string>
#include <variant>

#include "surface_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace amhex::server;
  if (size == 0) return 0;
  Limits limits;
  limits.max_point_count = 10'000;
  limits.max_triangle_count = 20'000;
  const auto encoding =
      (data[0] & 1) == 0 ? amhex::v1::INPUT_ENCODING_DRACO : amhex::v1::INPUT_ENCODING_ARRAYS;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto input = DecodeInput(encoding, bytes, limits);
  if (!input.ok()) return 0;
  const auto* mesh = std::get_if<amhex::TriangleMesh>(&input->hull);
  if (mesh == nullptr) return 0;
  const auto vertex_count = static_cast<int64_t>(mesh->vertices.size());
  for (const auto& triangle : mesh->triangles) {
    for (const auto corner : triangle) {
      if (corner < 0 || corner >= vertex_count) std::abort();
    }
  }
  return 0;
}
