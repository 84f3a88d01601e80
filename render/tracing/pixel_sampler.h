// Which random numbers does the eye path of a pixel use?
//
// Every pixel has its own low-discrepancy sequences, two sets of them: even passes are the points
// of one, odd passes those of the other, so that after 2n passes a pixel has twice n well-spread
// samples of its filter, of its lights and of its scattering, and two independent halves tell the
// noise.
#pragma once

#include <cstdint>

#include "render/math/rng.h"
#include "render/math/sobol.h"

namespace lucerna {

// The random numbers of a path that is traced for the bright lights that it meets alone.
struct BrightSample {
  SobolPoint camera;  // as PixelSampler::ForCamera
  KeyedRng branches;  // as PixelSampler::ForBranches
  [[nodiscard]] float wavelength() const { return camera[4]; }
};

class PixelSampler {
 public:
  // Vertices beyond this use independent numbers.
  static constexpr int kStratifiedVertices = 4;

  // `eye_set`: which of the sets of eye paths the pass uses (see EyeSetOf); even where it is.
  PixelSampler(std::uint64_t seed, std::uint64_t pixel, std::uint64_t pass, std::uint64_t eye_set)
      : key_(CombineKeys(CombineKeys(CombineKeys(seed, 0x4559455041544853ULL), pixel), pass % 2)),
        pass_(pass / 2),
        eye_set_(eye_set / 2) {}

  // Of path `number` of the `count` that the pixel has in this pass beside its first. All together
  // are sequences of their own, whose points no two passes share while `count` never falls.
  [[nodiscard]] static PixelSampler ForMore(std::uint64_t seed, std::uint64_t pixel,
                                            std::uint64_t pass, int number, int count) {
    constexpr std::uint64_t kMoreKey = 0x4D4F524550415448ULL;
    const std::uint64_t place =
        pass / 2 * static_cast<std::uint64_t>(count) + static_cast<std::uint64_t>(number);
    const std::uint64_t of_half = 2 * place + pass % 2;
    return {CombineKeys(seed, kMoreKey), pixel, of_half, of_half};
  }

  // Film position (0, 1) and lens position (2, 3).
  [[nodiscard]] SobolPoint ForCamera() const { return OwenSobol(PlaceInOrder(), key_); }

  // Of path `number` of `count` in this pass. Stratified over all passes: no two of them share a
  // place on the film, as sets of eye paths do.
  [[nodiscard]] BrightSample ForBright(int number, int count) const {
    constexpr std::uint64_t kBrightKey = 0x4252494748545321ULL;
    const std::uint64_t key = CombineKeys(key_, kBrightKey);
    const std::uint64_t index =
        pass_ * static_cast<std::uint64_t>(count) + static_cast<std::uint64_t>(number);
    return {OwenSobol(index, key), KeyedRng(CombineKeys(~key, index))};
  }

  // For the path's vertex number `vertex`: scattering (0 lobe, 1, 2), light (3 choice, 4, 5),
  // roulette (6), the finer part of the light's choice (7).
  [[nodiscard]] SobolPoint ForVertex(int vertex) const {
    const std::uint64_t key = CombineKeys(key_, static_cast<std::uint64_t>(vertex) + 1);
    if (vertex < kStratifiedVertices) return ShuffledOwenSobol(pass_, key);
    KeyedRng rng(CombineKeys(key, pass_));
    SobolPoint point;
    for (float& u : point)
      u = rng.Uniform();
    return point;
  }

  // As ForVertex, where a branch of the tree of smooth surfaces ends that begins at `vertex`.
  [[nodiscard]] SobolPoint ForBranchEnd(int vertex, std::uint64_t branch) const {
    const std::uint64_t key = CombineKeys(
        CombineKeys(key_ ^ 0x4252414E43484553ULL, static_cast<std::uint64_t>(vertex)), branch);
    return ShuffledOwenSobol(pass_, key);
  }

  // Where light leaves that goes below a surface at `vertex`: axis and channel (0), radius (1),
  // turn (2), choice of one of several points (3).
  [[nodiscard]] SobolPoint ForBelow(int vertex) const {
    return ShuffledOwenSobol(
        pass_, CombineKeys(key_ ^ 0x42454C4F57535552ULL, static_cast<std::uint64_t>(vertex)));
  }

  // For the path's wavelength, in [0, 1).
  [[nodiscard]] float ForWavelength() const {
    return ShuffledOwenSobol(pass_, CombineKeys(key_, 0x574156454C454E47ULL))[0];
  }

  // Independent numbers for the tree of specular branches.
  [[nodiscard]] KeyedRng ForBranches() const { return KeyedRng(CombineKeys(~key_, pass_)); }
  // Independent numbers for the choice of the hitpoint for caustic photons.
  [[nodiscard]] KeyedRng ForCaustics() const {
    return KeyedRng(CombineKeys(key_ ^ 0x4341555354494353ULL, pass_));
  }

  // Independent numbers for the choice of the segment in media.
  [[nodiscard]] KeyedRng ForSegments() const {
    return KeyedRng(CombineKeys(key_ ^ 0x5345474D454E5453ULL, pass_));
  }

 private:
  // Which point of the camera's sequence is this pass's. The photons of passes are parts of a
  // Sobol' sequence in their order, and the points of every 8th part are alike in three digits.
  // With places on the film in the same order, an eighth of a pixel would meet those parts of the
  // light alone, however many passes come. So an octal digit of the place is turned by chance for
  // all places that have the same higher digits, which are a stratified set as they were.
  [[nodiscard]] constexpr std::uint64_t PlaceInOrder() const {
    std::uint64_t place = eye_set_;
    std::uint64_t higher = eye_set_ >> 3;
    for (unsigned int shift = 0; higher != 0; shift += 3, higher >>= 3)
      place ^= (CombineKeys(key_ + shift, higher) & 7U) << shift;
    return place;
  }

  std::uint64_t key_;
  std::uint64_t pass_;
  std::uint64_t eye_set_;
};

}  // namespace lucerna
