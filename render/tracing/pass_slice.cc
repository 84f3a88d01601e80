#include "render/tracing/pass_slice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

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

// Rows, or pixels, that a thread takes at once.
constexpr std::size_t kTakenAtOnce = 4096;

std::array<double, 3> ToDoubles(Rgb c) {
  return {static_cast<double>(c.r), static_cast<double>(c.g), static_cast<double>(c.b)};
}

// The columns of the slice of one pass, while they are filled in.
class SliceFiller {
 public:
  SliceFiller(SliceSums& slice, std::size_t pixels, ThreadTeam& team)
      : slice_(slice), pixels_(pixels), team_(team) {}

  // The system clears memory where it is first touched, which takes as long as filling it in.
  void Make(std::size_t first, std::size_t count) {
    team_.For(count, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t column = first + begin; column < first + end; ++column)
        slice_.columns[column] = PackedFloats(pixels_, BitsOf(column));
    });
  }
  void Set(std::size_t column, std::size_t pixel, double value) {
    slice_.columns[column].Set(pixel, Rounded(value, BitsOf(column)));
  }
  template <typename Work>
  void ForPixels(const Work& work) {
    team_.For(pixels_, kTakenAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t pixel = begin; pixel < end; ++pixel)
        work(pixel);
    });
  }

 private:
  [[nodiscard]] unsigned int BitsOf(std::size_t column) const {
    return SignificantBits(1, column, slice_.evidence);
  }

  SliceSums& slice_;
  const std::size_t pixels_;
  ThreadTeam& team_;
};

// Some of the colours that make a mean over passes are below zero: single wavelengths are outside
// of all three.
class ColorOfPass {
 public:
  ColorOfPass(const RenderSettings& settings, const SceneNeeds& needs, std::uint64_t pass) {
    if (needs.Uses(Part::kSpectra)) wavelengths_ = WavelengthsOfPass(settings.seed, pass);
  }
  [[nodiscard]] std::array<double, 3> operator()(const std::array<double, 3>& values) const {
    return wavelengths_.has_value() ? wavelengths_->ToWorking(values) : values;
  }

 private:
  std::optional<PassWavelengths> wavelengths_;
};

// Of unit radii makes radii.
void ScaleRadii(const EyePass& pass, const RoundPlan& plan, ThreadTeam* team,
                std::vector<float>& radii) {
  LUCERNA_CHECK(radii.size() == pass.pixels.size());
  const std::size_t first_caustic = pass.block.first_caustic();
  const auto set = [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      const float radius =
          row < first_caustic ? (*plan.radii)[pass.pixels[row]] : plan.caustic_radius;
      radii[row] = HitpointRadius(radius, radii[row]);
    }
  };
  constexpr std::size_t kRowsAtOnce = std::size_t{1} << 14;
  if (team != nullptr) {
    team->For(radii.size(), kRowsAtOnce, set);
  } else {
    set(0, radii.size());
  }
}

// Calls work(begin, end, pixel) for the rows of each pixel, which lie side by side within
// [first, last), by several threads.
template <typename Work>
void ForPixelRows(ThreadTeam& team, const std::vector<std::uint32_t>& pixels, std::size_t first,
                  std::size_t last, const Work& work) {
  team.For(last - first, kTakenAtOnce, [&](std::size_t begin, std::size_t end) {
    std::size_t row = first + begin;
    // The rows of a pixel go to the thread that has the first of them.
    while (row > first && row < last && pixels[row] == pixels[row - 1])
      ++row;
    while (row < first + end) {
      const std::size_t of_pixel = row;
      const std::uint32_t pixel = pixels[row];
      while (row < last && pixels[row] == pixel)
        ++row;
      work(of_pixel, row, pixel);
    }
  });
}

}  // namespace

float HitpointRadius(float radius, float unit_radius) {
  return static_cast<float>(
      std::clamp(static_cast<double>(radius) * static_cast<double>(unit_radius), kSmallestRadius,
                 kLargestRadius));
}

RadiusColumn HitpointRadii(const EyePass& pass, const RoundPlan& plan, ThreadTeam* team) {
  RadiusColumn radii = pass.unit_radii;
  ScaleRadii(pass, plan, team, radii);
  return radii;
}

RadiusColumn TakeHitpointRadii(EyePass& pass, const RoundPlan& plan, ThreadTeam* team) {
  RadiusColumn radii = std::exchange(pass.unit_radii, {});
  ScaleRadii(pass, plan, team, radii);
  return radii;
}

SliceSums BeginSlice(const EyePass& pass, const RenderSettings& settings) {
  SliceSums slice;
  slice.passes = {pass.pass, pass.pass + 1};
  slice.evidence = ControllerColumns(settings.radius_controller);
  slice.columns.resize(ColumnsOf(slice.passes, slice.evidence));
  slice.eye_rays = pass.rays;
  return slice;
}

void AddEyePaths(SliceSums& slice, EyePass& pass, const RenderSettings& settings,
                 const SceneNeeds& needs, ThreadTeam& team) {
  const std::size_t pixels = pass.direct.size();
  SliceFiller filler(slice, pixels, team);
  const ColorOfPass in_color(settings, needs, pass.pass);
  filler.Make(kDirectRadiance, 3);
  filler.ForPixels([&](std::size_t pixel) {
    const std::array<double, 3> direct = in_color(ToDoubles(pass.direct[pixel]));
    for (std::size_t c = 0; c < 3; ++c)
      filler.Set(kDirectRadiance + c, pixel, direct[c]);
  });
  FreeMemoryOf(pass.direct);
  if (!HasFeatures(slice.passes)) return;

  LUCERNA_CHECK(pass.features.size() == pixels);
  const std::size_t first_feature = slice.first_feature();
  filler.Make(first_feature, kFeatureColumns);
  filler.ForPixels([&](std::size_t pixel) {
    const EyeFeatures& features = pass.features[pixel];
    if (!std::isfinite(features.distance)) return;
    const std::array<double, 3> albedo = in_color(ToDoubles(features.albedo));
    for (int c = 0; c < 3; ++c) {
      const auto offset = static_cast<std::size_t>(c);
      filler.Set(first_feature + kAlbedo + offset, pixel, albedo[offset]);
      filler.Set(first_feature + kNormal + offset, pixel, static_cast<double>(features.normal[c]));
    }
    filler.Set(first_feature + kDistance, pixel, static_cast<double>(features.distance));
    filler.Set(first_feature + kHits, pixel, 1);
  });
  FreeMemoryOf(pass.features);
  // The first hitpoint of a pixel stands for the others of the pass.
  LUCERNA_CHECK(pass.unit_radii.size() == pass.pixels.size());
  ForPixelRows(team, pass.pixels, 0, pass.block.first_caustic(),
               [&](std::size_t row, std::size_t /*end*/, std::uint32_t pixel) {
                 filler.Set(first_feature + kUnitRadius, pixel,
                            static_cast<double>(pass.unit_radii[row]));
                 filler.Set(first_feature + kHitpoints, pixel, 1);
               });
}

// Columns are made when their turn comes, and what they follow from is freed after it. Beside all
// of the sums, whose columns take eight bytes a hitpoint, there is only one column of the slice,
// two bytes a pixel; from then on each step frees more than it takes.
void AddPhotons(SliceSums& slice, EyePass& pass, const RoundPlan& plan, RadiusColumn radii,
                PassSums sums, const RenderSettings& settings, const SceneNeeds& needs,
                const FluxScale& scale, ThreadTeam& team) {
  const std::size_t rows = pass.pixels.size();
  const std::size_t pixels = plan.radii->size();
  LUCERNA_CHECK(radii.size() == rows && sums.size() == rows &&
                sums.evidence().size() >= kCommonColumns);
  const std::size_t evidence = slice.evidence;
  SliceFiller filler(slice, pixels, team);
  slice.tally = sums.tally();
  for (const FoundPhoton& found : sums.FoundInOrder()) {
    if (slice.reports.size() == kMostReports) break;
    slice.reports.push_back({found.numbers, pass.pixels[found.row]});
  }

  const SliceColumn bias = pass.pass % 2 == 0 ? kEvenBias : kOddBias;
  // What the rows of a pixel bring together is summed first, and rounded at the end.
  const auto add = [](float& sum, double value) {
    sum =
        static_cast<float>(std::clamp(static_cast<double>(sum) + value, -kLargestSum, kLargestSum));
  };
  // A statistic of a pixel is the mean of its paths', of which some may have no hitpoint.
  const auto mean = [&](std::size_t begin, std::size_t end, std::uint32_t pixel,
                        const auto& of_row) {
    double sum = 0;
    for (std::size_t row = begin; row < end; ++row)
      sum += static_cast<double>(of_row[row]);
    return sum / plan.EyePathsOf(pixel);
  };

  const double luminance_per_quantum = static_cast<double>(Luminance(scale.watts_per_quantum));
  constexpr double kToBias = 1 / (1 - static_cast<double>(kInnerShare * kInnerShare));
  const double norm = Kernel{settings.kernel}.Norm();
  const double per_photon = norm / static_cast<double>(plan.photons_per_pass);
  const std::size_t first_caustic = pass.block.first_caustic();
  const std::size_t first_segment = pass.block.first_segment();
  pass.block = {};
  SumColumns columns = sums.TakeColumns();
  const auto for_rows = [&](std::size_t first, std::size_t last, const auto& work) {
    ForPixelRows(team, pass.pixels, first, last,
                 [&](std::size_t begin, std::size_t end, std::uint32_t pixel) {
                   for (std::size_t row = begin; row < end; ++row)
                     work(row, pixel);
                 });
  };
  const auto for_all_rows = [&](const auto& work) {
    for_rows(0, first_caustic, work);
    for_rows(first_caustic, first_segment, work);
    for_rows(first_segment, rows, work);
  };
  const auto to_density = [&](std::size_t row) {
    const auto radius = static_cast<double>(radii[row]);
    return per_photon / (radius * radius);
  };

  for (std::size_t column = 0; column < evidence; ++column) {
    filler.Make(kSliceColumns + column, 1);
    // Not every pass has the evidence of its controller.
    if (kCommonColumns + column >= columns.evidence.size()) continue;
    PackedIntegers& of_rows = columns.evidence[kCommonColumns + column];
    ForPixelRows(team, pass.pixels, 0, first_caustic,
                 [&](std::size_t begin, std::size_t end, std::uint32_t pixel) {
                   filler.Set(kSliceColumns + column, pixel, mean(begin, end, pixel, of_rows));
                 });
    of_rows = PackedIntegers();
  }

  std::vector<float> of_bias(pixels);
  filler.Make(kEvenBias, kSliceColumns - kEvenBias);
  static_assert(kEvenBias < kOddBias && kOddBias < kPhotonCount && kPhotonCount < kBlur);
  const PackedIntegers& blur = columns.evidence[kBlurColumn];
  for_all_rows([&](std::size_t row, std::uint32_t pixel) {
    add(of_bias[pixel], static_cast<double>(blur[row]) * kToBias * luminance_per_quantum *
                            to_density(row) * static_cast<double>(Luminance(pass.weights[row])));
  });
  ForPixelRows(team, pass.pixels, 0, first_caustic,
               [&](std::size_t begin, std::size_t end, std::uint32_t pixel) {
                 filler.Set(kPhotonCount, pixel, mean(begin, end, pixel, columns.counts));
                 const auto unit_radius = static_cast<double>((*plan.radii)[pixel]);
                 filler.Set(kBlur, pixel,
                            mean(begin, end, pixel, blur) * kToBias * norm /
                                ((1 << kFluxBits) * unit_radius * unit_radius));
               });
  FreeMemoryOf(columns.evidence);
  columns.counts = PackedIntegers();

  std::array<std::vector<float>, 3> of_photons;
  team.For(of_photons.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t channel = begin; channel < end; ++channel)
      of_photons[channel].resize(pixels);
  });
  for_all_rows([&](std::size_t row, std::uint32_t pixel) {
    const double density = to_density(row);
    for (int channel = 0; channel < 3; ++channel) {
      const auto c = static_cast<std::size_t>(channel);
      const double flux = static_cast<double>(columns.flux[c][row]) *
                          static_cast<double>(scale.watts_per_quantum[channel]);
      add(of_photons[c][pixel], static_cast<double>(pass.weights[row][channel]) * flux * density);
    }
  });
  if (!pass.direct_difference.empty()) {
    // Half of the squared difference of two is the variance of one.
    const ColorOfPass in_color(settings, needs, pass.pass);
    const auto luminance_of = [&](const std::array<double, 3>& rgb) {
      const std::array<double, 3> color = in_color(rgb);
      return WorkingLuminance(color[0], color[1], color[2]);
    };
    std::vector<double> of_photons_apart(pixels);
    for_all_rows([&](std::size_t row, std::uint32_t pixel) {
      if (plan.EyePathsOf(pixel) != 2) return;
      const double of_path = (pass.paths[row] == 0 ? 2 : -2) * to_density(row);
      std::array<double, 3> rgb{};
      for (int channel = 0; channel < 3; ++channel) {
        const auto c = static_cast<std::size_t>(channel);
        rgb[c] = static_cast<double>(pass.weights[row][channel]) *
                 static_cast<double>(columns.flux[c][row]) *
                 static_cast<double>(scale.watts_per_quantum[channel]) * of_path;
      }
      of_photons_apart[pixel] += luminance_of(rgb);
    });
    const std::size_t column = slice.first_feature() + kPathVariance;
    filler.ForPixels([&](std::size_t pixel) {
      if (plan.EyePathsOf(pixel) != 2) return;
      const double apart =
          luminance_of(ToDoubles(pass.direct_difference[pixel])) + of_photons_apart[pixel];
      filler.Set(column, pixel, apart * apart / 2);
    });
    FreeMemoryOf(pass.direct_difference);
  }
  columns.flux = {};
  FreeMemoryOf(pass.weights);
  FreeMemoryOf(pass.paths);

  FreeMemoryOf(pass.pixels);
  FreeMemoryOf(radii);

  filler.Make(kPhotonRadiance, 3);
  const ColorOfPass in_color(settings, needs, pass.pass);
  const PhotonRounding rounded_photons(slice.passes);
  filler.ForPixels([&](std::size_t pixel) {
    std::array<double, 3> photons{};
    for (std::size_t c = 0; c < 3; ++c)
      photons[c] = static_cast<double>(of_photons[c][pixel]);
    photons = in_color(photons);
    std::array<float, 3> by_photons{};
    for (std::size_t c = 0; c < 3; ++c)
      by_photons[c] = static_cast<float>(std::clamp(photons[c], -kLargestSum, kLargestSum));
    by_photons = rounded_photons(pixel, slice.columns[kPhotonCount][pixel], by_photons);
    for (std::size_t c = 0; c < 3; ++c)
      slice.columns[kPhotonRadiance + c].Set(pixel, by_photons[c]);
    filler.Set(bias, pixel, static_cast<double>(of_bias[pixel]));
  });
}

SliceSums SliceOfPass(EyePass pass, const RoundPlan& plan, PassSums sums,
                      const RenderSettings& settings, const SceneNeeds& needs,
                      const FluxScale& scale, ThreadTeam& team) {
  LUCERNA_CHECK(plan.radii->size() == pass.direct.size());
  SliceSums slice = BeginSlice(pass, settings);
  AddEyePaths(slice, pass, settings, needs, team);
  RadiusColumn radii = TakeHitpointRadii(pass, plan, &team);
  AddPhotons(slice, pass, plan, std::move(radii), std::move(sums), settings, needs, scale, team);
  return slice;
}

}  // namespace lucerna
