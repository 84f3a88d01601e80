#include "server/job_retention.h"

namespace lucerna {

std::vector<KeptOfJob> DecideRetention(const std::vector<EndedJob>& newest_first,
                                       const RetentionLimits& limits) {
  std::vector<KeptOfJob> kept;
  std::size_t with_photons = 0;
  std::size_t in_memory = 0;
  std::int64_t pixels = 0;
  std::size_t images = 0;
  std::size_t image_bytes = 0;
  for (const EndedJob& job : newest_first) {
    KeptOfJob& of_job = kept.emplace_back();
    of_job.record =
        kept.size() <= limits.jobs && (limits.age == Duration::zero() || job.age <= limits.age);
    if (job.has_photons) {
      if (++with_photons > 1) pixels += job.pixels;
      of_job.photons = of_job.record && pixels <= limits.pixels;
    }
    if (job.is_in_memory) of_job.in_memory = of_job.photons && ++in_memory <= limits.in_memory;
    if (job.has_image) {
      if (++images > 1) image_bytes += job.image_bytes;
      of_job.image = of_job.record && images <= limits.images && image_bytes <= limits.image_bytes;
    }
  }
  return kept;
}

}  // namespace lucerna
