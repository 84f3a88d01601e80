#include <cmath>

#include "render/estimate/evidence.h"
#include "render/estimate/radius_controller.h"

namespace lucerna {
namespace {

// Keeps the radius while the photons in the disc look uniform, and shrinks it where a chi-square
// test over twelve cells refuses that.
// Source: Lin, Li, Zeng, Zhang, Jia, Wang & Zhang 2020, "CPPM: Chi-Squared Progressive Photon
// Mapping".
class Cppm final : public RadiusController {
 public:
  std::size_t MemoryPerPixel() const override { return kSectors + 1; }

  PixelRadius Next(const PixelRadius& now, const RoundEvidence& evidence,
                   const PassRange& /*passes*/, std::span<double> memory) const override {
    PixelRadius next = {now.radius, now.photons + evidence.photons};
    // Photons of a disc that has been left behind say nothing about today's cells.
    // What was gathered with is rounded to a float.
    if (evidence.radius > now.radius * (1 + 1e-6)) return next;
    double total = 0;
    for (std::size_t i = 0; i < kSectors; ++i) {
      memory[i] += evidence.columns[i];
      total += memory[i];
    }
    double& wanted = memory[kSectors];
    if (wanted == 0) wanted = kFirstTest;
    if (total < wanted) return next;
    // Quantiles of chi-square at 95 % with 11 and 5 degrees of freedom.
    if (Statistic(memory.first(kSectors)) >= 19.675) {
      const bool inner_is_even = Statistic(memory.first(kSectors / 2)) < 11.070;
      next.radius *= std::sqrt(inner_is_even ? 0.5 : 0.8);
    }
    for (double& count : memory.first(kSectors))
      count = 0;
    wanted *= kTestGrowth;
    return next;
  }

 private:
  static constexpr double kFirstTest = 50;
  static constexpr double kTestGrowth = 1.5625;

  // Pearson's statistic of counts that should be equal.
  static double Statistic(std::span<const double> counts) {
    double sum = 0;
    double squares = 0;
    for (const double count : counts) {
      sum += count;
      squares += count * count;
    }
    return sum > 0 ? static_cast<double>(counts.size()) * squares / sum - sum : 0;
  }
};

}  // namespace

std::unique_ptr<RadiusController> MakeCppm(const RenderSettings& /*settings*/,
                                           float /*initial_radius*/) {
  return std::make_unique<Cppm>();
}

}  // namespace lucerna
