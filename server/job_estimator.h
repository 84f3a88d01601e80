// What is the image, given the photons so far?
//
// The coordinator's side of the estimator for one job, without any knowledge of workers: it plans
// rounds of passes, traces the eye paths of passes that are split, takes in what rounds brought,
// and turns sums into an image.
//
// Order of calls for a round (estimate/rounds.h)
//   1. PlanFor(round): from when all passes before RadiiFrom(round) have been added; the same
//      whether more have been added by then or not. So workers trace it while stragglers finish
//      earlier ones, a job can go on after its end, and the result does not depend on when anything
//      happens.
//   2. For passes that are split: TraceEyePaths(p) at any time, and SliceOf(p) once all photons
//      have been gathered.
//   3. AddRound(sums, plan): in order, each round once.
//
// Threads: one caller at a time, except that TraceEyePaths and what is computed from a snapshot may
// run beside the others.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render/analysis/needs.h"
#include "render/base/parallel.h"
#include "render/base/status.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/error_estimate.h"
#include "render/estimate/hitpoint_block.h"
#include "render/estimate/image_sums.h"
#include "render/estimate/rounds.h"
#include "render/estimate/slice_sums.h"
#include "render/film/denoise.h"
#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"
#include "render/tracing/hitpoint_pass.h"
#include "render/tracing/pass_slice.h"
#include "render/wire/bytes.h"
#include "server/emission_check.h"
#include "server/reference_image.h"

namespace lucerna {

// A light that sends photons, and how many of them have come into view.
struct LightFinding {
  std::string name;        // "light 2 (a point light at (0, 1, 2))"
  double power_share = 0;  // of the power of all lights
  LightTally photons;
  // What may be missing because too few photons have found the way, as a share of the image's
  // brightness (estimate/missing_light.h); infinite while the image is black.
  double missing_share = 0;
};

// What errors are estimated from: a copy, so that rounds can be added meanwhile.
struct EstimatorSnapshot {
  ImageStatistics image;
  std::uint64_t photons = 0;
  std::vector<LightTally> lights;
  double luminance = 0;         // mean over pixels, without exposure
  double photon_luminance = 0;  // of that, by photons
};

// Light that may not have been found yet.
struct MissingLight {
  std::vector<LightFinding> lights;
  double share = 0;  // the sum of those of the lights
  // What it adds to the upper ends of the intervals of the squared errors.
  double relative = 0, absolute = 0;
  // Lights send photons or are sampled, and the image is black.
  bool nothing_found = false;
};

class JobEstimator {
 public:
  // Keeps `scene`. `needs` are those of scene and settings. Builds what eye paths need; may take
  // seconds for big scenes. threads = 0: all the machine has.
  // Errors: RESOURCE_EXHAUSTED when memory runs out, INTERNAL when Embree refuses the scene.
  [[nodiscard]] static StatusOr<std::unique_ptr<JobEstimator>> Create(Scene scene,
                                                                      RenderSettings settings,
                                                                      SceneNeeds needs,
                                                                      int threads);
  ~JobEstimator();

  // That does what is spread over threads.
  [[nodiscard]] ThreadTeam& team();

  // `counts` are those of the pass's plan, `shall_stop` as TraceHitpointPass has it.
  [[nodiscard]] StatusOr<EyePass> TraceEyePaths(
      std::uint64_t pass, const EyePathCounts* counts = nullptr,
      const std::function<bool()>& shall_stop = nullptr) const;
  // Absent while passes before RadiiFrom(round) have not been added, and for a round that has been.
  [[nodiscard]] std::optional<RoundPlan> PlanFor(const PassRange& round) const;
  [[nodiscard]] SliceShape ShapeOf(const PassRange& round, const RoundPlan& plan) const;
  // The slice of a pass whose photons brought `sums`, of pass.block.size() rows; both are used up.
  [[nodiscard]] SliceSums SliceOf(EyePass pass, const RoundPlan& plan, PassSums sums) const;
  // Requires the next round, whole, and its plan. Lets go of the round's columns as soon as they
  // have been added: what is learned from it afterwards takes longer.
  void AddRound(std::shared_ptr<const SliceSums> round, const RoundPlan& plan);
  // Slices of the round after those added, from its first pass on without a gap, and its plan: they
  // count in all that follows here until the next AddRound or SetTail, but radii do not follow from
  // them.
  void SetTail(ImageSums::Slices tail, const RoundPlan& plan);

  // Passes added, and photons and rays traced for them; with the tail.
  [[nodiscard]] std::int64_t passes() const;
  [[nodiscard]] std::uint64_t photons() const;
  [[nodiscard]] std::uint64_t eye_rays() const;
  // Passes added without the tail.
  [[nodiscard]] std::uint64_t whole_passes() const;
  // Of the passes added without the tail.
  [[nodiscard]] const BatchTally& whole_tally() const;
  // The image of the passes so far, without metadata. Requires passes() > 0. Layers
  // `noise` (standard deviation of each pixel's luminance) and `bias` from the second pass on.
  [[nodiscard]] Image MakeImage() const { return MakeBands().Whole(); }
  // The same, to be made while nothing is added here; this estimator must live as long.
  // `denoised` is of the same passes, or nullptr.
  [[nodiscard]] BandedImage MakeBands(
      std::shared_ptr<const DenoisedImage> denoised = nullptr) const;
  // What is filtered to denoise the image so far. Requires two passes or more.
  [[nodiscard]] NoisyImage MakeNoisyImage() const;
  // Of what MakeNoisyImage gave; takes far longer. May run beside all others.
  [[nodiscard]] DenoisedImage Denoise(NoisyImage image) const;
  // Requires passes() > 0.
  [[nodiscard]] EstimatorSnapshot Snapshot() const;
  // May run beside all others. Requires a snapshot of this estimator.
  [[nodiscard]] MissingLight FindMissingLight(const EstimatorSnapshot& snapshot) const;
  // `look` counts the estimates of this job, from 1. The upper ends of its intervals hold what is
  // `missing`; they are infinite while nothing is found. May run beside all others, but not beside
  // itself. Requires a snapshot of this estimator, of two passes or more.
  [[nodiscard]] ErrorEstimate EstimateError(EstimatorSnapshot snapshot, const MissingLight& missing,
                                            int look) const;
  // Whether all pixels are black. Requires passes() > 0.
  [[nodiscard]] bool IsBlack() const;
  [[nodiscard]] const SceneNeeds& needs() const;
  // See LightSet.
  [[nodiscard]] std::size_t faint_lights() const;
  // For the results of workers.
  [[nodiscard]] EmissionCheck emission_check() const;
  // Requires a reference as large as the image.
  [[nodiscard]] static TrueError ErrorAgainst(const ReferenceImage& reference,
                                              const EstimatorSnapshot& snapshot);
  [[nodiscard]] static TrueError ErrorAgainst(const ReferenceImage& reference,
                                              const DenoisedImage& denoised);

  // All that later passes and images follow from, of the rounds added without the tail. Its columns
  // are borrowed: the writer is of use until the next round is added.
  void Save(ByteWriter& writer) const;
  // Goes on from what Save of an estimator of the same scene and settings wrote: all that follows
  // is to the bit what would have followed there. Requires that no round has been added.
  // Errors: INVALID_ARGUMENT for bytes of another shape; then nothing has changed.
  [[nodiscard]] Status Restore(ByteReader& reader);

 private:
  struct State;
  // Standard deviations of the image so far [pixels]. Requires two passes or more.
  [[nodiscard]] std::vector<float> NoiseLayer() const;
  // Of the image so far (ErrorEstimate::noise_area).
  [[nodiscard]] double NoiseArea() const;
  explicit JobEstimator(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace lucerna
