#include "render/formats/pbrt/settings.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "render/base/text.h"
#include "render/formats/pbrt/kinds.h"
#include "render/formats/pbrt/rgb_space.h"

namespace lucerna {
namespace {

constexpr std::array<std::string_view, 1> kFloatType = {"float"};
constexpr std::array<std::string_view, 1> kBoundsType = {"integer"};

// Four numbers, or none.
std::span<const double> Four(ParameterList& parameters, std::string_view name,
                             std::span<const std::string_view> types) {
  const std::span<const double> numbers = parameters.Numbers(name, types, 1);
  if (numbers.empty() || numbers.size() == 4) return numbers;
  parameters.Error(name, "must have 4 values: x0 x1 y0 y1");
  return {};
}

// What cameras with a window have in common.
void ReadWindow(ParameterList& parameters, Camera& camera) {
  camera.lens_radius = parameters.Float("lensradius", 0, kZeroOrMore);
  camera.focal_distance = parameters.Float("focaldistance", 1e6, kAboveZero);
  camera.frame_aspect_ratio = parameters.FindFloat("frameaspectratio", {1e-4, 1e4});
  const std::span<const double> window = Four(parameters, "screenwindow", kFloatType);
  if (!window.empty()) {
    if (window[0] < window[1] && window[2] < window[3]) {
      camera.screen_window = Window{window[0], window[1], window[2], window[3]};
    } else {
      parameters.Error("screenwindow", "must have x0 < x1 and y0 < y1");
    }
  }
}

void ReadPerspective(ParameterList& parameters, Camera& camera) {
  camera.fov_deg = parameters.Float("fov", camera.fov_deg, {0.001, 179.999});
  ReadWindow(parameters, camera);
}

void ReadOrthographic(ParameterList& parameters, Camera& camera) {
  camera.kind = Camera::Kind::kOrthographic;
  ReadWindow(parameters, camera);
}

void ReadSpherical(ParameterList& parameters, Camera& camera) {
  const std::string mapping = parameters.String("mapping", "equalarea");
  if (mapping != "equalarea" && mapping != "equirectangular") {
    parameters.Error("mapping",
                     Concat("must be equalarea or equirectangular, not ", Quoted(mapping)));
  }
  camera.kind = mapping == "equalarea" ? Camera::Kind::kEqualArea : Camera::Kind::kEquirectangular;
  for (const std::string_view name :
       {"lensradius", "focaldistance", "frameaspectratio", "screenwindow"})
    parameters.Ignore(name);
}

void ReadShutter(ParameterList& parameters, SceneMotion& motion) {
  motion.shutter_open = parameters.Float("shutteropen", 0);
  motion.shutter_close = parameters.Float("shutterclose", 1);
  if (motion.shutter_close > motion.shutter_open) return;
  parameters.Error("shutterclose", "must be after shutteropen");
}

using CameraReader = void (*)(ParameterList&, Camera&);
constexpr Kind<CameraReader> kCameras[] = {
    {"perspective", &ReadPerspective},
    {"orthographic", &ReadOrthographic},
    {"spherical", &ReadSpherical},
};

// The readers of filters set all but the radii, and return the radius that is the default.
double ReadBox(ParameterList& /*parameters*/, PixelFilter& filter) {
  filter.kind = PixelFilter::Kind::kBox;
  return 0.5;
}

double ReadTriangle(ParameterList& /*parameters*/, PixelFilter& filter) {
  filter.kind = PixelFilter::Kind::kTriangle;
  return 2;
}

double ReadGaussian(ParameterList& parameters, PixelFilter& filter) {
  filter.kind = PixelFilter::Kind::kGaussian;
  filter.sigma = static_cast<float>(parameters.Float("sigma", 0.5, {1e-3, 1e3}));
  return 1.5;
}

double ReadMitchell(ParameterList& parameters, PixelFilter& filter) {
  filter.kind = PixelFilter::Kind::kMitchell;
  constexpr Range kShape = {-10, 10};
  filter.b = static_cast<float>(parameters.Float("B", 1.0 / 3, kShape));
  filter.c = static_cast<float>(parameters.Float("C", 1.0 / 3, kShape));
  return 2;
}

double ReadSinc(ParameterList& parameters, PixelFilter& filter) {
  filter.kind = PixelFilter::Kind::kSinc;
  // Of much narrower windows the integral is near 0, or below: all would be divided by it.
  filter.window = static_cast<float>(parameters.Float("tau", 3, {0.25, 1e3}));
  return 4;
}

using FilterReader = double (*)(ParameterList&, PixelFilter&);
constexpr Kind<FilterReader> kFilters[] = {
    {"box", &ReadBox},           {"triangle", &ReadTriangle}, {"gaussian", &ReadGaussian},
    {"mitchell", &ReadMitchell}, {"sinc", &ReadSinc},
};

// Of an integrator of pbrt-v4, where 0 is the light of lights alone, and below there is no end.
int DepthOf(std::int64_t max_depth, ParameterList& parameters) {
  constexpr int kEndless = 1000;
  constexpr int kMost = 10'000;
  if (max_depth > kMost) {
    parameters.Warning("maxdepth", Concat("is ", max_depth, " and is held at ", kMost));
    return kMost;
  }
  if (max_depth > 0) return static_cast<int>(max_depth);
  if (max_depth == 0) {
    parameters.Warning("maxdepth", "is 0 and is held at 1: surfaces show the light of lights");
    return 1;
  }
  parameters.Warning("maxdepth",
                     Concat("is ", max_depth, ", which has no end, and is held at ", kEndless));
  return kEndless;
}

}  // namespace

void ReadCamera(std::string_view type, ParameterList& parameters, Camera& camera,
                SceneMotion& motion) {
  if (type == "realistic") {
    parameters.Error(
        "is not supported: no rays are traced through lenses of a camera; use a "
        "perspective camera with lensradius and focaldistance");
    return;
  }
  const CameraReader read = FindReader<CameraReader>(kCameras, type);
  if (read == nullptr) {
    parameters.Error(Concat("is not supported; ", SupportedKinds<CameraReader>(kCameras)));
    return;
  }
  read(parameters, camera);
  ReadShutter(parameters, motion);
  parameters.WarnOfUnread();
}

void ReadFilm(std::string_view type, ParameterList& parameters, FilmSettings& film) {
  if (type != "rgb") {
    parameters.Warning("", "is read as \"rgb\"");
  }
  constexpr Range kSide = {1, 65536};
  film.width = static_cast<int>(parameters.FindInteger("xresolution", kSide).value_or(1280));
  film.height = static_cast<int>(parameters.FindInteger("yresolution", kSide).value_or(720));
  film.crop_x0 = film.crop_y0 = 0;
  film.crop_x1 = film.width;
  film.crop_y1 = film.height;

  const std::span<const double> crop = Four(parameters, "cropwindow", kFloatType);
  const std::span<const double> pixels = Four(parameters, "pixelbounds", kBoundsType);
  if (!crop.empty() && !pixels.empty()) {
    parameters.Warning("pixelbounds", "is ignored, as by pbrt-v4, because cropwindow is given");
  }
  std::array<double, 4> bounds = {0, static_cast<double>(film.width), 0,
                                  static_cast<double>(film.height)};
  if (!crop.empty()) {
    const std::array<double, 4> side = {bounds[1], bounds[1], bounds[3], bounds[3]};
    for (std::size_t i = 0; i < 4; ++i) {
      // pbrt-v4's rounding, of single precision: a fraction that is meant to be k pixels is.
      bounds[i] = std::ceil(static_cast<float>(std::clamp(crop[i], 0.0, 1.0)) *
                            static_cast<float>(side[i]));
    }
    // Either end of a pair may come first.
    if (bounds[0] > bounds[1]) std::swap(bounds[0], bounds[1]);
    if (bounds[2] > bounds[3]) std::swap(bounds[2], bounds[3]);
  } else if (!pixels.empty()) {
    for (std::size_t i = 0; i < 4; ++i) {
      bounds[i] = std::clamp(pixels[i], 0.0, static_cast<double>(i < 2 ? film.width : film.height));
    }
  }
  if (bounds[0] < bounds[1] && bounds[2] < bounds[3]) {
    film.crop_x0 = static_cast<int>(bounds[0]);
    film.crop_x1 = static_cast<int>(bounds[1]);
    film.crop_y0 = static_cast<int>(bounds[2]);
    film.crop_y1 = static_cast<int>(bounds[3]);
  } else {
    parameters.Error(crop.empty() ? "pixelbounds" : "cropwindow", "leaves no pixel of the image");
  }

  film.exposure = parameters.Float("iso", 100, kAboveZero) / 100;
  film.max_component = parameters.Float("maxcomponentvalue", HUGE_VAL, kAboveZero);
  film.filename = parameters.String("filename", "");
  // Of a camera's sensor pbrt-v4 makes what the observer sees, balanced to 6500 K.
  if (parameters.String("sensor", "cie1931") != "cie1931") {
    parameters.Warning("sensor", "is read as cie1931: saturated colours are a little different");
  }
  const double white_k = parameters.Float("whitebalance", 0, {0, kMaxWhiteK});
  if (white_k > 0 && white_k < kMinWhiteK) {
    parameters.Error("whitebalance",
                     Concat("must be 0, or from ", kMinWhiteK, " to ", kMaxWhiteK, " [K]"));
  } else if (white_k > 0) {
    film.white_balance = WhiteBalance(white_k);
  }
  for (const std::string_view name : {"diagonal", "savefp16"})
    parameters.Ignore(name);
  if (type == "gbuffer") parameters.Ignore("coordinatesystem");
  if (type == "spectral") {
    for (const std::string_view name : {"nbuckets", "lambdamin", "lambdamax"})
      parameters.Ignore(name);
  }
  parameters.WarnOfUnread();
}

void ReadPixelFilter(std::string_view type, ParameterList& parameters, PixelFilter& filter) {
  const FilterReader read = FindReader<FilterReader>(kFilters, type);
  if (read == nullptr) {
    parameters.Error(Concat("is not supported; ", SupportedKinds<FilterReader>(kFilters)));
    return;
  }
  const double radius = read(parameters, filter);
  // A filter as wide as the image would make every sample touch every pixel.
  constexpr Range kRadius = {0.01, 32};
  filter.radius_x = static_cast<float>(parameters.Float("xradius", radius, kRadius));
  filter.radius_y = static_cast<float>(parameters.Float("yradius", radius, kRadius));
  parameters.WarnOfUnread();
}

void ReadIntegrator(std::string_view type, ParameterList& parameters,
                    IntegratorSettings& integrator) {
  integrator.name = std::string(type);
  const std::optional<std::int64_t> depth =
      parameters.FindInteger("maxdepth", {-2147483648.0, 2147483647.0});
  if (depth.has_value()) integrator.max_depth = DepthOf(*depth, parameters);
  Diagnostics& diagnostics = parameters.diagnostics();
  if (type != "sppm") {
    diagnostics.Note(parameters.location(),
                     Concat(parameters.subject(),
                            " is replaced by progressive photon mapping; of its parameters ",
                            "only maxdepth is kept"));
    return;
  }
  const std::optional<std::int64_t> photons =
      parameters.FindInteger("photonsperiteration", {-1, 2147483647.0});
  if (photons.has_value() && *photons == 0) {
    parameters.Error("photonsperiteration", "must be at least 1, or -1 for the number of pixels");
  } else if (photons.has_value() && *photons > 0) {
    integrator.photons_per_pass = *photons;
  }
  integrator.initial_radius = parameters.FindFloat("radius", kAboveZero);
  if (!integrator.initial_radius.has_value()) {
    diagnostics.Note(
        parameters.location(),
        Concat(parameters.subject(), " gives no radius: each pixel's follows from its footprint"));
  }
  integrator.seed = parameters.FindInteger("seed", {-2147483648.0, 2147483647.0});
  parameters.WarnOfUnread();
}

void ReadSampler(std::string_view type, ParameterList& parameters, IntegratorSettings& integrator) {
  constexpr Range kSamples = {1, 2147483647.0};
  std::optional<std::int64_t> samples;
  if (type == "stratified") {
    const std::int64_t x = parameters.FindInteger("xsamples", {1, 32768}).value_or(4);
    const std::int64_t y = parameters.FindInteger("ysamples", {1, 32768}).value_or(4);
    samples = x * y;
    parameters.Ignore("jitter");
  } else {
    samples = parameters.FindInteger("pixelsamples", kSamples);
    parameters.Ignore("randomization");
  }
  parameters.Ignore("seed");
  if (samples.has_value()) integrator.pixel_samples = static_cast<int>(*samples);
  parameters.diagnostics().Note(
      parameters.location(),
      Concat(parameters.subject(), " only sets the number of passes; the samples are this ",
             "program's own"));
  parameters.WarnOfUnread();
}

}  // namespace lucerna
