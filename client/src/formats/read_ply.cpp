// Stanford PLY: meshes with polygonal faces, and clouds with or without normals.
#include <algorithm>
#include <array>
#include <vector>

#include "absl/strings/str_cat.h"
#include "formats/byte_reader.h"
#include "formats/hull_builder.h"
#include "formats/hull_reader.h"
#include "formats/ply_header.h"
#include "formats/status_macros.h"
#include "formats/text_scanner.h"

namespace amhex::client {
namespace {

// Where a body's numbers come from; the two encodings differ in nothing else.
class PlyNumbers {
 public:
  virtual ~PlyNumbers() = default;
  virtual absl::StatusOr<double> Next(PlyType type) = 0;
  virtual absl::Status Error(const std::string& message) const = 0;
  virtual size_t RemainingBytes() const = 0;
};

class AsciiNumbers final : public PlyNumbers {
 public:
  AsciiNumbers(std::string_view body, int64_t first_line)
      : scanner_(body), lines_before_(first_line - 1) {}
  absl::StatusOr<double> Next(PlyType) override {
    const std::string_view word = scanner_.NextWord();
    double value = 0;
    if (word.empty()) return Error("the file ends where a number is expected");
    if (!ParseDouble(word, &value)) return Error("not a number: " + Quoted(word));
    return value;
  }
  absl::Status Error(const std::string& message) const override {
    return absl::InvalidArgumentError(
        absl::StrCat("line ", lines_before_ + scanner_.line(), ": ", message));
  }
  size_t RemainingBytes() const override { return scanner_.remaining(); }

 private:
  TextScanner scanner_;
  int64_t lines_before_;
};

class BinaryNumbers final : public PlyNumbers {
 public:
  BinaryNumbers(std::string_view body, size_t offset, std::endian order)
      : reader_(body, order), offset_(offset) {}
  absl::StatusOr<double> Next(PlyType type) override {
    switch (type) {
      case PlyType::kInt8:
        return NextAs<int8_t>();
      case PlyType::kUint8:
        return NextAs<uint8_t>();
      case PlyType::kInt16:
        return NextAs<int16_t>();
      case PlyType::kUint16:
        return NextAs<uint16_t>();
      case PlyType::kInt32:
        return NextAs<int32_t>();
      case PlyType::kUint32:
        return NextAs<uint32_t>();
      case PlyType::kFloat32:
        return NextAs<float>();
      case PlyType::kFloat64:
        return NextAs<double>();
    }
    return Error("unknown number type");
  }
  absl::Status Error(const std::string& message) const override {
    return absl::InvalidArgumentError(
        absl::StrCat("byte ", offset_ + reader_.position(), ": ", message));
  }
  size_t RemainingBytes() const override { return reader_.remaining(); }

 private:
  template <class T>
  absl::StatusOr<double> NextAs() {
    T value{};
    if (!reader_.Read(&value)) return Error("the file ends where a number is expected");
    return static_cast<double>(value);
  }
  ByteReader reader_;
  size_t offset_;
};

// Reads one list; its length is checked against `most` and the bytes left.
absl::Status ReadList(PlyNumbers* numbers, const PlyProperty& property, size_t most,
                      std::vector<double>* items) {
  AMHEX_ASSIGN_OR_RETURN(const double length, numbers->Next(property.count_type));
  if (!(length >= 0) || length > static_cast<double>(numbers->RemainingBytes()) ||
      length > static_cast<double>(most)) {
    return numbers->Error(absl::StrCat("a list has ", length, " items; at most ",
                                       std::min(most, numbers->RemainingBytes()),
                                       " are possible here"));
  }
  items->clear();
  for (size_t i = 0; i < static_cast<size_t>(length); ++i) {
    AMHEX_ASSIGN_OR_RETURN(const double item, numbers->Next(property.type));
    items->push_back(item);
  }
  return absl::OkStatus();
}

absl::Status ReadVertices(PlyNumbers* numbers, const PlyElement& element, HullBuilder* builder) {
  const std::array<int, 3> at = {element.Find("x"), element.Find("y"), element.Find("z")};
  const std::array<int, 3> normal_at = {element.Find("nx"), element.Find("ny"), element.Find("nz")};
  if (*std::min_element(at.begin(), at.end()) < 0) {
    return numbers->Error("the vertices have no properties x, y, z");
  }
  const bool has_normals = *std::min_element(normal_at.begin(), normal_at.end()) >= 0;
  const size_t count = static_cast<size_t>(element.count);
  builder->vertices.reserve(count);
  if (has_normals) builder->normals.reserve(count);
  std::vector<double> row(element.properties.size()), skipped;
  for (size_t i = 0; i < count; ++i) {
    for (size_t k = 0; k < row.size(); ++k) {
      const PlyProperty& property = element.properties[k];
      if (property.is_list) {
        AMHEX_RETURN_IF_ERROR(ReadList(numbers, property, numbers->RemainingBytes(), &skipped));
      } else {
        AMHEX_ASSIGN_OR_RETURN(row[k], numbers->Next(property.type));
      }
    }
    builder->vertices.push_back({row[at[0]], row[at[1]], row[at[2]]});
    if (has_normals) {
      builder->normals.push_back({row[normal_at[0]], row[normal_at[1]], row[normal_at[2]]});
    }
  }
  return absl::OkStatus();
}

absl::Status ReadFaces(PlyNumbers* numbers, const PlyElement& element, HullBuilder* builder) {
  int list_at = element.Find("vertex_indices");
  if (list_at < 0) list_at = element.Find("vertex_index");
  if (list_at < 0 || !element.properties[list_at].is_list) {
    return numbers->Error("the faces have no list property vertex_indices");
  }
  if (element.properties[list_at].type >= PlyType::kFloat32) {
    return numbers->Error("the vertex numbers of the faces are not of an integer type");
  }
  std::vector<double> items;
  std::vector<int64_t> corners;
  for (int64_t face = 0; face < element.count; ++face) {
    for (size_t k = 0; k < element.properties.size(); ++k) {
      const PlyProperty& property = element.properties[k];
      if (!property.is_list) {
        AMHEX_RETURN_IF_ERROR(numbers->Next(property.type).status());
        continue;
      }
      const bool is_corners = static_cast<int>(k) == list_at;
      AMHEX_RETURN_IF_ERROR(ReadList(
          numbers, property, is_corners ? kMaxPolygonCorners : numbers->RemainingBytes(), &items));
      if (!is_corners) continue;
      corners.assign(items.begin(), items.end());
      const absl::Status added = builder->AddPolygon(corners);
      if (!added.ok()) {
        return numbers->Error(absl::StrCat("face ", face, ": ", std::string(added.message())));
      }
    }
  }
  return absl::OkStatus();
}

absl::Status SkipElement(PlyNumbers* numbers, const PlyElement& element) {
  std::vector<double> skipped;
  for (int64_t i = 0; i < element.count; ++i) {
    for (const PlyProperty& property : element.properties) {
      if (property.is_list) {
        AMHEX_RETURN_IF_ERROR(ReadList(numbers, property, numbers->RemainingBytes(), &skipped));
      } else {
        AMHEX_RETURN_IF_ERROR(numbers->Next(property.type).status());
      }
    }
  }
  return absl::OkStatus();
}

absl::StatusOr<InputHull> ReadBody(PlyNumbers* numbers, const PlyHeader& header) {
  HullBuilder builder;
  for (const PlyElement& element : header.elements) {
    if (element.name == "vertex" && builder.vertices.empty()) {
      AMHEX_RETURN_IF_ERROR(ReadVertices(numbers, element, &builder));
    } else if (element.name == "face" && element.count > 0) {
      AMHEX_RETURN_IF_ERROR(ReadFaces(numbers, element, &builder));
    } else if (element.name == "tristrips" && element.count > 0) {
      return numbers->Error("triangle strips are not read; save the mesh with faces");
    } else {
      AMHEX_RETURN_IF_ERROR(SkipElement(numbers, element));
    }
  }
  return builder.Build();
}

}  // namespace

absl::StatusOr<InputHull> ReadPly(std::string_view bytes) {
  AMHEX_ASSIGN_OR_RETURN(const PlyHeader header, ReadPlyHeader(bytes));
  const std::string_view body = bytes.substr(header.body_offset);
  if (header.encoding == PlyEncoding::kAscii) {
    AsciiNumbers numbers(body, header.body_line);
    return ReadBody(&numbers, header);
  }
  BinaryNumbers numbers(
      body, header.body_offset,
      header.encoding == PlyEncoding::kLittleEndian ? std::endian::little : std::endian::big);
  return ReadBody(&numbers, header);
}

}  // namespace amhex::client
