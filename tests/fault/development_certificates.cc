#include "tests/fault/development_certificates.h"

#include <filesystem>
#include <vector>

#include "gtest/gtest.h"

#include "tests/support/process.h"

namespace lucerna {
namespace {

const std::string kScript = LUCERNA_SOURCE_DIR "/deploy/dev-ca.sh";

}  // namespace

DevelopmentCertificates::DevelopmentCertificates() {
  const Finished made = RunProgram({"/bin/bash", kScript, folder()});
  EXPECT_EQ(made.exit_code, 0) << made.errors;
}

std::string DevelopmentCertificates::folder() const {
  return folder_.At("ca");
}

TlsFiles DevelopmentCertificates::Of(const std::string& name) const {
  return {folder() + "/ca.pem", folder() + "/" + name + ".pem", folder() + "/" + name + ".key"};
}

void DevelopmentCertificates::Make(const std::string& name, int days) {
  const Finished made = RunProgram({"/usr/bin/env", "NAMES=" + name, "DAYS=" + std::to_string(days),
                                    "/bin/bash", kScript, folder()});
  EXPECT_EQ(made.exit_code, 0) << made.errors;
}

void DevelopmentCertificates::ReplaceBy(const DevelopmentCertificates& other,
                                        const std::string& name) {
  for (const std::string& file : std::vector<std::string>{"ca.pem", name + ".key", name + ".pem"}) {
    std::filesystem::copy_file(other.folder() + "/" + file, folder() + "/" + file + ".new");
    std::filesystem::rename(folder() + "/" + file + ".new", folder() + "/" + file);
  }
}

}  // namespace lucerna
