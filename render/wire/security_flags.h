// The flags of all three programs that say how connections are secured.
#pragma once

#include <string>

#include "render/base/certificate.h"
#include "render/base/status.h"

namespace lucerna {

// `App` is CLI::App: this floor does not know the library. Services take flags alone, so that
// those which `lucerna render` starts on loopback do not inherit what is meant for a farm.
template <typename App>
void AddTlsFlags(App& app, TlsFiles& tls, bool reads_environment = false) {
  auto* const authority = app.add_option("--tls-ca", tls.authority,
                                         "PEM file: its certificates may sign the other side's");
  auto* const certificate =
      app.add_option("--tls-cert", tls.certificate, "PEM file: this program's certificate");
  auto* const key = app.add_option("--tls-key", tls.key, "PEM file: the key of that certificate");
  if (!reads_environment) return;
  authority->envname("LUCERNA_TLS_CA");
  certificate->envname("LUCERNA_TLS_CERT");
  key->envname("LUCERNA_TLS_KEY");
}

// The token in the file at `path`, without spaces around it; `otherwise` when the path is empty.
// Errors: as ReadFile, INVALID_ARGUMENT for a file that others may read.
[[nodiscard]] StatusOr<std::string> ReadToken(const std::string& path, const char* otherwise);

}  // namespace lucerna
