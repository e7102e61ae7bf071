// Log lines of key=value pairs, one per event, on standard error.
//
//   time=2026-01-31T12:00:00.000Z level=info event=job_started job=jobs/... attempt=1
#pragma once

#include <initializer_list>
#include <string>
#include <utility>

#include "absl/status/status.h"

namespace amhex::server {

struct LogField {
  std::string key;
  std::string value;
  LogField(std::string field_key, std::string field_value)
      : key(std::move(field_key)), value(std::move(field_value)) {}
  LogField(std::string field_key, const char* field_value)
      : key(std::move(field_key)), value(field_value) {}
  LogField(std::string field_key, int64_t number)
      : key(std::move(field_key)), value(std::to_string(number)) {}
  LogField(std::string field_key, double number);
};

// `level` is one of trace, debug, info, warning, error. INVALID_ARGUMENT otherwise.
absl::Status SetUpLogging(const std::string& level);

void LogDebug(const char* event, std::initializer_list<LogField> fields);
void LogInfo(const char* event, std::initializer_list<LogField> fields);
void LogWarning(const char* event, std::initializer_list<LogField> fields);
void LogError(const char* event, std::initializer_list<LogField> fields);

}  // namespace amhex::server
