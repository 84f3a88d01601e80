// Sampling of a material that is the sum of two parts, from its parts: for
// render/transport/bsdf_NAME.cc alone.
#pragma once

#include "render/transport/bsdf.h"
#include "render/transport/bsdf_kinds.h"

namespace lucerna {

// Draws from one of the parts of `material`, chosen with `share` for the first. Where both parts
// scatter broadly, the sample is weighed by the density of both together. `KindBsdf` as in
// transport/bsdf_kinds.h.
template <typename KindBsdf>
bool SampleParts(const Material& material, float share, Vec3 wo, float u_lobe, float u1, float u2,
                 Carried carried, BsdfSample& sample) {
  const bool is_first = u_lobe < share;
  const float chosen = is_first ? share : 1 - share;
  if (!(chosen > 0)) return false;
  Material storage;
  const Parts part = is_first ? Parts::kFirst : Parts::kSecond;
  const Material& drawn = PartOf(material, part, storage);
  if (!KindBsdf::Sample(drawn, wo, 0, u1, u2, carried, sample)) return false;
  sample.part = part;
  if (sample.is_delta) {
    sample.weight *= 1 / chosen;
    return true;
  }
  // Evaluated anew for all parts: what the other one scatters there belongs to this sample too.
  sample.pdf = KindBsdf::Pdf(material, wo, sample.wi);
  if (!(sample.pdf > 0)) return false;
  sample.weight =
      KindBsdf::Evaluate(material, wo, sample.wi, carried) * (std::abs(sample.wi.z) / sample.pdf);
  return true;
}

}  // namespace lucerna
