// The log of a service: lines on stderr, for people or as JSON for programs.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

namespace lucerna {

enum class LogFormat : unsigned char {
  kText,
  kJson,  // each line one object: time, level, program, message
};

// One line of JSON without its line end. `time` is shown in UTC, to the millisecond. Bytes of
// `message` that are not UTF-8 become U+FFFD.
[[nodiscard]] std::string JsonLogLine(std::chrono::system_clock::time_point time,
                                      std::string_view level, std::string_view program,
                                      std::string_view message);

// Makes the log of `program` the process's own. `level` is a name of spdlog.
void StartLog(const std::string& program, const std::string& level, LogFormat format);

// Why the program ends with a failure: "PROGRAM: MESSAGE", or a line of the log where that is JSON.
void SayWhyItEnds(const std::string& program, const std::string& message, LogFormat format);

// The flags of both services about their log. `App` and `IsMember` are those of CLI: this floor
// does not know the library.
struct LogFlags {
  std::string level = "info";
  std::string format = "text";

  [[nodiscard]] LogFormat of_lines() const {
    return format == "json" ? LogFormat::kJson : LogFormat::kText;
  }
};
template <typename IsMember, typename App>
void AddLogFlags(App& app, LogFlags& flags) {
  app.add_option("--log-level", flags.level, "debug, info, warn, error or off")
      ->check(IsMember({"debug", "info", "warn", "error", "off"}))
      ->capture_default_str();
  app.add_option("--log-format", flags.format,
                 "text, or json: each line of the log one object with time, level, program and "
                 "message")
      ->check(IsMember({"text", "json"}))
      ->capture_default_str();
}

}  // namespace lucerna
