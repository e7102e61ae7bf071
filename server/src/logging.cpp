#include "logging.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <memory>

namespace amhex::server {
namespace {

constexpr char kPattern[] = "time=%Y-%m-%dT%H:%M:%S.%eZ level=%l pid=%P %v";

bool NeedsQuotes(const std::string& value) {
  return value.empty() || std::any_of(value.begin(), value.end(), [](unsigned char c) {
           return std::isspace(c) || std::iscntrl(c) || c == '"' || c == '=' || c == '\\';
         });
}

void AppendValue(const std::string& value, std::string* line) {
  if (!NeedsQuotes(value)) {
    *line += value;
    return;
  }
  *line += '"';
  for (const char c : value) {
    if (c == '"' || c == '\\') *line += '\\';
    *line += std::iscntrl(static_cast<unsigned char>(c)) ? ' ' : c;
  }
  *line += '"';
}

void Log(spdlog::level::level_enum level, const char* event,
         std::initializer_list<LogField> fields) {
  if (!spdlog::should_log(level)) return;
  std::string line = std::string("event=") + event;
  for (const LogField& field : fields) {
    line += " " + field.key + "=";
    AppendValue(field.value, &line);
  }
  spdlog::log(level, "{}", line);
}

}  // namespace

LogField::LogField(std::string field_key, double number) : key(std::move(field_key)) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", number);
  value = text;
}

absl::Status SetUpLogging(const std::string& level) {
  const std::string names[] = {"trace", "debug", "info", "warning", "error"};
  if (std::find(std::begin(names), std::end(names), level) == std::end(names)) {
    return absl::InvalidArgumentError(
        "log level must be one of trace, debug, info, warning, error, got " + level);
  }
  auto logger =
      std::make_shared<spdlog::logger>("amhex", std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger->set_formatter(
      std::make_unique<spdlog::pattern_formatter>(kPattern, spdlog::pattern_time_type::utc));
  logger->set_level(spdlog::level::from_str(level));
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
  return absl::OkStatus();
}

void LogDebug(const char* event, std::initializer_list<LogField> fields) {
  Log(spdlog::level::debug, event, fields);
}
void LogInfo(const char* event, std::initializer_list<LogField> fields) {
  Log(spdlog::level::info, event, fields);
}
void LogWarning(const char* event, std::initializer_list<LogField> fields) {
  Log(spdlog::level::warn, event, fields);
}
void LogError(const char* event, std::initializer_list<LogField> fields) {
  Log(spdlog::level::err, event, fields);
}

}  // namespace amhex::server
