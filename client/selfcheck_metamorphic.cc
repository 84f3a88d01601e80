// Does a scene that is told otherwise give the same image?
//
// Two scenes whose images must agree, bit for bit or within noise, need no reference.
#include <array>
#include <bit>
#include <cmath>
#include <string_view>

#include "absl/strings/str_format.h"

#include "client/selfcheck.h"
#include "client/selfcheck_scenes.h"

namespace lucerna {
namespace {

using Object = CheckRoom::Object;
using Light = CheckRoom::Light;
using Controller = RadiusControllerKind;

RenderOverrides Small(Controller controller) {
  RenderOverrides overrides;
  overrides.passes = 6;
  overrides.photons_per_pass = 4096;
  overrides.seed = 7;
  overrides.radius_controller = controller;
  overrides.max_depth = 8;
  return overrides;
}

// By what a channel grows when lengths grow by 2^`length` and light by 2^`light`.
int ExponentOf(std::string_view channel, int length, int light) {
  if (channel == "Z" || channel == "radius" || channel == "min_radius") return length;
  if (channel == "bandwidth") return -length;
  if (channel.starts_with("albedo.") || channel.starts_with("N.")) return 0;
  if (channel == "photon_count" || channel == "relative_bias") return 0;
  return light;
}

// Values of `image` that are not those of `base` times the power of two of their channel.
// `first` gets the first such channel.
std::size_t DifferentBits(const Image& base, const Image& image, int length, int light,
                          std::string& first) {
  std::size_t different = 0;
  for (const ImageChannel& channel : base.channels) {
    const ImageChannel* other = image.Find(channel.name);
    if (other == nullptr || other->pixels.size() != channel.pixels.size()) {
      first = channel.name;
      return different + channel.pixels.size();
    }
    const int exponent = ExponentOf(channel.name, length, light);
    for (std::size_t i = 0; i < channel.pixels.size(); ++i) {
      const float expected = std::ldexp(channel.pixels[i], exponent);
      if (std::bit_cast<std::uint32_t>(expected) == std::bit_cast<std::uint32_t>(other->pixels[i]))
        continue;
      if (first.empty()) first = channel.name;
      ++different;
    }
  }
  return different;
}

// A scene and by which powers of two it is changed.
struct PowerOfTwo {
  CheckRoom room;
  Controller controller = Controller::kAppm;
  int length = 0;
  int light = 0;
};

StatusOr<CaseOutcome> SameBits(SelfcheckBench& bench, const std::vector<PowerOfTwo>& changes) {
  std::size_t different = 0;
  std::string worst;
  for (const PowerOfTwo& change : changes) {
    CheckRoom changed = change.room;
    changed.scale = std::ldexp(1.0, change.length);
    changed.light_scale = std::ldexp(1.0, change.light);
    const RenderOverrides overrides = Small(change.controller);
    LUCERNA_ASSIGN_OR_RETURN(const SelfcheckRender* base,
                             bench.Render(TextOf(change.room), overrides));
    LUCERNA_ASSIGN_OR_RETURN(const SelfcheckRender* image,
                             bench.Render(TextOf(changed), overrides));
    std::string channel;
    const std::size_t of_this =
        DifferentBits(base->image, image->image, change.length, change.light, channel);
    different += of_this;
    if (of_this > 0) {
      absl::StrAppendFormat(&worst, "%s, %s, lengths by 2^%d, light by 2^%d: %d in %s and after; ",
                            NameOf(change.room), std::string(NameOf(change.controller)),
                            change.length, change.light, of_this, channel);
    }
  }
  return AtMost(
      static_cast<double>(different), 0,
      worst.empty() ? absl::StrCat("values that differ in ", changes.size(), " images") : worst);
}

const std::vector<CheckRoom>& Rooms() {
  static const auto& rooms = *new std::vector<CheckRoom>{
      {.object = Object::kBlock, .light = Light::kLamp},
      {.object = Object::kGlassSphere, .light = Light::kDisk},
      {.object = Object::kGlassBlock, .light = Light::kPoint},
      {.object = Object::kMirrorSphere, .light = Light::kSpot, .has_texture = true},
      {.object = Object::kRoughSphere, .light = Light::kSphere},
      {.object = Object::kSmoothMesh, .light = Light::kDistant},
      {.object = Object::kGlassSphere, .light = Light::kSky},
  };
  return rooms;
}

constexpr std::array kControllers = {Controller::kAppm, Controller::kPpm,
                                     Controller::kFrequencyMse};

StatusOr<CaseOutcome> ScalingKeepsBits(SelfcheckBench& bench) {
  std::vector<PowerOfTwo> changes;
  for (const Controller controller : kControllers) {
    for (const CheckRoom& room : Rooms()) {
      for (const int length : {-20, -7, 1, 20})
        changes.push_back({.room = room, .controller = controller, .length = length});
    }
  }
  return SameBits(bench, changes);
}

StatusOr<CaseOutcome> LightScalesExactly(SelfcheckBench& bench) {
  std::vector<PowerOfTwo> changes;
  for (const Controller controller : kControllers) {
    for (const CheckRoom& room : Rooms()) {
      for (const int light : {-60, 17, 60})
        changes.push_back({.room = room, .controller = controller, .light = light});
    }
  }
  return SameBits(bench, changes);
}

}  // namespace

std::vector<SelfcheckCase> MetamorphicCases() {
  return {
      {"scale-bits", "lengths times 2^-20 to 2^20 give the same image", ScalingKeepsBits},
      {"light-bits", "light times 2^-60 to 2^60 gives the image times the same",
       LightScalesExactly},
  };
}

}  // namespace lucerna
