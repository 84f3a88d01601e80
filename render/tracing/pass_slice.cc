#include "render/tracing/pass_slice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "render/base/memory.h"
#include "render/estimate/evidence.h"
#include "render/math/color_space.h"
#include "render/math/kernel.h"
#include "render/math/pass_wavelengths.h"

namespace lucerna {
namespace {

// The square of a radius is a float.
constexpr double kSmallestRadius = 1e-18;
constexpr double kLargestRadius = 1e18;

std::array<double, 3> ToDoubles(Rgb c) {
  return {static_cast<double>(c.r), static_cast<double>(c.g), static_cast<double>(c.b)};
}

}  // namespace

float HitpointRadius(float radius, float unit_radius) {
  return static_cast<float>(
      std::clamp(static_cast<double>(radius) * static_cast<double>(unit_radius), kSmallestRadius,
                 kLargestRadius));
}

RadiusColumn HitpointRadii(const EyePass& pass, const RoundPlan& plan, ThreadTeam* team) {
  RadiusColumn of_hitpoints(pass.pixels.size());
  const std::size_t first_caustic = pass.block.first_caustic();
  const auto set = [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      const float radius =
          row < first_caustic ? (*plan.radii)[pass.pixels[row]] : plan.caustic_radius;
      of_hitpoints[row] = HitpointRadius(radius, pass.unit_radii[row]);
    }
  };
  constexpr std::size_t kRowsAtOnce = std::size_t{1} << 14;
  if (team != nullptr) {
    team->For(of_hitpoints.size(), kRowsAtOnce, set);
  } else {
    set(0, of_hitpoints.size());
  }
  return of_hitpoints;
}

// Columns are made when their turn comes, and what they follow from is freed after it: at no time
// are there both the whole pass and the whole slice.
SliceSums SliceOfPass(EyePass pass, const RoundPlan& plan, PassSums sums,
                      const RenderSettings& settings, const SceneNeeds& needs,
                      const FluxScale& scale, ThreadTeam& team) {
  const std::size_t rows = pass.pixels.size();
  const std::size_t pixels = pass.direct.size();
  LUCERNA_CHECK(sums.size() == rows && plan.radii->size() == pixels &&
                sums.evidence().size() >= kCommonColumns);
  const std::size_t evidence = ControllerColumns(settings.radius_controller);
  SliceSums slice;
  slice.passes = {pass.pass, pass.pass + 1};
  slice.evidence = evidence;
  slice.columns.resize(ColumnsOf(slice.passes, evidence));
  const bool has_features = HasFeatures(slice.passes);
  const std::size_t first_feature = slice.first_feature();
  // The system clears memory where it is first touched, which takes as long as filling it in.
  const auto make = [&](std::size_t first, std::size_t count) {
    team.For(count, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t column = first + begin; column < first + end; ++column)
        slice.columns[column] = PackedFloats(pixels, SignificantBits(1, column, evidence));
    });
  };
  slice.tally = sums.tally();
  slice.eye_rays = pass.rays;
  for (const FoundPhoton& found : sums.FoundInOrder()) {
    if (slice.reports.size() == kMostReports) break;
    slice.reports.push_back({found.numbers, pass.pixels[found.row]});
  }
  const auto set = [&](std::size_t column, std::size_t pixel, double value) {
    slice.columns[column].Set(pixel, Rounded(value, SignificantBits(1, column, evidence)));
  };

  const SliceColumn bias = pass.pass % 2 == 0 ? kEvenBias : kOddBias;
  // What the rows of a pixel bring together is summed first, and rounded at the end.
  const auto add = [](float& sum, double value) {
    sum =
        static_cast<float>(std::clamp(static_cast<double>(sum) + value, -kLargestSum, kLargestSum));
  };

  // Some of the colours that make a mean over passes are below zero: single wavelengths are outside
  // of all three.
  std::optional<PassWavelengths> wavelengths;
  if (needs.Uses(Part::kSpectra)) wavelengths = WavelengthsOfPass(settings.seed, pass.pass);
  const auto in_color = [&](const std::array<double, 3>& values) {
    return wavelengths.has_value() ? wavelengths->ToWorking(values) : values;
  };

  const double luminance_per_quantum = static_cast<double>(Luminance(scale.watts_per_quantum));
  constexpr double kToBias = 1 / (1 - static_cast<double>(kInnerShare * kInnerShare));
  const double norm = Kernel{settings.kernel}.Norm();
  const double per_photon = norm / static_cast<double>(plan.photons_per_pass);
  const std::size_t first_caustic = pass.block.first_caustic();
  const std::size_t first_segment = pass.block.first_segment();
  pass.block = {};
  // Radiance, and the bias behind it.
  std::array<std::vector<float>, 4> of_photons;
  team.For(of_photons.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t column = begin; column < end; ++column)
      of_photons[column].resize(pixels);
  });
  make(kEvenBias, kSliceColumns - kEvenBias + evidence);
  static_assert(kEvenBias < kOddBias && kOddBias < kPhotonCount && kPhotonCount < kBlur);
  if (has_features) make(first_feature + kUnitRadius, 3);
  static_assert(kHits == kUnitRadius + 1 && kHitpoints == kHits + 1);
  const std::size_t evidence_here = sums.evidence().size() - kCommonColumns;
  const auto add_row = [&](std::size_t row) {
    const std::uint32_t pixel = pass.pixels[row];
    const bool has_common_radius = row >= first_caustic;
    const float in_units = has_common_radius ? plan.caustic_radius : (*plan.radii)[pixel];
    const auto radius = static_cast<double>(HitpointRadius(in_units, pass.unit_radii[row]));
    const double to_density = per_photon / (radius * radius);
    for (int channel = 0; channel < 3; ++channel) {
      const double flux = static_cast<double>(sums.flux(channel)[row]) *
                          static_cast<double>(scale.watts_per_quantum[channel]);
      add(of_photons[static_cast<std::size_t>(channel)][pixel],
          static_cast<double>(pass.weights[row][channel]) * flux * to_density);
    }
    const double blur = static_cast<double>(sums.evidence()[kBlurColumn][row]) * kToBias;
    add(of_photons[3][pixel], blur * luminance_per_quantum * to_density *
                                  static_cast<double>(Luminance(pass.weights[row])));
    if (has_common_radius) return;
    set(kPhotonCount, pixel, static_cast<double>(sums.counts()[row]));
    const auto unit_radius = static_cast<double>(in_units);
    set(kBlur, pixel, blur * norm / ((1 << kFluxBits) * unit_radius * unit_radius));
    for (std::size_t column = 0; column < evidence_here; ++column) {
      set(kSliceColumns + column, pixel,
          static_cast<double>(sums.evidence()[kCommonColumns + column][row]));
    }
    if (!has_features) return;
    set(first_feature + kUnitRadius, pixel, static_cast<double>(pass.unit_radii[row]));
    set(first_feature + kHitpoints, pixel, 1);
  };
  // A pixel has at most one row of each kind, so that rows of a kind are independent of each other.
  constexpr std::size_t kRowsAtOnce = 4096;
  const std::array bounds = {std::size_t{0}, first_caustic, first_segment, rows};
  for (std::size_t kind = 0; kind + 1 < bounds.size(); ++kind) {
    team.For(bounds[kind + 1] - bounds[kind], kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = bounds[kind] + begin; row < bounds[kind] + end; ++row)
        add_row(row);
    });
  }

  sums = PassSums(0);
  FreeMemoryOf(pass.pixels);
  FreeMemoryOf(pass.weights);
  FreeMemoryOf(pass.unit_radii);

  make(kPhotonRadiance, 3);
  make(kDirectRadiance, 3);
  const PhotonRounding rounded_photons(slice.passes);
  const auto set_radiance = [&](std::size_t pixel) {
    std::array<double, 3> photons{};
    for (std::size_t c = 0; c < 3; ++c)
      photons[c] = static_cast<double>(of_photons[c][pixel]);
    photons = in_color(photons);
    const std::array<double, 3> direct = in_color(ToDoubles(pass.direct[pixel]));
    std::array<float, 3> by_photons{};
    for (std::size_t c = 0; c < 3; ++c) {
      by_photons[c] = static_cast<float>(std::clamp(photons[c], -kLargestSum, kLargestSum));
      set(kDirectRadiance + c, pixel, direct[c]);
    }
    by_photons = rounded_photons(pixel, slice.columns[kPhotonCount][pixel], by_photons);
    for (std::size_t c = 0; c < 3; ++c)
      slice.columns[kPhotonRadiance + c].Set(pixel, by_photons[c]);
    set(bias, pixel, static_cast<double>(of_photons[3][pixel]));
  };
  const auto for_pixels = [&](const auto& work) {
    team.For(pixels, kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t pixel = begin; pixel < end; ++pixel)
        work(pixel);
    });
  };
  for_pixels(set_radiance);
  FreeMemoryOf(pass.direct);
  for (std::vector<float>& column : of_photons)
    FreeMemoryOf(column);

  if (has_features) {
    make(first_feature + kAlbedo, kUnitRadius - kAlbedo);
    static_assert(kAlbedo < kNormal && kNormal < kDistance && kDistance < kUnitRadius);
    for_pixels([&](std::size_t pixel) {
      const EyeFeatures& features = pass.features[pixel];
      if (!std::isfinite(features.distance)) return;
      const std::array<double, 3> albedo = in_color(ToDoubles(features.albedo));
      for (int c = 0; c < 3; ++c) {
        const auto offset = static_cast<std::size_t>(c);
        set(first_feature + kAlbedo + offset, pixel, albedo[offset]);
        set(first_feature + kNormal + offset, pixel, static_cast<double>(features.normal[c]));
      }
      set(first_feature + kDistance, pixel, static_cast<double>(features.distance));
      set(first_feature + kHits, pixel, 1);
    });
    FreeMemoryOf(pass.features);
  }
  return slice;
}

}  // namespace lucerna
