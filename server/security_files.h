// What does the log say of certificates and tokens that change while the coordinator runs?
#pragma once

#include <string>

#include "render/base/certificate.h"
#include "render/base/clock.h"
#include "render/base/status.h"
#include "server/access.h"

namespace lucerna {

// Reads the file of tokens again when it changes. Certificates are read again by gRPC, without a
// word; this says which ones are there and warns before they expire. Threads: one.
class SecurityFiles {
 public:
  // Both outlive it.
  SecurityFiles(TlsFiles tls, Access& access, const Clock& clock);

  // To be called often; looks about once a second.
  void Tick();

 private:
  void LookAtCertificates();

  const TlsFiles tls_;
  Access& access_;
  const Clock& clock_;
  SteadyTime look_at_;
  std::string said_;  // of the certificates
};

// For TakeGrpcErrors: a line of the log, for a failed TLS handshake a sentence; of what repeats
// itself within ten seconds only the first.
void LogGrpcError(const std::string& message);

}  // namespace lucerna
