// Certificates for a test, made by deploy/dev-ca.sh.
#pragma once

#include <string>

#include "render/base/certificate.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {

// An authority of its own in a folder of its own.
class DevelopmentCertificates {
 public:
  DevelopmentCertificates();

  [[nodiscard]] std::string folder() const;
  // Of "server", "worker" or "client", or of a name that Make was given.
  [[nodiscard]] TlsFiles Of(const std::string& name) const;
  // A certificate of the same authority, valid for so many days from now; negative: it has expired.
  void Make(const std::string& name, int days);
  // Takes the place of this folder's files, one renaming a file.
  void ReplaceBy(const DevelopmentCertificates& other, const std::string& name);

 private:
  TemporaryFolder folder_;
};

}  // namespace lucerna
