#include "logging.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <memory>

#include "status_macros.h"

namespace amhex::server {
namespace {

constexpr char kTextPattern[] = "time=%Y-%m-%dT%H:%M:%S.%eZ level=%l pid=%P %v";
constexpr char kJsonPattern[] = R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l","pid":%P,%v})";

std::atomic<bool> writes_json{false};

std::shared_ptr<spdlog::logger> MakeLogger(spdlog::level::level_enum level) {
  auto logger =
      std::make_shared<spdlog::logger>("amhex", std::make_shared<spdlog::sinks::stderr_sink_mt>());
  logger->set_formatter(std::make_unique<spdlog::pattern_formatter>(
      writes_json ? kJsonPattern : kTextPattern, spdlog::pattern_time_type::utc));
  logger->set_level(level);
  logger->flush_on(spdlog::level::info);
  return logger;
}

// Not spdlog's own default, which its library makes on first use, whichever thread that is.
std::shared_ptr<spdlog::logger>& Logger() {
  static std::shared_ptr<spdlog::logger> logger = MakeLogger(spdlog::level::info);
  return logger;
}

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

// Length of the UTF-8 sequence at `at`, or 0 where there is none.
size_t SequenceLength(const std::string& text, size_t at) {
  const auto byte = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char first = byte(at);
  const size_t length = first < 0x80   ? 1
                        : first < 0xc2 ? 0
                        : first < 0xe0 ? 2
                        : first < 0xf0 ? 3
                        : first < 0xf5 ? 4
                                       : 0;
  if (length == 0 || at + length > text.size()) return 0;
  for (size_t i = 1; i < length; ++i) {
    if ((byte(at + i) & 0xc0) != 0x80) return 0;
  }
  // Neither longer than needed, nor half of a surrogate pair, nor beyond the last code point.
  const bool is_overlong =
      (first == 0xe0 && byte(at + 1) < 0xa0) || (first == 0xf0 && byte(at + 1) < 0x90);
  const bool is_out_of_range =
      (first == 0xed && byte(at + 1) >= 0xa0) || (first == 0xf4 && byte(at + 1) >= 0x90);
  return is_overlong || is_out_of_range ? 0 : length;
}

// RFC 8259; a byte that is no UTF-8 becomes the replacement character.
void AppendJsonString(const std::string& text, std::string* line) {
  *line += '"';
  for (size_t at = 0; at < text.size();) {
    const size_t length = SequenceLength(text, at);
    const char c = text[at];
    if (length == 0) {
      *line += "\\ufffd";
    } else if (c == '"' || c == '\\') {
      (*line += '\\') += c;
    } else if (length == 1 && std::iscntrl(static_cast<unsigned char>(c))) {
      char escaped[8];
      std::snprintf(escaped, sizeof(escaped), "\\u%04x", static_cast<unsigned char>(c));
      *line += escaped;
    } else {
      line->append(text, at, length);
    }
    at += std::max<size_t>(length, 1);
  }
  *line += '"';
}

std::string TextLine(const char* event, std::initializer_list<LogField> fields) {
  std::string line = std::string("event=") + event;
  for (const LogField& field : fields) {
    line += " " + field.key + "=";
    AppendValue(field.value, &line);
  }
  return line;
}

// The inside of an object; the pattern adds time, level and braces.
std::string JsonLine(const char* event, std::initializer_list<LogField> fields) {
  std::string line = "\"event\":";
  AppendJsonString(event, &line);
  for (const LogField& field : fields) {
    line += ',';
    AppendJsonString(field.key, &line);
    line += ':';
    if (field.is_number) {
      line += field.value;
    } else {
      AppendJsonString(field.value, &line);
    }
  }
  return line;
}

void Log(spdlog::level::level_enum level, const char* event,
         std::initializer_list<LogField> fields) {
  if (!Logger()->should_log(level)) return;
  Logger()->log(level, "{}", writes_json ? JsonLine(event, fields) : TextLine(event, fields));
}

}  // namespace

LogField::LogField(std::string field_key, double number) : key(std::move(field_key)) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.6g", number);
  value = text;
  is_number = std::isfinite(number);  // JSON has no words for the others
}

absl::Status CheckLogging(const std::string& level, const std::string& format) {
  const std::string names[] = {"trace", "debug", "info", "warning", "error"};
  if (std::find(std::begin(names), std::end(names), level) == std::end(names)) {
    return absl::InvalidArgumentError(
        "--log-level must be one of trace, debug, info, warning, error, got " + level);
  }
  if (format != "text" && format != "json") {
    return absl::InvalidArgumentError("--log-format must be text or json, got " + format);
  }
  return absl::OkStatus();
}

absl::Status SetUpLogging(const std::string& level, const std::string& format) {
  AMHEX_RETURN_IF_ERROR(CheckLogging(level, format));
  writes_json = format == "json";
  Logger() = MakeLogger(spdlog::level::from_str(level));
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
