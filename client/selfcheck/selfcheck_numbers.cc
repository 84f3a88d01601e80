// Do counts and frequency states stay right at the ends of their ranges?
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "absl/strings/str_cat.h"

#include "client/selfcheck/selfcheck.h"
#include "render/estimate/accumulation.h"
#include "render/estimate/evidence.h"
#include "render/frequency/spectrum.h"

namespace lucerna {
namespace {

// Batches of 1e12 photons that all land on one hitpoint, beyond the whole numbers of a double.
StatusOr<CaseOutcome> CountsStayExact(SelfcheckBench& /*bench*/) {
  constexpr std::uint64_t kTrillion = 1'000'000'000'000;
  constexpr std::uint64_t kBatches = 10'007;
  PassSums sums(1, kCommonColumns);
  Accumulation batch;
  batch.hitpoints = {0};
  batch.counts = {UINT32_MAX};
  for (std::vector<std::int64_t>& channel : batch.flux)
    channel = {(std::int64_t{1} << 49) + 1};
  batch.evidence.assign(kCommonColumns, {1});
  batch.tally.photons = kTrillion + 1;
  batch.tally.rays = 3 * kTrillion + 1;
  std::int64_t wrong = 0;
  for (std::uint64_t i = 0; i < kBatches; ++i)
    LUCERNA_RETURN_IF_ERROR(sums.Add(batch));
  wrong += sums.counts()[0] == kBatches * UINT32_MAX ? 0 : 1;
  wrong += sums.flux(0)[0] == static_cast<std::int64_t>(kBatches) * batch.flux[0][0] ? 0 : 1;
  wrong += sums.tally().photons == kBatches * (kTrillion + 1) ? 0 : 1;
  wrong += sums.tally().rays == kBatches * (3 * kTrillion + 1) ? 0 : 1;
  // The next ones would not fit: they are refused, and leave what is there.
  std::uint64_t accepted = 0;
  while (sums.Add(batch).ok() && accepted <= kBatches)
    ++accepted;
  const std::uint64_t room = static_cast<std::uint64_t>(INT64_MAX / batch.flux[0][0]);
  wrong += kBatches + accepted == room ? 0 : 1;
  wrong += sums.flux(0)[0] == static_cast<std::int64_t>(room) * batch.flux[0][0] ? 0 : 1;
  return AtMost(static_cast<double>(wrong), 0, "sums that are not exact, or that wrapped");
}

bool IsWithin(const Spectrum& x, const SpectrumLimits& limits) {
  const Spectrum held = limits.Clamp(x);
  return x.s == held.s && x.v == held.v && x.p == held.p && x.g == held.g && x.h == held.h;
}

// Every state at its lower clamp, in the middle and at its upper one, through every event.
StatusOr<CaseOutcome> ClampsHold(SelfcheckBench& /*bench*/) {
  std::int64_t outcomes = 0;
  std::int64_t wrong = 0;
  for (const double diagonal : {1e-20, 1.0, 1e20}) {
    const SpectrumLimits limits = SpectrumLimits::ForDiagonal(diagonal);
    const auto see = [&](const Spectrum& outcome) {
      ++outcomes;
      wrong +=
          IsWithin(outcome, limits) && IsWithin(Travel(outcome, diagonal, limits), limits) ? 0 : 1;
    };
    const double middle_v = 1 / diagonal;
    for (const double s : {0.0, middle_v * middle_v, limits.s}) {
      for (const double v : {-limits.v, -middle_v, 0.0, limits.v}) {
        for (const double p : {kSmallestAngularVariance, 0.25, kLargestAngularVariance}) {
          for (const bool is_bent : {false, true}) {
            Spectrum x;
            x.s = s;
            x.v = v;
            x.p = p;
            x.g = is_bent ? limits.g : 0;
            x.h = is_bent ? limits.h : 0;
            for (const double length : {0.0, limits.edge_distance_m, diagonal, limits.distance_m}) {
              see(Travel(x, length, limits));
              see(PassEdge(x, length, limits.distance_m - length, 1, limits));
              see(LeaveDiffuse(x, length, limits));
            }
            for (const double cosine : {0.0, 0.02, 0.7, 1.0}) {
              for (const double curvature : {-limits.curvature, 0.0, limits.curvature}) {
                const SurfaceBend bend = {curvature, -curvature, limits.g, limits.h};
                see(Mirror(x, cosine, bend, limits));
                for (const double ratio : {0.01, 1 / 1.5, 1.0, 1.5, 100.0})
                  see(Refract(x, ratio, cosine, bend, limits));
                const double trace = ReceivedTrace(x, cosine, curvature, -curvature, limits);
                wrong += std::isfinite(trace) && trace >= 0 ? 0 : 1;
              }
            }
          }
        }
      }
    }
  }
  return AtMost(static_cast<double>(wrong), 0,
                absl::StrCat("states beyond their clamps, of ", outcomes));
}

}  // namespace

std::vector<SelfcheckCase> NumberCases() {
  return {
      {"number-counts", "1e16 photons in batches of 1e12 are counted to the last", CountsStayExact},
      {"number-clamps", "frequency states at every clamp stay within them", ClampsHold},
  };
}

}  // namespace lucerna
