#include "render/geometry/numeric_profile.h"

#include "absl/strings/str_cat.h"
#include <embree3/rtcore_config.h>
#include <gnu/libc-version.h>

namespace lucerna {

std::string NumericProfile() {
  // The C library is asked at run time: its sine and logarithm are part of the image.
  return absl::StrCat("lucerna 0.1.0; ", __VERSION__,
                      "; x86-64-v3 without fused multiply-add; embree ", RTC_VERSION_STRING,
                      " avx2; glibc ", gnu_get_libc_version());
}

}  // namespace lucerna
