#include "cli/json.h"

#include <cmath>
#include <map>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/time.h"
#include "amhex/v1/job.pb.h"
#include "cells/cells.h"
#include "google/protobuf/descriptor.h"
#include "google/protobuf/duration.pb.h"
#include "google/protobuf/timestamp.pb.h"

namespace amhex::client {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

std::string Number(double value) {
  if (!std::isfinite(value)) return "null";
  // The shortest form that reads back as the same number.
  for (int digits = 6; digits < 17; ++digits) {
    std::string text = absl::StrFormat("%.*g", digits, value);
    if (std::stod(text) == value) return text;
  }
  return absl::StrFormat("%.17g", value);
}

double Seconds(const google::protobuf::Duration& duration) {
  // Dividing once rounds once, so that the number prints short.
  constexpr int64_t kNanoseconds = 1'000'000'000;
  return static_cast<double>(duration.seconds() * kNanoseconds + duration.nanos()) /
         static_cast<double>(kNanoseconds);
}

std::string MessageValue(const Message& message, int indent) {
  if (const auto* duration = dynamic_cast<const google::protobuf::Duration*>(&message)) {
    return Number(Seconds(*duration));
  }
  if (const auto* time = dynamic_cast<const google::protobuf::Timestamp*>(&message)) {
    return JsonString(
        absl::FormatTime("%Y-%m-%dT%H:%M:%E3SZ",
                         absl::FromUnixSeconds(time->seconds()) + absl::Nanoseconds(time->nanos()),
                         absl::UTCTimeZone()));
  }
  return ToJson(message, indent);
}

// The field's value, or its index-th one if it is repeated.
std::string Value(const Message& message, const FieldDescriptor* field, int index, int indent) {
  const Reflection* r = message.GetReflection();
  const bool repeated = field->is_repeated();
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return absl::StrCat(repeated ? r->GetRepeatedInt32(message, field, index)
                                   : r->GetInt32(message, field));
    case FieldDescriptor::CPPTYPE_INT64:
      return absl::StrCat(repeated ? r->GetRepeatedInt64(message, field, index)
                                   : r->GetInt64(message, field));
    case FieldDescriptor::CPPTYPE_UINT32:
      return absl::StrCat(repeated ? r->GetRepeatedUInt32(message, field, index)
                                   : r->GetUInt32(message, field));
    case FieldDescriptor::CPPTYPE_UINT64:
      return absl::StrCat(repeated ? r->GetRepeatedUInt64(message, field, index)
                                   : r->GetUInt64(message, field));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return Number(repeated ? r->GetRepeatedDouble(message, field, index)
                             : r->GetDouble(message, field));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return Number(repeated ? r->GetRepeatedFloat(message, field, index)
                             : r->GetFloat(message, field));
    case FieldDescriptor::CPPTYPE_BOOL:
      return (repeated ? r->GetRepeatedBool(message, field, index) : r->GetBool(message, field))
                 ? "true"
                 : "false";
    case FieldDescriptor::CPPTYPE_ENUM:
      return JsonString(EnumWord(
          *(repeated ? r->GetRepeatedEnum(message, field, index) : r->GetEnum(message, field))));
    case FieldDescriptor::CPPTYPE_STRING:
      return JsonString(repeated ? r->GetRepeatedString(message, field, index)
                                 : r->GetString(message, field));
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return MessageValue(
          repeated ? r->GetRepeatedMessage(message, field, index) : r->GetMessage(message, field),
          indent);
  }
  return "null";
}

std::string ListValue(const Message& message, const FieldDescriptor* field, int indent) {
  const int count = message.GetReflection()->FieldSize(message, field);
  if (count == 0) return "[]";
  std::string text = "[";
  const std::string line = absl::StrCat("\n", std::string(static_cast<size_t>(indent) + 2, ' '));
  for (int i = 0; i < count; ++i) {
    absl::StrAppend(&text, i == 0 ? "" : ",", line, Value(message, field, i, indent + 2));
  }
  return absl::StrCat(text, "\n", std::string(static_cast<size_t>(indent), ' '), "]");
}

// {"hexahedron": 12, ...} with all types, those without cells too.
std::string CellCounts(const Message& message, const FieldDescriptor* field, int indent) {
  std::map<int, int64_t> counts;
  for (int i = 0; i < message.GetReflection()->FieldSize(message, field); ++i) {
    const auto& entry = dynamic_cast<const amhex::v1::CellTypeCount&>(
        message.GetReflection()->GetRepeatedMessage(message, field, i));
    counts[entry.type()] = entry.cell_count();
  }
  std::string text = "{";
  for (PrimitiveType type : kPrimitiveTypes) {
    absl::StrAppend(&text, text.size() == 1 ? "\n" : ",\n",
                    std::string(static_cast<size_t>(indent) + 2, ' '),
                    JsonString(PrimitiveName(type)), ": ", counts[static_cast<int>(type)]);
  }
  return absl::StrCat(text, "\n", std::string(static_cast<size_t>(indent), ' '), "}");
}

std::string JsonName(const FieldDescriptor* field) {
  constexpr absl::string_view kSuffix = "_duration";
  const bool is_duration = field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE &&
                           field->message_type() == google::protobuf::Duration::descriptor();
  if (!is_duration || !absl::EndsWith(field->name(), kSuffix)) return field->name();
  return absl::StrCat(field->name().substr(0, field->name().size() - kSuffix.size()), "_seconds");
}

std::string FieldText(const Message& message, const FieldDescriptor* field, int indent) {
  if (!field->is_repeated()) return Value(message, field, 0, indent);
  if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE &&
      field->message_type() == amhex::v1::CellTypeCount::descriptor()) {
    return CellCounts(message, field, indent);
  }
  return ListValue(message, field, indent);
}

// Left out: messages and optional fields that are not set, and payloads of Any.
bool IsShown(const Message& message, const FieldDescriptor* field) {
  if (field->is_repeated()) return field->type() != FieldDescriptor::TYPE_BYTES;
  if (field->type() == FieldDescriptor::TYPE_BYTES) return false;
  return !field->has_presence() || message.GetReflection()->HasField(message, field);
}

}  // namespace

std::string EnumWord(const google::protobuf::EnumValueDescriptor& value) {
  // CELL_TYPE_ for CellType: the type's name in upper case with underscores.
  std::string prefix;
  for (char c : value.type()->name()) {
    if (absl::ascii_isupper(static_cast<unsigned char>(c)) && !prefix.empty()) prefix += '_';
    prefix += absl::ascii_toupper(static_cast<unsigned char>(c));
  }
  prefix += '_';
  const std::string& name = value.name();
  return absl::AsciiStrToLower(absl::StartsWith(name, prefix) ? name.substr(prefix.size()) : name);
}

std::string JsonString(const std::string& text) {
  std::string quoted = "\"";
  for (char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    constexpr unsigned char kFirstPrintable = 0x20;
    if (c == '"' || c == '\\') {
      quoted += '\\';
      quoted += c;
    } else if (c == '\n') {
      quoted += "\\n";
    } else if (byte < kFirstPrintable) {
      absl::StrAppendFormat(&quoted, "\\u%04x", byte);
    } else {
      quoted += c;
    }
  }
  return quoted + "\"";
}

std::string ToJson(const Message& message, int indent) {
  std::string text = "{";
  const std::string line = absl::StrCat("\n", std::string(static_cast<size_t>(indent) + 2, ' '));
  bool first = true;
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* field = message.GetDescriptor()->field(i);
    if (!IsShown(message, field)) continue;
    absl::StrAppend(&text, first ? "" : ",", line, JsonString(JsonName(field)), ": ",
                    FieldText(message, field, indent + 2));
    first = false;
  }
  if (first) return "{}";
  return absl::StrCat(text, "\n", std::string(static_cast<size_t>(indent), ' '), "}");
}

std::vector<MeshFact> FactsOf(const std::string& prefix, const Message& message) {
  std::vector<MeshFact> facts;
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* field = message.GetDescriptor()->field(i);
    if (field->is_repeated() || !IsShown(message, field)) continue;
    const std::string name = absl::StrCat(prefix, ".", JsonName(field));
    const std::string value = Value(message, field, 0, 0);
    if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE && absl::StartsWith(value, "{")) {
      const std::vector<MeshFact> inner =
          FactsOf(name, message.GetReflection()->GetMessage(message, field));
      facts.insert(facts.end(), inner.begin(), inner.end());
    } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_BOOL) {
      facts.push_back({name, value == "true" ? 1.0 : 0.0});
    } else if (absl::StartsWith(value, "\"")) {
      facts.push_back({name, value.substr(1, value.size() - 2)});
    } else {
      facts.push_back({name, value == "null" ? std::nan("") : std::stod(value)});
    }
  }
  return facts;
}

}  // namespace amhex::client
