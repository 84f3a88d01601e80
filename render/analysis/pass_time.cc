#include "render/analysis/pass_time.h"

#include "render/math/rng.h"
#include "render/math/sobol.h"

namespace lucerna {

double TimeOfPass(const SceneMotion& motion, std::uint64_t seed, std::uint64_t pass) {
  if (!motion.Moves()) return motion.shutter_open;
  constexpr std::uint64_t kTimeKey = 0x5041535354494D45ULL;
  const std::uint64_t key = CombineKeys(CombineKeys(seed, kTimeKey), pass % 2);
  const auto share = static_cast<double>(ShuffledOwenSobol(pass / 2, key)[0]);
  return motion.shutter_open + share * (motion.shutter_close - motion.shutter_open);
}

}  // namespace lucerna
