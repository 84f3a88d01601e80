#include "server/job_guides.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "render/estimate/scatter_learning.h"
#include "render/math/color_space.h"
#include "render/math/warp.h"
#include "render/tracing/pilot_paths.h"
#include "render/transport/scatter_guide.h"

namespace lucerna {
namespace {

// Luminance of a pixel.
double ValueAt(const ImageSums& sums, std::size_t pixel) {
  const RgbSum radiance = sums.RadianceAt(pixel);
  return std::max(0.0, WorkingLuminance(radiance)) / sums.weights().all();
}

// The same of what photons bring to it.
double PhotonValueAt(const ImageSums& sums, std::size_t pixel) {
  return std::max(0.0, WorkingLuminance(sums.At(pixel).photons)) / sums.weights().all();
}

// What a photon found by a pixel adds to its radiance, over its flux, but for a common factor:
// albedo over the disc's area; 0 where no surface was met in the first passes (media).
double FactorAt(const JobGuides::SoFar& image, std::size_t pixel) {
  const ImageSums::Features features = image.sums.FeaturesAt(pixel);
  if (!(features.hitpoints > 0 && features.hits > 0)) return 0;
  const Rgb albedo = features.albedo / static_cast<float>(features.hits);
  const double radius =
      static_cast<double>(image.radii[pixel]) *
      static_cast<double>(features.unit_radius / static_cast<float>(features.hitpoints));
  return WorkingLuminance(static_cast<double>(albedo.r), static_cast<double>(albedo.g),
                          static_cast<double>(albedo.b)) /
         std::max(radius * radius, 1e-36);
}

// The share of the photons drawn without a guide that hitpoints have found so far.
double EvenFoundShare(const ImageSums& sums) {
  double sent = 0;
  double found = 0;
  for (const LightTally& light : sums.tally().lights) {
    sent += static_cast<double>(light.sent);
    for (const std::uint64_t of_class : light.in_view)
      found += static_cast<double>(of_class);
  }
  return sent > 0 ? found / sent : 0;
}

// Whether photons tell too little.
bool AsksPilots(const ImageSums& sums) {
  constexpr double kEnoughFound = 0.125;
  return EvenFoundShare(sums) < kEnoughFound;
}

}  // namespace

struct JobGuides::PixelMeans {
  std::vector<double> values;
  double value = 0, factor = 0;
  double photons = 0;  // what of `value` they brought
};

struct JobGuides::Found {
  double flux = 0;     // EvenFlux
  double brought = 0;  // to the pixel, luminance
  // So many photons of this emission are found for each unit that they bring.
  double photons_per_value = 0;
};

JobGuides::JobGuides(const PreparedScene& prepared, const RenderSettings& settings,
                     const EyePathTracer& tracer, ThreadTeam& team)
    : prepared_(prepared),
      settings_(settings),
      tracer_(tracer),
      team_(team),
      learner_(static_cast<std::size_t>(settings.crop_width()) *
               static_cast<std::size_t>(settings.crop_height())) {}

std::shared_ptr<const PhotonGuide> JobGuides::First(std::uint64_t photons_per_pass) const {
  return std::make_shared<const PhotonGuide>(learner_.First(photons_per_pass));
}

void JobGuides::Add(std::span<const EmissionReport> reports,
                    std::shared_ptr<const PhotonGuide> guide, std::uint64_t photons) {
  learner_.Add(reports, std::move(guide), photons);
}

bool JobGuides::IsTimeForNext(std::uint64_t passes, const PhotonGuide& before) {
  // A guide that asks for no reports was learned from enough of them.
  return IsGuidePass(passes) && before.reported() != 0;
}

std::shared_ptr<const PhotonGuide> JobGuides::Next(const SoFar& image, std::uint64_t passes,
                                                   std::uint64_t photons_per_pass,
                                                   const PhotonGuide& before) {
  const bool has_pilots = AsksPilots(image.sums);
  const PixelMeans means = MeansOf(image, has_pilots);
  const auto scatterings =
      has_pilots ? LearnScatterings(image, means, passes, before) : before.scatterings();
  return std::make_shared<const PhotonGuide>(learner_.Next(
      passes, photons_per_pass, [&](std::uint32_t pixel) { return ScoreAt(image, means, pixel); },
      [this](const PrimaryNumbers& numbers) { return EvenFlux(prepared_.lights(), numbers); },
      has_pilots ? FindPilotEmissions(image, means, scatterings.get()) : PilotEmissions(),
      scatterings));
}

// `photons` of the means only where it `has_pilots` to compare them with.
JobGuides::PixelMeans JobGuides::MeansOf(const SoFar& image, bool has_pilots) const {
  // Of pieces, added up in their order.
  constexpr std::size_t kPixelsAtOnce = 4096;
  struct Piece {
    double value = 0, factor = 0, photons = 0;
  };
  const std::size_t pixels = image.sums.pixels();
  std::vector<Piece> pieces((pixels + kPixelsAtOnce - 1) / kPixelsAtOnce);
  PixelMeans means;
  means.values.resize(pixels);
  team_.For(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t piece = begin; piece < end; ++piece) {
      const std::size_t last = std::min(pixels, (piece + 1) * kPixelsAtOnce);
      for (std::size_t pixel = piece * kPixelsAtOnce; pixel < last; ++pixel) {
        means.values[pixel] = ValueAt(image.sums, pixel);
        pieces[piece].value += means.values[pixel];
        pieces[piece].factor += FactorAt(image, pixel);
        if (has_pilots) pieces[piece].photons += PhotonValueAt(image.sums, pixel);
      }
    }
  });
  for (const Piece& piece : pieces) {
    means.value += piece.value / static_cast<double>(pixels);
    means.factor += piece.factor / static_cast<double>(pixels);
    means.photons += piece.photons / static_cast<double>(pixels);
  }
  return means;
}

// The value of a pixel over the mean of all: of a few pixels around it, for a photon must not make
// its own pixel bright, and with a floor.
double JobGuides::BrightnessAround(const PixelMeans& means, std::size_t pixel) const {
  constexpr std::size_t kReach = 2;  // pixels
  constexpr double kFloor = 0.1;     // of the mean value, as in relative errors
  const auto columns = static_cast<std::size_t>(settings_.crop_width());
  const std::size_t rows = means.values.size() / columns;
  const std::size_t x = pixel % columns;
  const std::size_t y = pixel / columns;
  double value = 0;
  double around = 0;
  for (std::size_t v = y - std::min(y, kReach); v <= std::min(rows - 1, y + kReach); ++v) {
    for (std::size_t u = x - std::min(x, kReach); u <= std::min(columns - 1, x + kReach); ++u) {
      value += means.values[v * columns + u];
      ++around;
    }
  }
  return value / around / means.value + kFloor;
}

// The square of what a photon of even flux found by a pixel adds to its value, relative to that
// value.
double JobGuides::ScoreAt(const SoFar& image, const PixelMeans& means, std::size_t pixel) const {
  if (!(means.value > 0)) return 1;
  const double factor = FactorAt(image, pixel);
  const double of_mean = factor > 0 && means.factor > 0 ? factor / means.factor : 1;
  const double relative = of_mean / BrightnessAround(means, pixel);
  return relative * relative;
}

// How many pixels find a photon that this pixel finds: as many as its disc covers.
double JobGuides::FoundBy(const SoFar& image, std::size_t pixel) const {
  const Camera& camera = prepared_.scene().camera;
  const ImageSums::Features features = image.sums.FeaturesAt(pixel);
  auto radius = static_cast<double>(image.radii[pixel]);  // in pixels, unless
  if (settings_.initial_radius != 0 && camera.kind != Camera::Kind::kSensors && features.hits > 0) {
    const double distance =
        static_cast<double>(features.distance) / static_cast<double>(features.hits);
    radius /= std::max(PixelFootprint(camera, settings_.width, settings_.height, distance), 1e-18);
  }
  return std::max(1.0, kPi64 * radius * radius);
}

std::optional<JobGuides::Found> JobGuides::FoundOf(const PilotReport& report, const SoFar& image,
                                                   const PixelMeans& means) const {
  // A path's value over that of the pixel where it began. What few paths find is rare, not large.
  constexpr double kLargestValue = 64;
  const double factor = FactorAt(image, report.pixel);
  Found found = {.flux = EvenFlux(prepared_.lights(), report.numbers), .brought = report.brought};
  if (!(factor > 0 && found.flux > 0)) return std::nullopt;
  if (means.value > 0) {
    found.brought = std::min(found.brought,
                             kLargestValue * means.value * BrightnessAround(means, report.pixel));
  }
  // A photon of flux f that a pixel finds adds f albedo / (π² radius²) to its radiance.
  const auto power = static_cast<double>(Luminance(prepared_.lights().TotalPower()));
  found.photons_per_value =
      kPi64 * kPi64 / (factor * power * found.flux * FoundBy(image, report.pixel));
  if (!std::isfinite(found.brought * found.photons_per_value)) return std::nullopt;
  return found;
}

const PilotReports& JobGuides::Pilots() {
  if (!pilots_) pilots_ = TracePilotPaths(tracer_, prepared_.needs(), team_);
  return *pilots_;
}

// By what photons that first land are scattered after `passes`, where until now `before` was in
// use; nullptr: by BSDFs, where that lights most of the image well. Only where photons tell too
// little.
std::shared_ptr<const ScatterGuide> JobGuides::LearnScatterings(const SoFar& image,
                                                                const PixelMeans& means,
                                                                std::uint64_t passes,
                                                                const PhotonGuide& before) {
  constexpr std::uint64_t kPhotonsPerPath = 32;
  constexpr std::uint64_t kMostPaths = 65536;
  // Of what photons bring, so much must come from where the guide has cells.
  constexpr double kLeastLight = 0.15;
  // Before, it is too uncertain what photons bring.
  constexpr std::uint64_t kFirstPasses = 4;
  if (passes < kFirstPasses) return nullptr;
  const PilotReports* learned_from = &Pilots();
  if (learned_from->reports.empty()) return nullptr;
  // More paths, as a small part of what passes cost, refine what has shown its worth.
  if (before.scatterings() != nullptr) {
    if (scatter_pilots_.paths == 0) scatter_pilots_ = Pilots();
    const std::uint64_t paths =
        passes * static_cast<std::uint64_t>(settings_.photons_per_pass) / kPhotonsPerPath;
    AddPilotPaths(tracer_, prepared_.needs(), std::min(paths, kMostPaths), team_, scatter_pilots_);
    learned_from = &scatter_pilots_;
  }
  std::vector<ScatterReport> reports;
  std::vector<double> brought;
  for (const PilotReport& report : learned_from->reports) {
    if (!(report.scattering.density > 0)) continue;
    const std::optional<Found> found = FoundOf(report, image, means);
    if (!found) continue;
    const double score = ScoreAt(image, means, report.pixel);
    reports.push_back({.position = report.scattering.position,
                       .direction = report.scattering.direction,
                       .density = report.scattering.density,
                       .mass = found->brought * found->photons_per_value * found->flux *
                               found->flux * score * before.WeightAt(report.numbers)});
    brought.push_back(found->brought / static_cast<double>(learned_from->paths));
  }
  ScatterGuide guide = LearnScatterGuide(reports);
  double light = 0;  // that comes from where the guide has cells
  for (std::size_t i = 0; i < reports.size(); ++i) {
    if (guide.CellAt(reports[i].position) != ScatterGuide::kNoCell) light += brought[i];
  }
  // One that is in use stays: reports of photons that it led do not show which emissions would
  // need many photons without it.
  if (guide.empty()) return before.scatterings();
  if (before.scatterings() == nullptr && light < kLeastLight * means.photons) return nullptr;
  return std::make_shared<const ScatterGuide>(std::move(guide));
}

// What pilot paths say of the emissions that the image needs, given what is known of its pixels,
// where photons are scattered by `scatterings` (nullptr: by BSDFs).
PilotEmissions JobGuides::FindPilotEmissions(const SoFar& image, const PixelMeans& means,
                                             const ScatterGuide* scatterings) {
  const PilotReports& pilots = Pilots();
  PilotEmissions emissions;
  emissions.emissions.reserve(pilots.reports.size());
  const double paths_per_pixel =
      static_cast<double>(pilots.paths) / static_cast<double>(image.sums.pixels());
  for (const PilotReport& report : pilots.reports) {
    const std::optional<Found> found = FoundOf(report, image, means);
    if (!found) continue;
    // Counted by what they add to the variance.
    double flux_factor = 1;
    if (scatterings != nullptr && report.scattering.density > 0) {
      const ScatterGuide::Cell cell = scatterings->CellAt(report.scattering.position);
      if (cell != ScatterGuide::kNoCell) {
        flux_factor = scatterings->FluxFactor(cell, report.scattering.direction,
                                              static_cast<double>(report.scattering.density));
      }
    }
    emissions.emissions.push_back(
        {.numbers = report.numbers,
         .pixel = report.pixel,
         .found = flux_factor * (found->brought / paths_per_pixel * found->photons_per_value)});
    emissions.brought += found->brought / static_cast<double>(pilots.paths);
  }
  emissions.brought = means.photons > 0 ? emissions.brought / means.photons : HUGE_VAL;
  return emissions;
}

}  // namespace lucerna
