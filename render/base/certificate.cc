#include "render/base/certificate.h"

#include <ctime>
#include <memory>

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include "render/base/files.h"

namespace lucerna {
namespace {

struct Free {
  void operator()(BIO* bio) const { BIO_free(bio); }
  void operator()(X509* certificate) const { X509_free(certificate); }
  void operator()(EVP_PKEY* key) const { EVP_PKEY_free(key); }
};

StatusOr<std::string> Read(const char* flag, const std::string& path) {
  if (path.empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(flag, " is missing; TLS needs --tls-ca, --tls-cert and --tls-key, all three"));
  }
  StatusOr<std::string> bytes = ReadFile(path);
  if (bytes.ok()) return bytes;
  return absl::NotFoundError(absl::StrCat(flag, " ", std::string(bytes.status().message())));
}

Status NoPem(const char* flag, const std::string& path, const char* what) {
  ERR_clear_error();
  return absl::InvalidArgumentError(
      absl::StrCat(flag, " ", path, ": there is no ", what, " in PEM form in this file"));
}

// A key with a passphrase is no key here: a service has nobody to type it.
int NoPassphrase(char* /*buffer*/, int /*size*/, int /*is_write*/, void* /*user*/) {
  return -1;
}

StatusOr<std::unique_ptr<X509, Free>> ReadCertificate(const char* flag, const std::string& path) {
  LUCERNA_ASSIGN_OR_RETURN(const std::string bytes, Read(flag, path));
  const std::unique_ptr<BIO, Free> bio(
      BIO_new_mem_buf(bytes.data(), static_cast<int>(bytes.size())));
  std::unique_ptr<X509, Free> certificate(PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr));
  if (!certificate) return NoPem(flag, path, "certificate");
  return certificate;
}

StatusOr<WallTime> WallTimeOf(const ASN1_TIME* time) {
  std::tm parts{};
  if (ASN1_TIME_to_tm(time, &parts) != 1) {
    ERR_clear_error();
    return absl::InvalidArgumentError("a time that cannot be read");
  }
  return WallTime(std::chrono::seconds(timegm(&parts)));
}

std::string CommonName(const X509* certificate) {
  const X509_NAME* const subject = X509_get_subject_name(certificate);
  const int at = X509_NAME_get_index_by_NID(subject, NID_commonName, -1);
  if (at < 0) return "";
  const ASN1_STRING* const value = X509_NAME_ENTRY_get_data(X509_NAME_get_entry(subject, at));
  return {reinterpret_cast<const char*>(ASN1_STRING_get0_data(value)),
          static_cast<std::size_t>(ASN1_STRING_length(value))};
}

}  // namespace

std::string UtcText(WallTime time) {
  const std::time_t seconds =
      std::chrono::duration_cast<std::chrono::seconds>(time.time_since_epoch()).count();
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[64] = "";
  std::strftime(text, sizeof(text), "%Y-%m-%d %H:%M:%S UTC", &parts);
  return text;
}

StatusOr<CertificateFacts> CheckTlsFiles(const TlsFiles& files, WallTime now) {
  LUCERNA_RETURN_IF_ERROR(ReadCertificate("--tls-ca", files.authority).status());
  LUCERNA_ASSIGN_OR_RETURN(const auto certificate,
                           ReadCertificate("--tls-cert", files.certificate));
  LUCERNA_ASSIGN_OR_RETURN(const std::string key_bytes, Read("--tls-key", files.key));
  const std::unique_ptr<BIO, Free> bio(
      BIO_new_mem_buf(key_bytes.data(), static_cast<int>(key_bytes.size())));
  const std::unique_ptr<EVP_PKEY, Free> key(
      PEM_read_bio_PrivateKey(bio.get(), nullptr, NoPassphrase, nullptr));
  if (!key) return NoPem("--tls-key", files.key, "private key without passphrase");
  if (X509_check_private_key(certificate.get(), key.get()) != 1) {
    ERR_clear_error();
    return absl::InvalidArgumentError(absl::StrCat("--tls-key ", files.key,
                                                   ": this key is not that of the certificate in ",
                                                   files.certificate));
  }
  const StatusOr<WallTime> from = WallTimeOf(X509_get0_notBefore(certificate.get()));
  const StatusOr<WallTime> until = WallTimeOf(X509_get0_notAfter(certificate.get()));
  if (!from.ok() || !until.ok()) return NoPem("--tls-cert", files.certificate, "valid certificate");
  if (now > *until) {
    return absl::InvalidArgumentError(absl::StrCat("--tls-cert ", files.certificate,
                                                   ": this certificate expired at ",
                                                   UtcText(*until), "; renew it"));
  }
  if (now < *from) {
    return absl::InvalidArgumentError(
        absl::StrCat("--tls-cert ", files.certificate, ": this certificate is not valid before ",
                     UtcText(*from), "; is this machine's clock right?"));
  }
  return CertificateFacts{CommonName(certificate.get()), *until};
}

}  // namespace lucerna
