// How is Embree started, and what does it say when it fails?
//
// The instruction set is pinned: equal rays have equal hits in every process of one numeric
// profile.
#pragma once

#include <cmath>

#include <embree3/rtcore.h>

#include "render/base/status.h"
#include "render/math/vector.h"

namespace lucerna {

// The device of all scenes of this process; it is never released. A device takes one of the 1,024
// keys for values of threads that a process has, so that with one for each scene a coordinator with
// a thousand jobs had none left. What went wrong in this thread before is forgotten.
// Errors: INTERNAL without AVX2. Threads: any.
[[nodiscard]] StatusOr<RTCDevice> SharedEmbreeDevice();

// What went wrong in this thread since the last call. Errors: RESOURCE_EXHAUSTED, INTERNAL.
[[nodiscard]] inline Status EmbreeStatus(RTCDevice device) {
  switch (rtcGetDeviceError(device)) {
    case RTC_ERROR_NONE:
      return absl::OkStatus();
    case RTC_ERROR_OUT_OF_MEMORY:
      return absl::ResourceExhaustedError(
          "not enough memory for the scene's acceleration structure");
    default:
      return absl::InternalError("Embree refuses the scene's geometry");
  }
}

// Whether Embree takes a ray. With numbers beyond its range, and with what is no number, it ends
// the process where it was built with assertions, as Debian builds it.
[[nodiscard]] inline bool IsInEmbreesRange(Vec3 origin, Vec3 direction) {
  constexpr float kLargest = 1.8e18F;
  const auto sum = [](Vec3 v) { return std::abs(v.x) + std::abs(v.y) + std::abs(v.z); };
  return sum(origin) + sum(direction) < kLargest;
}

}  // namespace lucerna
