// Wavefront OBJ: positions, normals and polygonal faces; everything else is skipped.
#include <vector>

#include "absl/strings/str_cat.h"
#include "formats/hull_builder.h"
#include "formats/hull_reader.h"
#include "formats/status_macros.h"
#include "formats/text_scanner.h"

namespace amhex::client {
namespace {

absl::StatusOr<Vec3d> ReadVector(TextScanner* scanner, const char* what) {
  Vec3d v;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string_view word = scanner->NextWordOnLine();
    if (word.empty()) {
      return scanner->Error(absl::StrCat(what, " has ", axis, " of 3 coordinates"));
    }
    if (!ParseDouble(word, &v[axis])) {
      return scanner->Error(absl::StrCat(what, " is not a number: ", Quoted(word)));
    }
  }
  return v;
}

// "7", "7/1", "7//3" or "7/1/3"; negative numbers count back from the last vertex so far.
absl::StatusOr<int64_t> ReadCorner(const TextScanner& scanner, std::string_view word,
                                   size_t vertex_count) {
  int64_t number = 0;
  if (!ParseInteger(word.substr(0, word.find('/')), &number) || number == 0) {
    return scanner.Error(absl::StrCat("a face corner is not a vertex number: ", Quoted(word)));
  }
  const int64_t index = number > 0 ? number - 1 : static_cast<int64_t>(vertex_count) + number;
  if (index < 0) {
    return scanner.Error(absl::StrCat("a face counts ", -number, " vertices back, but only ",
                                      vertex_count, " precede it"));
  }
  return index;
}

absl::Status ReadFace(TextScanner* scanner, HullBuilder* builder, std::vector<int64_t>* corners) {
  corners->clear();
  for (std::string_view word = scanner->NextWordOnLine(); !word.empty();
       word = scanner->NextWordOnLine()) {
    if (word == "\\") {  // the face goes on in the next line
      scanner->SkipLine();
      continue;
    }
    AMHEX_ASSIGN_OR_RETURN(const int64_t corner,
                           ReadCorner(*scanner, word, builder->vertices.size()));
    corners->push_back(corner);
  }
  const absl::Status added = builder->AddPolygon(*corners);
  if (!added.ok()) return scanner->Error(std::string(added.message()));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<InputHull> ReadObj(std::string_view bytes) {
  TextScanner scanner(bytes, '#');
  HullBuilder builder;
  std::vector<int64_t> corners;
  for (std::string_view word = scanner.NextWord(); !word.empty(); word = scanner.NextWord()) {
    if (word == "v") {
      AMHEX_ASSIGN_OR_RETURN(const Vec3d vertex, ReadVector(&scanner, "a vertex"));
      builder.vertices.push_back(vertex);
    } else if (word == "vn") {
      AMHEX_ASSIGN_OR_RETURN(const Vec3d normal, ReadVector(&scanner, "a normal"));
      builder.normals.push_back(normal);
    } else if (word == "f") {
      AMHEX_RETURN_IF_ERROR(ReadFace(&scanner, &builder, &corners));
      continue;  // ReadFace has used the line up, its newline excepted
    } else if (word.find('\0') != std::string_view::npos) {
      return scanner.Error("not a text file: " + Quoted(word));
    }
    scanner.SkipLine();
  }
  if (builder.vertices.empty()) {
    return absl::InvalidArgumentError("no line of the file is an OBJ vertex (\"v x y z\")");
  }
  // Without faces the file is a cloud, whose normals belong to the points one by one or not at all.
  if (builder.has_faces() || builder.normals.size() != builder.vertices.size()) {
    builder.normals.clear();
  }
  return builder.Build();
}

}  // namespace amhex::client
