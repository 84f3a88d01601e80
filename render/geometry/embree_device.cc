#include "render/geometry/embree_device.h"

#include "render/base/mutex.h"
#include "render/base/text.h"

namespace lucerna {

StatusOr<RTCDevice> SharedEmbreeDevice() {
  static Mutex mutex;
  static RTCDevice shared LUCERNA_GUARDED_BY(mutex) = nullptr;
  const MutexLock lock(mutex);
  if (shared == nullptr) shared = rtcNewDevice("isa=avx2");
  if (shared == nullptr) {
    const RTCError error = rtcGetDeviceError(nullptr);
    if (error == RTC_ERROR_UNSUPPORTED_CPU)
      return absl::InternalError("Embree cannot start: this processor has no AVX2");
    return absl::InternalError(Concat("Embree cannot start: its error ", static_cast<int>(error)));
  }
  static_cast<void>(rtcGetDeviceError(shared));
  return shared;
}

}  // namespace lucerna
