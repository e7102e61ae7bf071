#include "formats/ply_header.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "formats/status_macros.h"
#include "formats/text_scanner.h"

namespace amhex::client {
namespace {

constexpr size_t kMaxElements = 64;
constexpr size_t kMaxProperties = 256;

std::optional<PlyType> TypeOfName(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, PlyType>, 16> kNames = {{
      {"char", PlyType::kInt8},
      {"int8", PlyType::kInt8},
      {"uchar", PlyType::kUint8},
      {"uint8", PlyType::kUint8},
      {"short", PlyType::kInt16},
      {"int16", PlyType::kInt16},
      {"ushort", PlyType::kUint16},
      {"uint16", PlyType::kUint16},
      {"int", PlyType::kInt32},
      {"int32", PlyType::kInt32},
      {"uint", PlyType::kUint32},
      {"uint32", PlyType::kUint32},
      {"float", PlyType::kFloat32},
      {"float32", PlyType::kFloat32},
      {"double", PlyType::kFloat64},
      {"float64", PlyType::kFloat64},
  }};
  for (const auto& [known, type] : kNames) {
    if (known == name) return type;
  }
  return std::nullopt;
}

absl::Status ReadFormat(TextScanner* scanner, PlyHeader* header) {
  const std::string_view encoding = scanner->NextWordOnLine();
  if (encoding == "ascii") {
    header->encoding = PlyEncoding::kAscii;
  } else if (encoding == "binary_little_endian") {
    header->encoding = PlyEncoding::kLittleEndian;
  } else if (encoding == "binary_big_endian") {
    header->encoding = PlyEncoding::kBigEndian;
  } else {
    return scanner->Error("unknown PLY format " + Quoted(encoding));
  }
  return absl::OkStatus();
}

absl::Status ReadElement(TextScanner* scanner, PlyHeader* header) {
  PlyElement element;
  element.name = std::string(scanner->NextWordOnLine());
  const std::string_view count = scanner->NextWordOnLine();
  if (element.name.empty() || !ParseInteger(count, &element.count) || element.count < 0) {
    return scanner->Error("an element needs a name and a count, not " + Quoted(count));
  }
  if (header->elements.size() >= kMaxElements) return scanner->Error("too many elements");
  header->elements.push_back(std::move(element));
  return absl::OkStatus();
}

absl::Status ReadProperty(TextScanner* scanner, PlyHeader* header) {
  if (header->elements.empty()) return scanner->Error("a property stands before any element");
  PlyProperty property;
  std::string_view type = scanner->NextWordOnLine();
  if (type == "list") {
    property.is_list = true;
    const std::string_view count_name = scanner->NextWordOnLine();
    const std::optional<PlyType> count_type = TypeOfName(count_name);
    if (!count_type || *count_type >= PlyType::kFloat32) {
      return scanner->Error("a list's length has no integer type: " + Quoted(count_name));
    }
    property.count_type = *count_type;
    type = scanner->NextWordOnLine();
  }
  const std::optional<PlyType> known = TypeOfName(type);
  if (!known) return scanner->Error("unknown property type " + Quoted(type));
  property.type = *known;
  property.name = std::string(scanner->NextWordOnLine());
  if (property.name.empty()) return scanner->Error("a property has no name");
  PlyElement& element = header->elements.back();
  if (element.properties.size() >= kMaxProperties) return scanner->Error("too many properties");
  element.properties.push_back(std::move(property));
  return absl::OkStatus();
}

absl::Status CheckCounts(const TextScanner& scanner, const PlyHeader& header) {
  // One byte more than is there: the last ascii number needs no separator.
  size_t left = scanner.remaining() + 1;
  for (const PlyElement& element : header.elements) {
    const size_t smallest = std::max<size_t>(1, element.SmallestBytes(header.encoding));
    if (static_cast<size_t>(element.count) > left / smallest) {
      return scanner.Error(absl::StrCat("the header promises ", element.count, " of element ",
                                        Quoted(element.name), ", but only ", scanner.remaining(),
                                        " bytes follow"));
    }
    left -= static_cast<size_t>(element.count) * smallest;
  }
  return absl::OkStatus();
}

}  // namespace

size_t SizeOf(PlyType type) {
  switch (type) {
    case PlyType::kInt8:
    case PlyType::kUint8:
      return 1;
    case PlyType::kInt16:
    case PlyType::kUint16:
      return 2;
    case PlyType::kFloat64:
      return 8;
    default:
      return 4;
  }
}

int PlyElement::Find(std::string_view wanted) const {
  for (size_t i = 0; i < properties.size(); ++i) {
    if (properties[i].name == wanted) return static_cast<int>(i);
  }
  return -1;
}

size_t PlyElement::SmallestBytes(PlyEncoding encoding) const {
  size_t bytes = 0;
  for (const PlyProperty& property : properties) {
    if (encoding == PlyEncoding::kAscii) {
      bytes += 2;
    } else {
      bytes += SizeOf(property.is_list ? property.count_type : property.type);
    }
  }
  return bytes;
}

absl::StatusOr<PlyHeader> ReadPlyHeader(std::string_view bytes) {
  TextScanner scanner(bytes);
  PlyHeader header;
  bool has_format = false;
  if (scanner.NextWord() != "ply") return scanner.Error("a PLY file begins with \"ply\"");
  scanner.SkipLine();
  while (true) {
    const std::string_view word = scanner.NextWord();
    if (word.empty()) return scanner.Error("the file ends inside the PLY header");
    if (word == "end_header") break;
    if (word == "format") {
      AMHEX_RETURN_IF_ERROR(ReadFormat(&scanner, &header));
      has_format = true;
    } else if (word == "element") {
      AMHEX_RETURN_IF_ERROR(ReadElement(&scanner, &header));
    } else if (word == "property") {
      AMHEX_RETURN_IF_ERROR(ReadProperty(&scanner, &header));
    } else if (word != "comment" && word != "obj_info") {
      return scanner.Error("unknown word in a PLY header: " + Quoted(word));
    }
    scanner.SkipLine();
  }
  if (!has_format) return scanner.Error("the PLY header names no format");
  scanner.SkipLine();
  AMHEX_RETURN_IF_ERROR(CheckCounts(scanner, header));
  header.body_offset = scanner.position();
  header.body_line = scanner.line();
  return header;
}

}  // namespace amhex::client
