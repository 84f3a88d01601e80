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

// Columns are made when their turn comes, and what they follow from is freed after it: there is
// never more than the pass, its sums and a column of the controller's evidence. Those of the sums
// take eight bytes where columns of the slice take two or three, so they go first.
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
  SumColumns columns = sums.TakeColumns();
  constexpr std::size_t kRowsAtOnce = 4096;
  const auto for_rows = [&](std::size_t first, std::size_t last, const auto& work) {
    team.For(last - first, kRowsAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = first + begin; row < first + end; ++row)
        work(row, pass.pixels[row]);
    });
  };
  // A pixel has at most one row of each kind, so that rows of a kind are independent of each other.
  const auto for_all_rows = [&](const auto& work) {
    for_rows(0, first_caustic, work);
    for_rows(first_caustic, first_segment, work);
    for_rows(first_segment, rows, work);
  };
  const auto to_density = [&](std::size_t row, std::uint32_t pixel) {
    const float in_units = row >= first_caustic ? plan.caustic_radius : (*plan.radii)[pixel];
    const auto radius = static_cast<double>(HitpointRadius(in_units, pass.unit_radii[row]));
    return per_photon / (radius * radius);
  };

  for (std::size_t column = 0; column < evidence; ++column) {
    make(kSliceColumns + column, 1);
    // Not every pass has the evidence of its controller.
    if (kCommonColumns + column >= columns.evidence.size()) continue;
    std::vector<std::int64_t>& of_rows = columns.evidence[kCommonColumns + column];
    for_rows(0, first_caustic, [&](std::size_t row, std::uint32_t pixel) {
      set(kSliceColumns + column, pixel, static_cast<double>(of_rows[row]));
    });
    FreeMemoryOf(of_rows);
  }

  std::vector<float> of_bias(pixels);
  make(kEvenBias, kSliceColumns - kEvenBias);
  static_assert(kEvenBias < kOddBias && kOddBias < kPhotonCount && kPhotonCount < kBlur);
  for_all_rows([&](std::size_t row, std::uint32_t pixel) {
    const double blur = static_cast<double>(columns.evidence[kBlurColumn][row]) * kToBias;
    add(of_bias[pixel], blur * luminance_per_quantum * to_density(row, pixel) *
                            static_cast<double>(Luminance(pass.weights[row])));
    if (row >= first_caustic) return;
    set(kPhotonCount, pixel, static_cast<double>(columns.counts[row]));
    const auto unit_radius = static_cast<double>((*plan.radii)[pixel]);
    set(kBlur, pixel, blur * norm / ((1 << kFluxBits) * unit_radius * unit_radius));
  });
  FreeMemoryOf(columns.evidence);
  FreeMemoryOf(columns.counts);

  std::array<std::vector<float>, 3> of_photons;
  team.For(of_photons.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t channel = begin; channel < end; ++channel)
      of_photons[channel].resize(pixels);
  });
  for_all_rows([&](std::size_t row, std::uint32_t pixel) {
    const double density = to_density(row, pixel);
    for (int channel = 0; channel < 3; ++channel) {
      const auto c = static_cast<std::size_t>(channel);
      const double flux = static_cast<double>(columns.flux[c][row]) *
                          static_cast<double>(scale.watts_per_quantum[channel]);
      add(of_photons[c][pixel], static_cast<double>(pass.weights[row][channel]) * flux * density);
    }
  });
  for (std::vector<std::int64_t>& channel : columns.flux)
    FreeMemoryOf(channel);
  FreeMemoryOf(pass.weights);

  if (has_features) {
    make(first_feature + kUnitRadius, 3);
    static_assert(kHits == kUnitRadius + 1 && kHitpoints == kHits + 1);
    for_rows(0, first_caustic, [&](std::size_t row, std::uint32_t pixel) {
      set(first_feature + kUnitRadius, pixel, static_cast<double>(pass.unit_radii[row]));
      set(first_feature + kHitpoints, pixel, 1);
    });
  }
  FreeMemoryOf(pass.pixels);
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
    set(bias, pixel, static_cast<double>(of_bias[pixel]));
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
  FreeMemoryOf(of_bias);

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
