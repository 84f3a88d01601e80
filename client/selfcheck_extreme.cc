// Do scenes of extreme sizes, distances and brightness come out as a formula says?
#include "client/selfcheck.h"

namespace lucerna {

std::vector<SelfcheckCase> ExtremeCases() {
  return {};
}

}  // namespace lucerna
