// Log lines on standard error, one per event, as key=value pairs or as JSON objects.
//
//   time=2026-01-31T12:00:00.000Z level=info pid=7 event=job_started job=jobs/... attempt=1
//   {"time":"2026-01-31T12:00:00.000Z","level":"info","pid":7,"event":"job_started",...}
#pragma once

#include <initializer_list>
#include <string>
#include <utility>

#include "absl/status/status.h"

namespace amhex::server {

struct LogField {
  std::string key;
  std::string value;
  bool is_number = false;  // JSON has it without quotes

  LogField(std::string field_key, std::string field_value)
      : key(std::move(field_key)), value(std::move(field_value)) {}
  LogField(std::string field_key, const char* field_value)
      : key(std::move(field_key)), value(field_value) {}
  LogField(std::string field_key, int64_t number)
      : key(std::move(field_key)), value(std::to_string(number)), is_number(true) {}
  LogField(std::string field_key, double number);
};

// `level` is one of trace, debug, info, warning, error; `format` is text or json. INVALID_ARGUMENT
// otherwise.
absl::Status CheckLogging(const std::string& level, const std::string& format);
absl::Status SetUpLogging(const std::string& level, const std::string& format);

void LogDebug(const char* event, std::initializer_list<LogField> fields);
void LogInfo(const char* event, std::initializer_list<LogField> fields);
void LogWarning(const char* event, std::initializer_list<LogField> fields);
void LogError(const char* event, std::initializer_list<LogField> fields);

}  // namespace amhex::server
