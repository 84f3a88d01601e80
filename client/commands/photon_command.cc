#include "client/commands/photon_command.h"

#include <charconv>
#include <cstdio>
#include <string_view>
#include <utility>
#include <vector>

#include "client/connection.h"
#include "client/exit_code.h"
#include "client/foreign_text.h"
#include "client/program_output.h"
#include "client/view/report.h"
#include "render/report/photon_view.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

std::optional<std::uint64_t> NumberIn(std::string_view text) {
  std::uint64_t number = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), number);
  if (read.ec != std::errc() || read.ptr != text.data() + text.size()) return std::nullopt;
  return number;
}

StatusOr<v1::PhotonKey> ReadKey(const PhotonRequest& request) {
  const std::string_view text = request.photon;
  const std::size_t colon = text.find(':');
  const bool has_pass = colon != std::string_view::npos;
  const auto pass = has_pass ? NumberIn(text.substr(0, colon)) : request.pass.value_or(0);
  const auto index = NumberIn(has_pass ? text.substr(colon + 1) : text);
  if (!pass || !index || (has_pass && request.pass)) {
    return Failure(ExitCode::kUsage,
                   absl::StrCat("\"", request.photon,
                                "\" names no photon; give PASS:INDEX, such as 12:3456, or INDEX "
                                "with --pass"));
  }
  v1::PhotonKey key;
  key.set_pass(*pass);
  key.set_index(*index);
  return key;
}

}  // namespace

Status TracePhoton(const PhotonRequest& request, const Endpoint& server,
                   const OutputOptions& output_options) {
  LUCERNA_ASSIGN_OR_RETURN(const v1::PhotonKey key, ReadKey(request));
  LUCERNA_ASSIGN_OR_RETURN(const auto connection, ClientConnection::Open(server));
  LUCERNA_ASSIGN_OR_RETURN(const v1::Job job, connection->Get(request.job_id));
  auto photons = static_cast<std::uint64_t>(SettingsOf(job).photons_per_pass);
  for (const v1::PhotonStep& step : job.photon_steps()) {
    if (step.first_pass() <= key.pass()) photons = step.photons_per_pass();
  }
  if (key.index() >= photons) {
    return Failure(ExitCode::kUsage, absl::StrCat("pass ", key.pass(), " of job ", request.job_id,
                                                  " has the photons 0 to ", photons - 1,
                                                  "; there is no ", key.index()));
  }
  std::vector<std::string> flags = {"--server", server.address,
                                    "--replay", request.job_id,
                                    "--pass",   std::to_string(key.pass()),
                                    "--index",  std::to_string(key.index())};
  if (!server.tls.empty()) {
    flags.insert(flags.end(), {"--tls-ca", server.tls.authority, "--tls-cert",
                               server.tls.certificate, "--tls-key", server.tls.key});
  }
  if (!request.token_file.empty()) {
    flags.insert(flags.end(), {"--token-file", request.token_file});
  }
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes,
                           OutputOf(request.program_folder + "/lucerna-worker", std::move(flags)));
  v1::PhotonPath path;
  if (!path.ParseFromString(bytes)) {
    return absl::DataLossError(
        "the worker program answered with something that is no photon's way");
  }
  EscapeTexts(path);
  std::fputs((output_options.json ? PhotonReport(path) : PhotonPathText(path)).c_str(), stdout);
  return absl::OkStatus();
}

}  // namespace lucerna
