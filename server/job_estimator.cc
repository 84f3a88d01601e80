#include "server/job_estimator.h"

#include <utility>

#include "render/base/parallel.h"
#include "render/estimate/statistics.h"
#include "render/film/film.h"
#include "render/transport/working_space.h"
#include "server/eye_path.h"

namespace lucerna {
struct JobEstimator::State {
  State(Scene s, RenderSettings r, int threads)
      : scene(InWorkingSpace(std::move(s))), settings(r), team(threads) {}

  Scene scene;
  RenderSettings settings;
  mutable ThreadTeam team;
  std::unique_ptr<Intersector> intersector;
  std::unique_ptr<LightSet> lights;
  std::unique_ptr<EyePathTracer> tracer;
  std::unique_ptr<RadiusController> controller;
  FluxScale scale;
  std::unique_ptr<PixelStatistics> statistics;
  std::unique_ptr<Film> film;
  std::uint64_t eye_rays = 0;
};

JobEstimator::JobEstimator(std::unique_ptr<State> state) : state_(std::move(state)) {}
JobEstimator::~JobEstimator() = default;

StatusOr<std::unique_ptr<JobEstimator>> JobEstimator::Create(Scene scene, RenderSettings settings,
                                                             int threads) {
  auto state = std::make_unique<State>(std::move(scene), settings, threads);
  LUCERNA_ASSIGN_OR_RETURN(state->intersector, Intersector::Create(state->scene));
  state->lights = std::make_unique<LightSet>(state->scene, *state->intersector);
  state->tracer = std::make_unique<EyePathTracer>(state->scene, state->settings,
                                                  *state->intersector, *state->lights);
  state->scale = FluxScale::ForPower(state->lights->TotalPower());
  const int width = settings.crop_width();
  const int height = settings.crop_height();
  const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const float initial = settings.initial_radius > 0 ? static_cast<float>(settings.initial_radius)
                                                    : kInitialFootprints;
  state->controller = MakeRadiusController(state->settings, initial);
  state->statistics =
      std::make_unique<PixelStatistics>(pixels, initial, state->controller->MemoryPerPixel());
  state->film = std::make_unique<Film>(width, height, state->scene.film.exposure,
                                       state->scene.film.max_component);
  return std::unique_ptr<JobEstimator>(new JobEstimator(std::move(state)));
}

EyePass JobEstimator::TraceEyePaths(std::uint64_t pass) const {
  return TraceHitpointPass(*state_->tracer, pass, state_->team);
}

RadiusColumn JobEstimator::Radii(const EyePass& pass) const {
  return state_->statistics->Radii(pass.rows());
}

void JobEstimator::Apply(const EyePass& pass, const RadiusColumn& radii, const PassSums& sums) {
  LUCERNA_CHECK(static_cast<std::int64_t>(pass.pass) == passes_applied());
  state_->statistics->AddPhotons(pass.rows(), radii, sums, state_->scale,
                                 Kernel{state_->settings.kernel}, state_->settings.photons_per_pass,
                                 *state_->controller);
  for (std::size_t pixel = 0; pixel < pass.direct.size(); ++pixel) {
    const EyeFeatures& features = pass.features[pixel];
    state_->film->Add(pixel, pass.direct[pixel], features.albedo, features.normal,
                      features.distance);
  }
  state_->eye_rays += pass.rays;
}

std::int64_t JobEstimator::passes_applied() const {
  return state_->statistics->passes();
}

std::uint64_t JobEstimator::eye_rays() const {
  return state_->eye_rays;
}

Image JobEstimator::MakeImage() const {
  return state_->film->MakeImage(*state_->statistics, *state_->controller,
                                 Kernel{state_->settings.kernel});
}

}  // namespace lucerna
