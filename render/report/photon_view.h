// How does the way of one photon read?
//
// Pure: a path in, text out. Numbers have all their digits, so that two paths can be compared.
#pragma once

#include <cstdint>
#include <string>

#include "proto/lucerna/v1/jobs.pb.h"
#include "proto/lucerna/v1/photons.pb.h"

namespace lucerna {

// Lines with their ends: where it came from, every landing, and why it ended.
[[nodiscard]] std::string PhotonPathText(const v1::PhotonPath& path);

// "was lost at the roulette": what follows "the photon".
[[nodiscard]] std::string EndInWords(v1::PhotonEnd end);
[[nodiscard]] std::string FateInWords(v1::DepositFate fate);

// The imbalance of the energy counters, in their smallest unit: 0 but for a fault of ours, or after
// some 10^15 photons.
[[nodiscard]] std::int64_t EnergyImbalance(const v1::Energy& energy);
// "62.1 % absorbed, 20.3 % escaped, ...": shares of what was emitted; empty when nothing was.
[[nodiscard]] std::string EnergyInWords(const v1::Energy& energy);

// One line without its end about photons and contributions that were left out because they were not
// finite, and how to replay the first; empty when there are none.
[[nodiscard]] std::string DroppedLine(const v1::Job& job);

}  // namespace lucerna
