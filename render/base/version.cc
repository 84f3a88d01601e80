#include "render/base/version.h"

namespace lucerna {

std::string Version() {
  return LUCERNA_VERSION;
}

}  // namespace lucerna
