// The BSDF of each kind of material, defined in bsdf_NAME.cc.
//
// Sample, Evaluate, Pdf, Albedo, ReflectedShare, ShareOfFirst, EyeFactor and PhotonFactor are
// SampleBsdf, EvaluateBsdf, PdfBsdf, AlbedoOf and the functions of these names of transport/bsdf.h
// for materials of that kind.
#pragma once

#include "render/transport/bsdf.h"

namespace lucerna {

#define LUCERNA_DECLARE(Name, name)                                                         \
  struct Name##Bsdf {                                                                       \
    static bool Sample(const Material& material, Vec3 wo, float u_lobe, float u1, float u2, \
                       Carried carried, BsdfSample& sample);                                \
    static Rgb Evaluate(const Material& material, Vec3 wo, Vec3 wi, Carried carried);       \
    static float Pdf(const Material& material, Vec3 wo, Vec3 wi);                           \
    static Rgb Albedo(const Material& material);                                            \
    static float ReflectedShare(const Material& material, float cos_o);                     \
    static float ShareOfFirst(const Material& material, Vec3 wo);                           \
    static Rgb EyeFactor(const Material& material, Vec3 wo);                                \
    static float PhotonFactor(const Material& material, Vec3 wi);                           \
  };
LUCERNA_MATERIALS(LUCERNA_DECLARE)
#undef LUCERNA_DECLARE

}  // namespace lucerna
