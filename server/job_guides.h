// By what do the photons of a job draw their emissions, and their directions from where they first
// land?
//
// Puts together what guides are learned from: the photons that workers report, what is known of the
// image's pixels, and pilot paths from the eye where photons tell too little. How they are learned
// from it say estimate/guide_learning.h and estimate/scatter_learning.h.
//
// Threads: one caller at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include "render/analysis/prepared_scene.h"
#include "render/base/parallel.h"
#include "render/estimate/emission_report.h"
#include "render/estimate/guide_learning.h"
#include "render/estimate/hitpoint_block.h"
#include "render/estimate/image_sums.h"
#include "render/scene/render_settings.h"
#include "render/tracing/eye_path.h"
#include "render/transport/photon_guide.h"

namespace lucerna {

class JobGuides {
 public:
  // Keeps references to all.
  JobGuides(const PreparedScene& prepared, const RenderSettings& settings,
            const EyePathTracer& tracer, ThreadTeam& team);

  // What first passes of so many photons are drawn by: an even guide with reports.
  [[nodiscard]] std::shared_ptr<const PhotonGuide> First(std::uint64_t photons_per_pass) const;
  // Adds what a round reported whose `photons` were drawn by `guide`.
  void Add(std::span<const EmissionReport> reports, std::shared_ptr<const PhotonGuide> guide,
           std::uint64_t photons);
  // Whether there is to be another guide after so many passes, where `before` was in use.
  [[nodiscard]] static bool IsTimeForNext(std::uint64_t passes, const PhotonGuide& before);

  // The image so far, and the radii of the pass that was added last.
  struct SoFar {
    const ImageSums& sums;
    const RadiusColumn& radii;
  };
  // The guide of later passes, of so many photons, once `passes` were added, where `before` was in
  // use. Requires IsTimeForNext, and the scene in its three colours.
  [[nodiscard]] std::shared_ptr<const PhotonGuide> Next(const SoFar& image, std::uint64_t passes,
                                                        std::uint64_t photons_per_pass,
                                                        const PhotonGuide& before);

  // For checkpoints.
  [[nodiscard]] const GuideLearner::Numbers& learned() const { return learner_.numbers(); }
  void Restore(GuideLearner::Numbers learned) { learner_.Restore(std::move(learned)); }

 private:
  // The luminance of every pixel, and means over all.
  struct PixelMeans;
  // What a report of a pilot path stands for, given what is known of the image's pixels.
  struct Found;

  [[nodiscard]] PixelMeans MeansOf(const SoFar& image, bool has_pilots) const;
  [[nodiscard]] double BrightnessAround(const PixelMeans& means, std::size_t pixel) const;
  [[nodiscard]] double ScoreAt(const SoFar& image, const PixelMeans& means,
                               std::size_t pixel) const;
  [[nodiscard]] double FoundBy(const SoFar& image, std::size_t pixel) const;
  [[nodiscard]] std::optional<Found> FoundOf(const PilotReport& report, const SoFar& image,
                                             const PixelMeans& means) const;
  [[nodiscard]] const PilotReports& Pilots();
  [[nodiscard]] std::shared_ptr<const ScatterGuide> LearnScatterings(const SoFar& image,
                                                                     const PixelMeans& means,
                                                                     std::uint64_t passes,
                                                                     const PhotonGuide& before);
  [[nodiscard]] PilotEmissions FindPilotEmissions(const SoFar& image, const PixelMeans& means,
                                                  const ScatterGuide* scatterings);

  const PreparedScene& prepared_;
  const RenderSettings& settings_;
  const EyePathTracer& tracer_;
  ThreadTeam& team_;
  GuideLearner learner_;
  std::optional<PilotReports> pilots_;  // traced when they are first asked
  PilotReports scatter_pilots_;         // these and further ones, as passes come
};

}  // namespace lucerna
