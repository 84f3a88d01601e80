#include "client/commands/photon_command.h"

#include <charconv>
#include <string_view>
#include <utility>
#include <vector>

#include "client/connection.h"
#include "client/exit_code.h"
#include "client/foreign_text.h"
#include "client/image_output.h"
#include "client/program_output.h"
#include "client/view/photon_file.h"
#include "client/view/report.h"
#include "render/base/console.h"
#include "render/base/files.h"
#include "render/report/photon_view.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

// What the worker program may answer holds so many, with some ten landings each.
constexpr std::uint64_t kMostPhotons = 50'000;

std::optional<std::uint64_t> NumberIn(std::string_view text) {
  std::uint64_t number = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size()) return std::nullopt;
  return number;
}

// Photons of one pass, from `first` to `last`.
struct PhotonKeys {
  std::uint64_t pass = 0, first = 0, last = 0;
};

StatusOr<PhotonKeys> ReadKeys(const PhotonRequest& request) {
  const std::string_view text = request.photon;
  const std::size_t colon = text.find(':');
  const bool has_pass = colon != std::string_view::npos;
  const std::string_view range = has_pass ? text.substr(colon + 1) : text;
  const std::size_t dash = range.find('-');
  const auto pass = has_pass ? NumberIn(text.substr(0, colon)) : request.pass.value_or(0);
  const auto first = NumberIn(range.substr(0, dash));
  const auto last = dash == std::string_view::npos ? first : NumberIn(range.substr(dash + 1));
  if (!pass || !first || !last || *last < *first || (has_pass && request.pass)) {
    return Failure(ExitCode::kUsage,
                   absl::StrCat("\"", request.photon,
                                "\" names no photon; give PASS:INDEX, such as 12:3456, INDEX with "
                                "--pass, or several as PASS:FIRST-LAST"));
  }
  if (*last - *first >= kMostPhotons) {
    return Failure(ExitCode::kUsage,
                   absl::StrCat("at most ", kMostPhotons, " photons at once, not ",
                                *last - *first + 1, "; give a shorter range"));
  }
  return PhotonKeys{*pass, *first, *last};
}

}  // namespace

Status TracePhoton(const PhotonRequest& request, const Endpoint& server,
                   const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const PhotonKeys keys, ReadKeys(request));
  if (!request.output.empty()) {
    LUCERNA_RETURN_IF_ERROR(PhotonFileFormatOf(request.output).status());
    LUCERNA_RETURN_IF_ERROR(CheckMayWrite(request.output, "lucerna trace-photon"));
  }
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const v1::Job job, connection->Get(request.job_id));
  auto photons = static_cast<std::uint64_t>(SettingsOf(job).photons_per_pass);
  for (const v1::PhotonStep& step : job.photon_steps()) {
    if (step.first_pass() <= keys.pass) photons = step.photons_per_pass();
  }
  if (keys.last >= photons) {
    return Failure(ExitCode::kUsage, absl::StrCat("pass ", keys.pass, " of job ", request.job_id,
                                                  " has the photons 0 to ", photons - 1,
                                                  "; there is no ", keys.last));
  }
  std::vector<std::string> flags = {"--server", server.address,
                                    "--replay", request.job_id,
                                    "--pass",   std::to_string(keys.pass),
                                    "--index",  std::to_string(keys.first),
                                    "--count",  std::to_string(keys.last - keys.first + 1)};
  if (!server.tls.empty()) {
    flags.insert(flags.end(), {"--tls-ca", server.tls.authority, "--tls-cert",
                               server.tls.certificate, "--tls-key", server.tls.key});
  }
  if (!request.token_file.empty()) {
    flags.insert(flags.end(), {"--token-file", request.token_file});
  }
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes,
                           OutputOf(request.program_folder + "/lucerna-worker", std::move(flags)));
  v1::PhotonPaths paths;
  if (!paths.ParseFromString(bytes)) {
    return absl::DataLossError(
        "the worker program answered with something that is no way of photons");
  }
  if (!request.output.empty()) {
    LUCERNA_ASSIGN_OR_RETURN(const PhotonFileFormat format, PhotonFileFormatOf(request.output));
    return WriteFile(request.output, PhotonFile(paths, format));
  }
  for (v1::PhotonPath& path : *paths.mutable_paths()) {
    EscapeTexts(path);
    if (output_options.json) {
      PrintData(PhotonReport(path));
    } else {
      PrintText(PhotonPathText(path));
    }
  }
  return absl::OkStatus();
}

}  // namespace lucerna
