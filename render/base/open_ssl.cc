#include "render/base/open_ssl.h"

#include <openssl/crypto.h>

#include "render/base/status.h"

namespace lucerna {

void KeepOpenSsl() {
  LUCERNA_CHECK(OPENSSL_init_crypto(OPENSSL_INIT_NO_ATEXIT, nullptr) == 1);
}

}  // namespace lucerna
