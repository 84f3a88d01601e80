// Can these PEM files be shown to the other side of a TLS connection?
//
// gRPC reads certificates by itself and says little about what is wrong with them; so a program
// checks its own before it uses them.
#pragma once

#include <string>

#include "render/base/clock.h"
#include "render/base/status.h"

namespace lucerna {

// Where a program's certificates are; all empty: traffic in the clear.
struct TlsFiles {
  std::string authority;    // PEM: whose certificates of others are believed
  std::string certificate;  // PEM: its own, with the chain up to the authority
  std::string key;          // PEM: of its own certificate

  [[nodiscard]] bool empty() const {
    return authority.empty() && certificate.empty() && key.empty();
  }
  bool operator==(const TlsFiles&) const = default;
};

struct CertificateFacts {
  std::string common_name;
  WallTime valid_until;
};

// Reads the three files.
// Errors: NOT_FOUND or INVALID_ARGUMENT, a sentence that names the flag and the file: one is
// missing or no PEM, the key is of another certificate, the certificate has expired or is not valid
// yet.
[[nodiscard]] StatusOr<CertificateFacts> CheckTlsFiles(const TlsFiles& files, WallTime now);

// "2027-11-22 16:34:52 UTC".
[[nodiscard]] std::string UtcText(WallTime time);

}  // namespace lucerna
