#include "render/film/reference.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "render/estimate/error_estimate.h"
#include "render/estimate/relative_error.h"
#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr char kRelMse[] = "lucerna.reference.rel_mse";
constexpr char kSeed[] = "lucerna.seed";

std::string TextOf(const Image& image, const std::string& key) {
  const auto found = image.metadata.find(key);
  return found == image.metadata.end() ? std::string() : found->second;
}

// Of an image whose channels are R, G, B.
std::vector<double> LuminancesOf(const Image& image) {
  std::vector<double> luminances(image.channels[0].pixels.size());
  for (std::size_t i = 0; i < luminances.size(); ++i) {
    const auto value = [&](std::size_t c) {
      return static_cast<double>(image.channels[c].pixels[i]);
    };
    luminances[i] = LuminanceOf({value(0), value(1), value(2)});
  }
  return luminances;
}

}  // namespace

std::array<std::uint64_t, 2> SeedsOfHalves(std::uint64_t seed) {
  constexpr std::uint64_t kKey = 0x5245464552454E43ULL;
  const std::uint64_t both = CombineKeys(kKey, seed);
  return {CombineKeys(both, 0), CombineKeys(both, 1)};
}

StatusOr<Image> MakeReference(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height) {
    return absl::InvalidArgumentError("the halves of the reference differ in size");
  }
  if (TextOf(a, "lucerna.scene_digest") != TextOf(b, "lucerna.scene_digest")) {
    return absl::InvalidArgumentError("the halves of the reference are of different scenes");
  }
  if (a.metadata.contains(kSeed) && TextOf(a, kSeed) == TextOf(b, kSeed)) {
    return absl::InvalidArgumentError(
        "the halves of the reference have the same seed, so their difference is no noise");
  }
  Image reference;
  reference.width = a.width;
  reference.height = a.height;
  constexpr std::array<const char*, 3> kColour = {"R", "G", "B"};
  std::vector<ImageChannel> noise;
  double absolute = 0;
  double samples = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const ImageChannel* first = a.Find(kColour[c]);
    const ImageChannel* second = b.Find(kColour[c]);
    if (first == nullptr || second == nullptr) {
      return absl::InvalidArgumentError(
          absl::StrCat("a half of the reference has no channel ", kColour[c]));
    }
    ImageChannel mean = {kColour[c], std::vector<float>(first->pixels.size())};
    ImageChannel deviation = {kNoiseLayer[c], std::vector<float>(first->pixels.size())};
    for (std::size_t i = 0; i < mean.pixels.size(); ++i) {
      const auto va = static_cast<double>(first->pixels[i]);
      const auto vb = static_cast<double>(second->pixels[i]);
      if (!std::isfinite(va) || !std::isfinite(vb)) {
        return absl::InvalidArgumentError(
            absl::StrCat("a half of the reference is not finite in pixel ", i));
      }
      const double value = (va + vb) / 2;
      const double error = std::abs(va - vb) / 2;
      mean.pixels[i] = static_cast<float>(value);
      deviation.pixels[i] = static_cast<float>(error);
      absolute += error * error;
    }
    samples += static_cast<double>(mean.pixels.size());
    reference.channels.push_back(std::move(mean));
    noise.push_back(std::move(deviation));
  }
  const double floor = RelativeErrorFloor(LuminancesOf(reference));
  std::vector<double> relative(reference.channels[0].pixels.size());
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < relative.size(); ++i) {
      const auto value = static_cast<double>(reference.channels[c].pixels[i]);
      const auto error = static_cast<double>(noise[c].pixels[i]);
      relative[i] += RelativeSquare(error * error, value, floor);
    }
  }
  std::ranges::move(noise, std::back_inserter(reference.channels));

  for (const char* key : {"lucerna.scene_digest", "lucerna.settings", "lucerna.numeric_profile"}) {
    if (a.metadata.contains(key)) reference.metadata[key] = TextOf(a, key);
  }
  for (const char* key : {"seed", "passes", "photons"}) {
    const std::string of_half = absl::StrCat("lucerna.", key);
    reference.metadata[absl::StrCat("lucerna.reference.", key, key[0] == 's' ? "s" : "")] =
        absl::StrCat(TextOf(a, of_half), " ", TextOf(b, of_half));
  }
  const double count = std::max(samples, 1.0);
  const auto mean_of = [&](std::size_t pixels) {
    const double sum = std::accumulate(relative.begin(),
                                       relative.begin() + static_cast<std::ptrdiff_t>(pixels), 0.0);
    return absl::StrCat(sum / std::max(3.0 * static_cast<double>(pixels), 1.0));
  };
  std::ranges::sort(relative);
  reference.metadata[kRelMse] = mean_of(relative.size());
  reference.metadata["lucerna.reference.rel_mse_trimmed"] = mean_of(KeptPixels(relative.size()));
  reference.metadata["lucerna.reference.rmse"] = absl::StrCat(std::sqrt(absolute / count));
  return reference;
}

bool TellsItsNoise(const Image& image) {
  return image.metadata.contains(kRelMse) &&
         std::ranges::all_of(kNoiseLayer,
                             [&](const char* name) { return image.Find(name) != nullptr; });
}

}  // namespace lucerna
