// How good is the radius that frequency photons predict?
//
// For some hundreds of hitpoints of a scene, spread evenly over the image where photons bring
// light:
//   predicted  the radius that the frequency controllers converge to, from the spectra of all
//              photons of a short run
//   truth      the irradiance in the limit of no radius, and the estimate's relative bias at every
//              radius, from a run of many more photons without spectra
// The true radius is the largest below which the bias nowhere leaves the tolerance.
//
// The limit is fitted: around a point where it is smooth, irradiance averaged over a circle is
// E + a r² + b r⁴, and thin rings have independent photons. The fit takes as many rings as it can
// before chi-square refuses it. Hitpoints whose limit stays more uncertain than 0.4 times the
// tolerance are left out, and counted. Where the light has a closed form that is the truth instead,
// at every radius as long as the disc stays on the floor, and the fit is held against it.
//
// Photons on surfaces that face elsewhere are left out on both sides: what a disc does in a corner
// or across an edge is not the spectrum's to predict.
//
// Run: build/release/bin/lucerna-radius-check SCENE --initial-radius R [--bias P%] [--kernel NAME]
//      [--photons N] [--frequency-photons N] [--hitpoints N] [--least-light P%]
//      [--json] [--points FILE.csv]
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/base/text.h"
#include "render/estimate/evidence.h"
#include "render/frequency/bandwidth.h"
#include "render/math/kernel.h"
#include "render/math/octahedral.h"
#include "render/tracing/hitpoint_pass.h"
#include "render/transport/working_space.h"
#include "server/job_estimator.h"
#include "tests/support/local_render.h"
#include "worker/photon_grid.h"
#include "worker/photon_path.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kPhotonsPerPass = std::uint64_t{1} << 20;
constexpr std::uint64_t kPhotonsPerChunk = 2048;
// The radii at which the truth is measured: R · kLadderStep^k.
constexpr double kLadderStep = 0.88;
constexpr int kLadderLength = 28;
constexpr double kWithin = 1.1;          // times the tolerance counts as kept
constexpr double kLeastCertainty = 0.4;  // of the tolerance

struct Options {
  std::string scene;
  double initial_radius = 0;
  double bias = 0.02;
  KernelKind kernel = KernelKind::kEpanechnikov;
  std::uint64_t photons = 100'000'000;
  std::uint64_t frequency_photons = 2 * kPhotonsPerPass;
  std::size_t hitpoints = 400;
  double least_light = 0.05;  // of the mean: hitpoints with less are not asked
  bool as_json = false;
  std::string points_path;
};

[[noreturn]] void Die(const std::string& words) {
  std::fprintf(stderr, "%s\n", words.c_str());
  std::exit(2);
}

double Square(double x) {
  return x * x;
}

// What one kernel makes of E + a r² + b r⁴ besides E: its second and fourth radial moments.
struct RadialMoments {
  double second, fourth;
};
RadialMoments MomentsOf(KernelKind kernel) {
  switch (kernel) {
    case KernelKind::kConstant:
      return {1.0 / 2, 1.0 / 3};
    case KernelKind::kEpanechnikov:
      return {1.0 / 3, 1.0 / 6};
    case KernelKind::kBiweight:
      return {1.0 / 4, 1.0 / 10};
    default:
      break;
  }
  Die("the check needs a kernel whose sums follow from those of rings: constant, epanechnikov or "
      "biweight");
}

// The irradiance that a scene's floor gets by photons, but for a constant factor, where it has a
// closed form; below 0 off the floor.
using ClosedForm = std::function<double(Vec3)>;
constexpr double kNoFloor = -1;

// Irradiance [per unit radiance] of a plane at `p` facing `normal` from a polygon in front of it
// (Lambert 1760).
double PolygonIrradiance(Vec3 p, Vec3 normal, const std::vector<Vec3>& corners) {
  double sum = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3 a = Normalize(corners[i] - p);
    const Vec3 b = Normalize(corners[(i + 1) % corners.size()] - p);
    const Vec3 across = Cross(a, b);
    const double sine = static_cast<double>(Length(across));
    if (!(sine > 0)) continue;
    const double angle = std::atan2(sine, static_cast<double>(Dot(a, b)));
    sum += angle / sine * static_cast<double>(Dot(across, normal));
  }
  return std::abs(sum) / 2;
}

// The shadows' boards end at x = 0, 1 m above the floor.
constexpr float kBoardHeight = 1;

ClosedForm ClosedFormOf(const std::string& scene) {
  if (scene == "penumbra.pbrt") {
    return [](Vec3 p) {
      // The part of the light that the board leaves: beyond the plane through p and its edge.
      const float from = std::clamp(p.x + (0 - p.x) * 2 / kBoardHeight, -0.25F, 0.25F);
      if (!(from < 0.25F)) return 0.0;
      return PolygonIrradiance(
          p, {0, 0, 1},
          {{from, -0.25F, 2}, {from, 0.25F, 2}, {0.25F, 0.25F, 2}, {0.25F, -0.25F, 2}});
    };
  }
  if (scene == "hard-shadow.pbrt") {
    return [](Vec3 p) {
      const double squared = static_cast<double>(p.x * p.x + p.y * p.y) + Square(2.6);
      return p.x > 0 ? 2.6 / (squared * std::sqrt(squared)) : 0.0;
    };
  }
  if (scene == "corner.pbrt") {
    return [](Vec3 p) {
      if (p.y >= 0.5F || std::abs(p.x) > 0.8F) return kNoFloor;
      return PolygonIrradiance(
          p, {0, 0, 1}, {{-0.8F, 0.5F, 0}, {0.8F, 0.5F, 0}, {0.8F, 0.5F, 1}, {-0.8F, 0.5F, 1}});
    };
  }
  return nullptr;
}

// Of the photons between two distances from a hitpoint: sums of flux times powers of the distance.
struct Ring {
  double flux = 0;
  double flux2 = 0;      // of squared flux
  double distance2 = 0;  // of flux · distance²
  double distance4 = 0;

  void Add(double photon_flux, double squared_distance) {
    flux += photon_flux;
    flux2 += photon_flux * photon_flux;
    distance2 += photon_flux * squared_distance;
    distance4 += photon_flux * squared_distance * squared_distance;
  }
  Ring& operator+=(const Ring& o) {
    flux += o.flux;
    flux2 += o.flux2;
    distance2 += o.distance2;
    distance4 += o.distance4;
    return *this;
  }
};

struct Hitpoint {
  Vec3 position;
  Vec3 normal;
  std::optional<double> predicted;  // the radius
  // Truth.
  std::vector<double> edges;  // of the rings, ascending; the last is the initial radius
  std::vector<Ring> rings;    // [edges]: from the edge before, or 0
};

// E + a r² + b r⁴ and how far it holds.
struct Limit {
  double irradiance = 0;
  double standard_error = 0;
  double a = 0, b = 0;
  double reach = 0;
};

// Weighted least squares over the first `count` rings. Weights are areas, as for photons of even
// density, so that a ring with few photons by chance does not weigh less.
std::optional<std::pair<Limit, double>> FitRings(const Hitpoint& point, std::size_t count,
                                                 double photons) {
  Ring all;
  for (std::size_t i = 0; i < count; ++i)
    all += point.rings[i];
  if (!(all.flux > 0)) return std::nullopt;
  const double reach = point.edges[count - 1];
  const double mean = all.flux / (std::numbers::pi * reach * reach * photons);
  const double typical = all.flux2 / all.flux;  // flux of one photon
  std::array<std::array<double, 4>, 3> m{};
  const auto basis = [&](std::size_t i) {
    const double low = i == 0 ? 0 : Square(point.edges[i - 1] / reach);
    const double high = Square(point.edges[i] / reach);
    return std::array{1.0, (low + high) / 2, (low * low + low * high + high * high) / 3};
  };
  const auto area = [&](std::size_t i) {
    const double low = i == 0 ? 0 : point.edges[i - 1];
    return std::numbers::pi * (Square(point.edges[i]) - Square(low));
  };
  const auto weight = [&](std::size_t i) { return area(i) * photons / (mean * typical); };
  const auto density = [&](std::size_t i) { return point.rings[i].flux / (area(i) * photons); };
  for (std::size_t i = 0; i < count; ++i) {
    const auto x = basis(i);
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t c = 0; c < 3; ++c)
        m[r][c] += weight(i) * x[r] * x[c];
      m[r][3] += weight(i) * x[r] * density(i);
    }
  }
  // Of the symmetric 3 × 3 matrix: the first entry of the inverse is the variance of E.
  const double minor = m[1][1] * m[2][2] - m[1][2] * m[1][2];
  for (std::size_t pivot = 2; pivot > 0; --pivot) {
    for (std::size_t r = 0; r < pivot; ++r) {
      const double factor = m[r][pivot] / m[pivot][pivot];
      for (std::size_t c = 0; c < 4; ++c)
        m[r][c] -= factor * m[pivot][c];
    }
  }
  if (!(m[0][0] > 0) || !(minor > 0)) return std::nullopt;
  const double e = m[0][3] / m[0][0];
  const double a = (m[1][3] - m[1][0] * e) / m[1][1];
  const double b = (m[2][3] - m[2][0] * e - m[2][1] * a) / m[2][2];
  double chi2 = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto x = basis(i);
    chi2 += weight(i) * Square(density(i) - (e + a * x[1] + b * x[2]));
  }
  return std::pair{
      Limit{e, 1 / std::sqrt(m[0][0]), a / Square(reach), b / Square(Square(reach)), reach}, chi2};
}

// The widest fit that chi-square does not refuse (about 1 % of true ones). Photons of a
// low-discrepancy sequence scatter less than independent ones, from which the weights are; how much
// less is seen in the rings, and not believed below a quarter of the variance.
std::optional<Limit> FitLimit(const Hitpoint& point, double photons) {
  constexpr std::size_t kFewestRings = 6;
  for (std::size_t count = point.rings.size(); count >= kFewestRings; --count) {
    const auto fit = FitRings(point, count, photons);
    if (!fit) continue;
    const double freedom = static_cast<double>(count) - 3;
    if (!(fit->second < freedom + 2.5 * std::sqrt(2 * freedom))) continue;
    Limit limit = fit->first;
    limit.standard_error *= std::sqrt(std::clamp(fit->second / freedom, 0.25, 1.0));
    return limit;
  }
  return std::nullopt;
}

struct Verdict {
  double irradiance = 0;
  double uncertainty = 0;  // relative
  double bias = 0;         // at the predicted radius
  double true_radius = 0;
  bool is_whole_disc = false;  // the tolerance holds for the initial radius
};

class Check {
 public:
  explicit Check(const Options& options)
      : options_(options),
        scene_(InWorkingSpace(LoadScene(options.scene))),
        kernel_{options.kernel},
        moments_(MomentsOf(options.kernel)),
        closed_form_(ClosedFormOf(options.scene)),
        team_(0) {
    RenderOverrides overrides;
    overrides.photons_per_pass = static_cast<std::int64_t>(kPhotonsPerPass);
    overrides.initial_radius = options.initial_radius;
    overrides.radius_controller = RadiusControllerKind::kFrequencyMse;
    overrides.kernel = options.kernel;
    overrides.bias = options.bias;
    overrides.frequency_share = 1;
    settings_ = SettingsFor(scene_, overrides);
    // With normals, which choose the photons here.
    settings_.use_everything = true;
    needs_ = NeedsOf(scene_, settings_);
    intersector_ = Intersector::Create(scene_, needs_.rays()).value();
    lights_ = std::make_unique<LightSet>(scene_, *intersector_, needs_.lights());
    spectra_ = SpectrumTracer::Create(scene_, settings_, needs_, *intersector_, *lights_).value();
  }

  void Run() {
    ChooseAndPredict();
    MeasureTruth();
    Report();
  }

 private:
  // The deposits of one pass within `region`.
  PhotonGrid TracePass(std::uint64_t pass, const Bounds& region, const SpectrumTracer* spectra) {
    const PhotonPathTracer tracer(scene_, *intersector_, *lights_, settings_, needs_, spectra,
                                  region);
    const std::size_t chunks = kPhotonsPerPass / kPhotonsPerChunk;
    std::vector<Deposits> deposits(chunks);
    team_.For(chunks, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t chunk = begin; chunk < end; ++chunk) {
        PhotonPathTracer::Landed landed;
        for (std::uint64_t i = 0; i < kPhotonsPerChunk; ++i)
          tracer.Trace(pass, chunk * kPhotonsPerChunk + i, landed);
        deposits[chunk] = std::move(landed.deposits);
      }
    });
    return {deposits, region, static_cast<float>(options_.initial_radius / 2), team_};
  }

  // Calls visit(photon, squared distance) for the photons on the hitpoint's own surface.
  template <typename Visitor>
  static void ForEachNear(const PhotonGrid& grid, Vec3 position, Vec3 normal, double radius,
                          const Visitor& visit) {
    grid.ForEachWithin(position, static_cast<float>(radius), [&](std::size_t i, float squared) {
      if (Dot(grid.record<true>(i).normal, normal) < 0.7F) return;
      visit(i, static_cast<double>(squared));
    });
  }

  // One near photon with a spectrum.
  struct Sample {
    double squared_distance, weight, trace;
  };

  // The radius where prediction and disc agree, as the controllers approach it.
  [[nodiscard]] std::optional<double> Converge(const std::vector<Sample>& samples) const {
    const RadiusRange range = {0.01 * options_.initial_radius, options_.initial_radius};
    double radius = options_.initial_radius;
    for (;;) {
      FrequencySums sums;
      for (const Sample& s : samples) {
        if (s.squared_distance >= radius * radius) continue;
        const double trace =
            std::min(s.trace, static_cast<double>(kLargestTrace) / (radius * radius));
        sums = sums + FrequencySums{s.weight, s.weight * s.weight, s.weight * trace,
                                    s.weight * trace * trace, 1};
      }
      const auto predicted = PredictTrace(sums, range, options_.bias, kernel_.Moments());
      if (!predicted) return std::nullopt;
      const double smallest = RadiusFor(options_.bias, predicted->trace, kernel_.Moments());
      if (smallest >= radius * (1 - 1e-6)) return radius;
      radius = std::max(smallest, 0.7 * radius);
    }
  }

  void ChooseAndPredict() {
    const Scene file = LoadScene(options_.scene);
    EyePass eye = JobEstimator::Create(file, settings_, NeedsOf(file, settings_), 0)
                      .value()
                      ->TraceEyePaths(0)
                      .value();
    const std::size_t rows = eye.block.size();
    const auto reach = static_cast<float>(options_.initial_radius);
    Bounds region;
    for (const Vec3 p : eye.block.positions) {
      region.Add(p - Vec3{reach, reach, reach});
      region.Add(p + Vec3{reach, reach, reach});
    }
    std::vector<PhotonGrid> grids;
    const std::uint64_t passes =
        std::max<std::uint64_t>(1, options_.frequency_photons / kPhotonsPerPass);
    for (std::uint64_t pass = 0; pass < passes; ++pass)
      grids.push_back(TracePass(pass, region, spectra_.get()));
    first_pass_ = passes;

    // Rough irradiance everywhere, to know where there is light.
    std::vector<double> light(rows);
    const double rough = options_.initial_radius / 4;
    team_.For(rows, 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row) {
        ForEachNear(grids[0], eye.block.positions[row],
                    DecodeOctahedral(eye.block.normals_oct[row]), rough,
                    [&](std::size_t i, double) {
                      light[row] += static_cast<double>(Luminance(grids[0].record<true>(i).flux));
                    });
      }
    });
    double mean = 0;
    for (const double x : light)
      mean += x / static_cast<double>(rows);
    std::vector<std::int64_t> row_of(static_cast<std::size_t>(settings_.width * settings_.height),
                                     -1);
    for (std::size_t row = 0; row < rows; ++row)
      row_of[eye.pixels[row]] = static_cast<std::int64_t>(row);
    // Pixels along a sequence that covers the image evenly (the plastic number's).
    for (std::uint64_t n = 1; n < 100 * options_.hitpoints && points_.size() < options_.hitpoints;
         ++n) {
      const double u = std::fmod(0.7548776662466927 * static_cast<double>(n), 1.0);
      const double v = std::fmod(0.5698402909980532 * static_cast<double>(n), 1.0);
      const auto pixel = static_cast<std::size_t>(v * settings_.height) *
                             static_cast<std::size_t>(settings_.width) +
                         static_cast<std::size_t>(u * settings_.width);
      if (row_of[pixel] < 0) continue;
      const auto row = static_cast<std::size_t>(row_of[pixel]);
      row_of[pixel] = -1;
      if (light[row] < options_.least_light * mean) continue;
      points_.push_back({eye.block.positions[row],
                         DecodeOctahedral(eye.block.normals_oct[row]),
                         std::nullopt,
                         {},
                         {}});
    }
    team_.For(points_.size(), 4, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        std::vector<Sample> samples;
        for (const PhotonGrid& grid : grids) {
          ForEachNear(
              grid, points_[i].position, points_[i].normal, options_.initial_radius,
              [&](std::size_t photon, double squared) {
                const auto trace = static_cast<double>(grid.trace(photon));
                if (!(trace >= 0)) return;
                samples.push_back({squared,
                                   static_cast<double>(Luminance(grid.record<true>(photon).flux)),
                                   trace});
              });
        }
        points_[i].predicted = Converge(samples);
      }
    });
  }

  void MeasureTruth() {
    Bounds region;
    const auto reach = static_cast<float>(options_.initial_radius);
    for (Hitpoint& point : points_) {
      region.Add(point.position - Vec3{reach, reach, reach});
      region.Add(point.position + Vec3{reach, reach, reach});
      for (int k = 0; k < kLadderLength; ++k)
        point.edges.push_back(options_.initial_radius * std::pow(kLadderStep, k));
      if (point.predicted && *point.predicted < options_.initial_radius) {
        point.edges.push_back(*point.predicted);
      }
      std::sort(point.edges.begin(), point.edges.end());
      point.rings.resize(point.edges.size());
    }
    const std::uint64_t passes = (options_.photons + kPhotonsPerPass - 1) / kPhotonsPerPass;
    for (std::uint64_t pass = first_pass_; pass < first_pass_ + passes; ++pass) {
      const PhotonGrid grid = TracePass(pass, region, nullptr);
      team_.For(points_.size(), 4, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) {
          Hitpoint& point = points_[i];
          ForEachNear(grid, point.position, point.normal, options_.initial_radius,
                      [&](std::size_t photon, double squared) {
                        const double distance = std::sqrt(squared);
                        const auto edge =
                            std::upper_bound(point.edges.begin(), point.edges.end(), distance);
                        if (edge == point.edges.end()) return;
                        point.rings[static_cast<std::size_t>(edge - point.edges.begin())].Add(
                            static_cast<double>(Luminance(grid.record<true>(photon).flux)),
                            squared);
                      });
        }
      });
    }
    photons_ = static_cast<double>(passes * kPhotonsPerPass);
  }

  // The estimate with a radius that is the edge of the last of `sum`'s rings.
  [[nodiscard]] double Estimate(const Ring& sum, double radius) const {
    const double squared = radius * radius;
    double shaped = sum.flux;
    if (options_.kernel == KernelKind::kEpanechnikov) shaped -= sum.distance2 / squared;
    if (options_.kernel == KernelKind::kBiweight) {
      shaped += -2 * sum.distance2 / squared + sum.distance4 / Square(squared);
    }
    return kernel_.Norm() * shaped / (squared * photons_);
  }

  // What the rings would hold if the photons fell as the closed form has it, without any noise; up
  // to where the discs leave the floor.
  [[nodiscard]] std::vector<Ring> ExpectedRings(const Hitpoint& point) const {
    constexpr int kRadii = 6;
    constexpr int kAngles = 96;
    std::vector<Ring> rings;
    double low = 0;
    for (const double high : point.edges) {
      Ring ring;
      const double step = (Square(high) - Square(low)) / kRadii;
      for (int i = 0; i < kRadii; ++i) {
        // Equal areas, each at its middle: 1e-4 of the ring's part in the bias is lost.
        const double squared = Square(low) + step * (i + 0.5);
        double sum = 0;
        for (int k = 0; k < kAngles; ++k) {
          const double angle = 2 * std::numbers::pi * (k + 0.5 * (i % 2)) / kAngles;
          const Vec3 offset = {static_cast<float>(std::sqrt(squared) * std::cos(angle)),
                               static_cast<float>(std::sqrt(squared) * std::sin(angle)), 0};
          const double irradiance = closed_form_(point.position + offset);
          if (irradiance < 0) return rings;
          sum += irradiance;
        }
        ring.Add(sum / kAngles * std::numbers::pi * step * photons_, squared);
      }
      rings.push_back(ring);
      low = high;
    }
    return rings;
  }

  // Bias within the limit's reach is that of the fit, beyond it what `rings` hold.
  [[nodiscard]] Verdict Judge(const Hitpoint& point, const Limit& limit,
                              const std::vector<Ring>& rings) const {
    Verdict verdict;
    verdict.irradiance = limit.irradiance;
    verdict.uncertainty = limit.standard_error / limit.irradiance;
    const auto fitted = [&](double r) {
      return (limit.a * moments_.second * r * r + limit.b * moments_.fourth * Square(r * r)) /
             limit.irradiance;
    };
    Ring sum;
    double last_radius = 0;
    double last_bias = 0;
    bool is_past = false;
    for (std::size_t i = 0; i < rings.size(); ++i) {
      sum += rings[i];
      const double radius = point.edges[i];
      const double bias =
          radius <= limit.reach ? fitted(radius) : Estimate(sum, radius) / limit.irradiance - 1;
      if (radius == *point.predicted) verdict.bias = std::abs(bias);
      if (!is_past && std::abs(bias) > options_.bias) {
        is_past = true;
        const double rise = std::abs(bias) - std::abs(last_bias);
        // Bias grows with the square of the radius.
        const double share = rise > 0 ? (options_.bias - std::abs(last_bias)) / rise : 1;
        verdict.true_radius =
            std::sqrt(Square(last_radius) + share * (Square(radius) - Square(last_radius)));
      }
      last_radius = radius;
      last_bias = bias;
    }
    if (!is_past) {
      verdict.true_radius = last_radius;
      verdict.is_whole_disc = true;
    }
    return verdict;
  }

  void Report() const {
    std::FILE* file = nullptr;
    if (!options_.points_path.empty()) {
      file = std::fopen(options_.points_path.c_str(), "w");
      if (file == nullptr) Die("cannot write " + options_.points_path);
      std::fprintf(file, "x,y,z,irradiance,uncertainty,fit_reach,predicted,true,bias\n");
    }
    std::vector<Limit> limits;
    std::vector<std::pair<const Hitpoint*, std::vector<Ring>>> judged;
    std::size_t uncertain = 0;
    std::size_t unpredicted = 0;
    std::vector<double> to_closed_form;
    for (const Hitpoint& point : points_) {
      if (!point.predicted) {
        ++unpredicted;
        continue;
      }
      const auto limit = FitLimit(point, photons_);
      const bool is_certain =
          limit && limit->standard_error < kLeastCertainty * options_.bias * limit->irradiance;
      if (closed_form_) {
        const double irradiance = closed_form_(point.position);
        std::vector<Ring> rings = ExpectedRings(point);
        // Without light, or with the predicted disc beyond the floor, there is nothing to say.
        if (!(irradiance > 0) || rings.empty() ||
            point.edges[rings.size() - 1] < *point.predicted) {
          ++uncertain;
          continue;
        }
        if (is_certain) to_closed_form.push_back(limit->irradiance / irradiance);
        limits.push_back({.irradiance = irradiance});
        judged.emplace_back(&point, std::move(rings));
      } else if (is_certain) {
        limits.push_back(*limit);
        judged.emplace_back(&point, point.rings);
      } else {
        ++uncertain;
      }
    }
    // The closed forms leave out constant factors of their scenes.
    const double scale = to_closed_form.empty() ? 0 : Quantile(to_closed_form, 0.5);
    double furthest = 0;  // 95 % of the fits are as near
    if (scale > 0) {
      std::vector<double> off;
      for (const double ratio : to_closed_form)
        off.push_back(std::abs(ratio / scale - 1));
      furthest = Quantile(off, 0.95);
    }
    std::vector<double> ratios;
    std::vector<double> biases;
    double kept = 0;
    double whole = 0;
    double weighted_bias = 0;
    double weight = 0;
    for (std::size_t i = 0; i < judged.size(); ++i) {
      const auto& [hitpoint, rings] = judged[i];
      const Hitpoint& point = *hitpoint;
      const Verdict verdict = Judge(point, limits[i], rings);
      const double irradiance = verdict.irradiance;
      kept += verdict.bias <= kWithin * options_.bias ? 1 : 0;
      whole += verdict.is_whole_disc ? 1 : 0;
      weighted_bias += irradiance * verdict.bias;
      weight += irradiance;
      ratios.push_back(*point.predicted / verdict.true_radius);
      biases.push_back(verdict.bias);
      if (file != nullptr) {
        std::fprintf(file, "%.5f,%.5f,%.5f,%.6g,%.5f,%.5f,%.6f,%.6f,%.6f\n",
                     static_cast<double>(point.position.x), static_cast<double>(point.position.y),
                     static_cast<double>(point.position.z), irradiance, verdict.uncertainty,
                     limits[i].reach, *point.predicted, verdict.true_radius, verdict.bias);
      }
    }
    if (file != nullptr) std::fclose(file);
    const auto count = static_cast<double>(ratios.size());
    if (ratios.empty()) Die("no hitpoint has a truth that is certain enough: more photons");
    const std::array quantiles = {Quantile(ratios, 0.25), Quantile(ratios, 0.5),
                                  Quantile(ratios, 0.75)};
    if (options_.as_json) {
      std::printf(
          "{\"scene\": \"%s\", \"bias\": %g, \"kernel\": \"%s\", \"initial_radius\": %g, "
          "\"photons\": %.0f, \"hitpoints\": %zu, \"uncertain\": %zu, \"unpredicted\": %zu, "
          "\"within\": %.4f, \"mean_bias\": %.5f, \"bias_95\": %.5f, \"ratio_25\": %.4f, "
          "\"ratio_50\": %.4f, \"ratio_75\": %.4f, \"whole_disc\": %.4f, "
          "\"fit_off_closed_form_95\": %.5f}\n",
          options_.scene.c_str(), options_.bias, std::string(NameOf(options_.kernel)).c_str(),
          options_.initial_radius, photons_, ratios.size(), uncertain, unpredicted, kept / count,
          weighted_bias / weight, Quantile(biases, 0.95), quantiles[0], quantiles[1], quantiles[2],
          whole / count, furthest);
      return;
    }
    // scene | tolerance | within | mean bias | 95 % | ratio, quartiles | hitpoints (left out) |
    // whole disc | fit against closed form
    std::printf(
        "| %s | %g %% | %.2f | %.4f | %.3f | %.2f (%.2f-%.2f) | %zu (%zu) | %.0f %% | %s |\n",
        options_.scene.substr(0, options_.scene.rfind('.')).c_str(), 100 * options_.bias,
        kept / count, weighted_bias / weight, Quantile(biases, 0.95), quantiles[1], quantiles[0],
        quantiles[2], ratios.size(), uncertain + unpredicted, 100 * whole / count,
        closed_form_ ? Concat(std::round(1e4 * furthest) / 100, " %").c_str() : "-");
  }

  static double Quantile(std::vector<double> values, double share) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(
                                         share * static_cast<double>(values.size() - 1) + 0.5);
    std::nth_element(values.begin(), at, values.end());
    return *at;
  }

  Options options_;
  Scene scene_;
  Kernel kernel_;
  RadialMoments moments_;
  ClosedForm closed_form_;
  ThreadTeam team_;
  RenderSettings settings_;
  SceneNeeds needs_;
  std::unique_ptr<Intersector> intersector_;
  std::unique_ptr<LightSet> lights_;
  std::unique_ptr<SpectrumTracer> spectra_;
  std::vector<Hitpoint> points_;
  std::uint64_t first_pass_ = 0;
  double photons_ = 0;
};

double NumberOf(const std::string& flag, std::string text) {
  double scale = 1;
  if (text.ends_with('%')) {
    scale = 0.01;
    text.pop_back();
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value > 0)) {
    Die(flag + " needs a number above 0");
  }
  return value * scale;
}

Options OptionsOf(int argc, char** argv) {
  Options options;
  for (int i = 1; i < argc; ++i) {
    const std::string flag = argv[i];
    if (flag == "--json") {
      options.as_json = true;
      continue;
    }
    if (!flag.starts_with("--")) {
      options.scene = flag;
      continue;
    }
    if (i + 1 == argc) Die(flag + " needs a value");
    const std::string value = argv[++i];
    if (flag == "--initial-radius") {
      options.initial_radius = NumberOf(flag, value);
    } else if (flag == "--bias") {
      options.bias = NumberOf(flag, value);
    } else if (flag == "--kernel") {
      const auto kernel = ParseKernel(value);
      if (!kernel.ok()) Die(std::string(kernel.status().message()));
      options.kernel = *kernel;
    } else if (flag == "--photons") {
      options.photons = static_cast<std::uint64_t>(NumberOf(flag, value));
    } else if (flag == "--frequency-photons") {
      options.frequency_photons = static_cast<std::uint64_t>(NumberOf(flag, value));
    } else if (flag == "--hitpoints") {
      options.hitpoints = static_cast<std::size_t>(NumberOf(flag, value));
    } else if (flag == "--least-light") {
      options.least_light = NumberOf(flag, value);
    } else if (flag == "--points") {
      options.points_path = value;
    } else {
      Die(flag + " is not a flag of this program");
    }
  }
  if (options.scene.empty() || !(options.initial_radius > 0)) {
    Die("needs a scene of tests/scenes and --initial-radius");
  }
  return options;
}

}  // namespace
}  // namespace lucerna

int main(int argc, char** argv) {
  lucerna::Check(lucerna::OptionsOf(argc, argv)).Run();
  return 0;
}
