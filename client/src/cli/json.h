// Protocol messages as JSON for people and scripts, and as facts for mesh files.
#pragma once

#include <string>
#include <vector>

#include "formats/mesh_file.h"
#include "google/protobuf/message.h"

namespace amhex::client {

// Names are those of the .proto files, but x_duration becomes x_seconds. Unlike in protobuf's own
// mapping, whole numbers of 64 bits stay numbers, durations are numbers of seconds, timestamps are
// RFC 3339 text, enum values lose their prefix and become lower case, cells_by_type is an object
// with one count per type, and every plain field is present even when it is 0.
std::string ToJson(const google::protobuf::Message& message, int indent = 0);

// `text` with quotes and escapes.
std::string JsonString(const std::string& text);

// The numbers and texts of `message`, named "prefix.field".
std::vector<MeshFact> FactsOf(const std::string& prefix, const google::protobuf::Message& message);

// "relax" for STAGE_RELAX, "field" for INITIALIZATION_FIELD, "running" for RUNNING.
std::string EnumWord(const google::protobuf::EnumValueDescriptor& value);

}  // namespace amhex::client
