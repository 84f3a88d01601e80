#include "render/wire/program_log.h"

#include <cstdio>
#include <memory>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include <nlohmann/json.hpp>
#include <spdlog/formatter.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "render/base/clock.h"
#include "render/base/console.h"

namespace lucerna {
namespace {

std::string_view ToStd(spdlog::string_view_t text) {
  return {text.data(), text.size()};
}

class JsonLines final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& line, spdlog::memory_buf_t& to) override {
    const std::string json =
        JsonLogLine(line.time, ToStd(spdlog::level::to_string_view(line.level)),
                    ToStd(line.logger_name), ToStd(line.payload)) +
        "\n";
    to.append(json.data(), json.data() + json.size());
  }
  [[nodiscard]] std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<JsonLines>();
  }
};

// spdlog's own lines, for a locale without UTF-8. What stands before the message is ASCII, so the
// colours stay where they are.
class AsciiLines final : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& line, spdlog::memory_buf_t& to) override {
    spdlog::memory_buf_t utf8;
    lines_.format(line, utf8);
    const std::string ascii = InCharset({utf8.data(), utf8.size()}, Charset::kAscii);
    to.append(ascii.data(), ascii.data() + ascii.size());
  }
  [[nodiscard]] std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<AsciiLines>();
  }

 private:
  spdlog::pattern_formatter lines_;
};

}  // namespace

std::string JsonLogLine(std::chrono::system_clock::time_point time, std::string_view level,
                        std::string_view program, std::string_view message) {
  using std::chrono::floor;
  const auto day = floor<std::chrono::days>(time);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(floor<std::chrono::milliseconds>(time - day));
  const nlohmann::ordered_json line = {
      {"time",
       absl::StrFormat("%04d-%02u-%02uT%02d:%02d:%02d.%03dZ", static_cast<int>(date.year()),
                       static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                       clock.hours().count(), clock.minutes().count(), clock.seconds().count(),
                       clock.subseconds().count())},
      {"level", level},
      {"program", program},
      {"message", message}};
  return line.dump(-1, ' ', /*ensure_ascii=*/false,
                   nlohmann::ordered_json::error_handler_t::replace);
}

void StartLog(const std::string& program, const std::string& level, LogFormat format) {
  spdlog::set_default_logger(spdlog::stderr_color_mt(program));
  if (format == LogFormat::kJson) {
    spdlog::set_formatter(std::make_unique<JsonLines>());
  } else if (LocaleCharset() == Charset::kAscii) {
    spdlog::set_formatter(std::make_unique<AsciiLines>());
  }
  spdlog::set_level(spdlog::level::from_str(level));
}

void SayWhyItEnds(const std::string& program, const std::string& message, LogFormat format) {
  if (format == LogFormat::kJson) {
    // Whatever the level is.
    std::fprintf(stderr, "%s\n",
                 JsonLogLine(SystemClock().Wall(), "critical", program, message).c_str());
  } else {
    PrintError(absl::StrCat(program, ": ", message, "\n"));
  }
}

}  // namespace lucerna
