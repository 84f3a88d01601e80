#include "render/transport/bsdf.h"

#include "render/transport/bsdf_kinds.h"

namespace lucerna {

bool SampleBsdf(const Material& material, Vec3 wo, float u_lobe, float u1, float u2,
                Carried carried, BsdfSample& sample) {
  switch (material.kind) {
#define LUCERNA_CASE(Name, name) \
  case Material::Kind::k##Name:  \
    return Name##Bsdf::Sample(material, wo, u_lobe, u1, u2, carried, sample);
    LUCERNA_MATERIALS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return false;
}

Rgb EvaluateBsdf(const Material& material, Vec3 wo, Vec3 wi, Carried carried) {
  switch (material.kind) {
#define LUCERNA_CASE(Name, name) \
  case Material::Kind::k##Name:  \
    return Name##Bsdf::Evaluate(material, wo, wi, carried);
    LUCERNA_MATERIALS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return {};
}

float PdfBsdf(const Material& material, Vec3 wo, Vec3 wi) {
  switch (material.kind) {
#define LUCERNA_CASE(Name, name) \
  case Material::Kind::k##Name:  \
    return Name##Bsdf::Pdf(material, wo, wi);
    LUCERNA_MATERIALS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return 0;
}

Rgb AlbedoOf(const Material& material) {
  switch (material.kind) {
#define LUCERNA_CASE(Name, name) \
  case Material::Kind::k##Name:  \
    return Name##Bsdf::Albedo(material);
    LUCERNA_MATERIALS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return {};
}

float ReflectedShare(const Material& material, float cos_o) {
  switch (material.kind) {
#define LUCERNA_CASE(Name, name) \
  case Material::Kind::k##Name:  \
    return Name##Bsdf::ReflectedShare(material, cos_o);
    LUCERNA_MATERIALS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return 1;
}

float ShareOfFirst(const Material& material, Vec3 wo) {
  switch (material.kind) {
#define LUCERNA_CASE(Name, name) \
  case Material::Kind::k##Name:  \
    return Name##Bsdf::ShareOfFirst(material, wo);
    LUCERNA_MATERIALS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return 1;
}

Rgb EyeFactor(const Material& material, Vec3 wo) {
  switch (material.kind) {
#define LUCERNA_CASE(Name, name) \
  case Material::Kind::k##Name:  \
    return Name##Bsdf::EyeFactor(material, wo);
    LUCERNA_MATERIALS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return {};
}

float PhotonFactor(const Material& material, Vec3 wi) {
  switch (material.kind) {
#define LUCERNA_CASE(Name, name) \
  case Material::Kind::k##Name:  \
    return Name##Bsdf::PhotonFactor(material, wi);
    LUCERNA_MATERIALS(LUCERNA_CASE)
#undef LUCERNA_CASE
  }
  return 1;
}

const Material& PartOf(const Material& material, Parts part, Material& storage) {
  static_cast<MaterialNumbers&>(storage) = static_cast<const MaterialNumbers&>(material);
  storage.parts = part;
  return storage;
}

}  // namespace lucerna
