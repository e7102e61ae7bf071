// Object File Format: OFF with any of the prefixes ST, C, N; colours and texture are skipped.
#include <vector>

#include "absl/strings/str_cat.h"
#include "formats/hull_builder.h"
#include "formats/hull_reader.h"
#include "formats/status_macros.h"
#include "formats/text_scanner.h"

namespace amhex::client {
namespace {

struct OffHeader {
  bool has_normals = false;
  int64_t vertex_count = 0;
  int64_t face_count = 0;
};

// The shortest vertex is "0 0 0\n", the shortest face "3 0 1 2\n".
constexpr size_t kShortestVertex = 6;
constexpr size_t kShortestFace = 8;

absl::StatusOr<OffHeader> ReadHeader(TextScanner* scanner) {
  const std::string_view magic = scanner->NextWord();
  constexpr std::string_view kSuffix = "OFF";
  if (magic.size() < kSuffix.size() || magic.substr(magic.size() - kSuffix.size()) != kSuffix) {
    return scanner->Error("an OFF file begins with OFF, this one with " + Quoted(magic));
  }
  OffHeader header;
  for (char c : magic.substr(0, magic.size() - kSuffix.size())) {
    if (c == 'N') header.has_normals = true;
    if (c == '4' || c == 'n') return scanner->Error("OFF files of four dimensions are not read");
  }
  AMHEX_ASSIGN_OR_RETURN(header.vertex_count, scanner->NextInteger("the number of vertices"));
  AMHEX_ASSIGN_OR_RETURN(header.face_count, scanner->NextInteger("the number of faces"));
  const int64_t left = static_cast<int64_t>(scanner->remaining());
  if (header.vertex_count < 0 || header.face_count < 0 ||
      header.vertex_count > left / static_cast<int64_t>(kShortestVertex) ||
      header.face_count > left / static_cast<int64_t>(kShortestFace) + 1) {
    return scanner->Error(absl::StrCat("the header promises ", header.vertex_count,
                                       " vertices and ", header.face_count, " faces, but only ",
                                       left, " bytes follow"));
  }
  scanner->SkipLine();  // the number of edges, which nobody fills in
  return header;
}

absl::Status ReadVertices(TextScanner* scanner, const OffHeader& header, HullBuilder* builder) {
  builder->vertices.reserve(static_cast<size_t>(header.vertex_count));
  for (int64_t i = 0; i < header.vertex_count; ++i) {
    const std::string what = absl::StrCat("a coordinate of vertex ", i);
    Vec3d v, n;
    for (int axis = 0; axis < 3; ++axis) {
      AMHEX_ASSIGN_OR_RETURN(v[axis], scanner->NextDouble(what));
    }
    for (int axis = 0; header.has_normals && axis < 3; ++axis) {
      AMHEX_ASSIGN_OR_RETURN(n[axis], scanner->NextDouble("a normal of the same vertex"));
    }
    builder->vertices.push_back(v);
    if (header.has_normals) builder->normals.push_back(n);
    scanner->SkipLine();
  }
  return absl::OkStatus();
}

absl::Status ReadFaces(TextScanner* scanner, const OffHeader& header, HullBuilder* builder) {
  std::vector<int64_t> corners;
  for (int64_t i = 0; i < header.face_count; ++i) {
    AMHEX_ASSIGN_OR_RETURN(const int64_t count,
                           scanner->NextInteger(absl::StrCat("the corner count of face ", i)));
    if (count < 3 || count > kMaxPolygonCorners) {
      return scanner->Error(absl::StrCat("face ", i, " has ", count, " corners; 3 to ",
                                         kMaxPolygonCorners, " are supported"));
    }
    corners.clear();
    for (int64_t k = 0; k < count; ++k) {
      AMHEX_ASSIGN_OR_RETURN(const int64_t corner,
                             scanner->NextInteger(absl::StrCat("a corner of face ", i)));
      corners.push_back(corner);
    }
    const absl::Status added = builder->AddPolygon(corners);
    if (!added.ok()) return scanner->Error(std::string(added.message()));
    scanner->SkipLine();
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<InputHull> ReadOff(std::string_view bytes) {
  TextScanner scanner(bytes, '#');
  AMHEX_ASSIGN_OR_RETURN(const OffHeader header, ReadHeader(&scanner));
  HullBuilder builder;
  AMHEX_RETURN_IF_ERROR(ReadVertices(&scanner, header, &builder));
  AMHEX_RETURN_IF_ERROR(ReadFaces(&scanner, header, &builder));
  return builder.Build();
}

}  // namespace amhex::client
