#include "tests/support/converging_job.h"

#include <cmath>
#include <string>

#include "render/wire/messages.h"

namespace lucerna {
namespace {

google::protobuf::Duration InSeconds(double seconds) {
  return ToProto(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds)));
}

void SetError(v1::SquaredError* error, double noise, double bias) {
  error->set_noise(noise);
  error->set_bias(bias);
  error->set_low(0.8 * (noise + bias));
  error->set_high(1.3 * (noise + bias));
}

}  // namespace

v1::Job ConvergingJob(int samples) {
  v1::Job job;
  job.set_job_id("7f3a2c");
  job.set_name("sphere-caustic.pbrt");
  job.set_state(v1::JOB_STATE_SUCCEEDED);
  job.set_stop_reason(v1::STOP_REASON_ERROR);
  job.set_scene_digest(std::string(32, '\x5a'));
  job.set_has_reference(true);
  job.add_warnings("sphere-caustic.pbrt:12:3: warning: \"string filename\" of Film is ignored");
  job.add_warnings("sphere-caustic.pbrt:48:1: note: roughness 0.01 is treated as a mirror");
  job.mutable_submitted_at()->set_seconds(1'763'700'000);
  RenderSettings settings;
  settings.width = 640;
  settings.height = 480;
  settings.photons_per_pass = 300'000;
  settings.radius_controller = RadiusControllerKind::kPpm;
  settings.max_depth = 8;
  settings.passes = 0;
  settings.error = 0.035;
  settings.time_s = 600;
  *job.mutable_settings() = ToProto(settings);

  double scale = 1;
  for (int i = 0; i < samples; ++i, scale *= 1.3) {
    v1::ErrorSample* sample = job.add_convergence();
    sample->set_passes(static_cast<std::int64_t>(std::ceil(scale)));
    sample->set_photons(static_cast<std::uint64_t>(300'000 * scale));
    *sample->mutable_running() = InSeconds(0.5 * scale);
    *sample->mutable_cpu() = InSeconds(2.9 * scale);
    const double law = std::pow(scale, -2.0 / 3);
    SetError(sample->mutable_relative(), 0.040 * law, 0.009 * law);
    SetError(sample->mutable_absolute(), 0.0040 * law, 0.0007 * law);
    sample->set_true_relative(0.049 * law * (1 + 0.15 * std::sin(1.7 * i)));
    sample->set_relative_untrimmed(0.060 * law);
    sample->set_true_relative_untrimmed(0.070 * law);
    sample->set_left_out_pixels(65);
    sample->set_true_absolute(0.0047 * law * (1 + 0.15 * std::sin(1.7 * i)));
  }
  v1::Progress* progress = job.mutable_progress();
  if (samples > 0) {
    const v1::ErrorSample& newest = *job.convergence().rbegin();
    progress->set_passes(newest.passes());
    progress->set_photons(newest.photons());
    *progress->mutable_running() = newest.running();
    *progress->mutable_worker_cpu() = InSeconds(2.5 * scale / 1.3);
    *progress->mutable_coordinator_cpu() = InSeconds(0.4 * scale / 1.3);
    *progress->mutable_to_first_photons() = InSeconds(0.31);
  }
  const double photons = static_cast<double>(progress->photons());
  int number = 0;
  for (const double share : {0.46, 0.35, 0.19}) {
    v1::WorkerShare* worker = job.add_worker_shares();
    worker->set_worker_id("w" + std::to_string(++number));
    worker->set_name("render-" + std::to_string(number) + ":" + std::to_string(4210 + number));
    worker->set_photons(static_cast<std::uint64_t>(share * photons));
    worker->set_batches(static_cast<std::uint64_t>(share * photons / 75'000));
    *worker->mutable_cpu() = InSeconds(share * photons / (190'000 + 21'000 * number));
  }
  return job;
}

}  // namespace lucerna
