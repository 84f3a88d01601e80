#include "render/formats/pbrt/media.h"

#include <optional>
#include <string>

#include "render/base/text.h"
#include "render/formats/pbrt/measured_media.h"

namespace lucerna {
namespace {

// Nearer to 1, single photons straight ahead would weigh more than the sums of a pass have room for
// (FluxScale::HasRoomFor), and the image would be too dark.
constexpr Range kMeanCosine = {-0.99, 0.99};

}  // namespace

Medium ReadMedium(ParameterList& parameters) {
  Medium medium;
  const std::optional<std::string> type = parameters.FindString("type");
  if (!type.has_value()) {
    if (!parameters.Has("type")) parameters.Error("needs \"string type\"");
    return medium;
  }
  if (*type == "uniformgrid" || *type == "rgbgrid" || *type == "nanovdb" || *type == "cloud") {
    parameters.Error(
        "type", Concat("is ", Quoted(*type),
                       ", which is not supported: media have the same density everywhere here; "
                       "use homogeneous with the mean density"));
    return medium;
  }
  if (*type != "homogeneous") {
    parameters.Error(
        "type", Concat("is ", Quoted(*type), ", which is not supported; there is homogeneous"));
    return medium;
  }
  // As pbrt-v4: each 1 where it is not given.
  medium.absorption =
      parameters.FindOpticalConstant("sigma_a", kZeroOrMore, &medium.absorption_spectrum)
          .value_or(Gray(1));
  medium.scattering =
      parameters.FindOpticalConstant("sigma_s", kZeroOrMore, &medium.scattering_spectrum)
          .value_or(Gray(1));
  if (const std::string preset = parameters.String("preset", ""); !preset.empty()) {
    const MeasuredMedium* measured = FindMeasuredMedium(preset);
    if (measured == nullptr) {
      parameters.Error("preset", Concat("is ", Quoted(preset), ", which is not known; ",
                                        MeasuredMediaThereAre()));
      return medium;
    }
    for (const std::string_view other : {"sigma_a", "sigma_s"}) {
      if (parameters.Has(other)) parameters.Warning(other, "is ignored because preset is given");
    }
    medium.absorption = measured->absorption;
    medium.scattering = measured->scattering;
    medium.absorption_spectrum = {};
    medium.scattering_spectrum = {};
  }
  const auto scale = static_cast<float>(parameters.Float("scale", 1, kZeroOrMore));
  medium.absorption *= scale;
  medium.scattering *= scale;
  medium.absorption_spectrum.factor = scale;
  medium.scattering_spectrum.factor = scale;
  if (!IsFinite(medium.Extinction())) parameters.Error("scale", "makes a coefficient too large");
  medium.g = static_cast<float>(parameters.Float("g", 0, kMeanCosine));
  if (const std::optional<Rgb> emitted = parameters.FindEmission("Le");
      emitted.has_value() && !IsBlack(*emitted) &&
      parameters.Float("Lescale", 1, kZeroOrMore) > 0) {
    parameters.Error("Le", "is not supported: media do not emit light here");
  }
  parameters.Ignore("Lescale");
  parameters.WarnOfUnread();
  return medium;
}

}  // namespace lucerna
