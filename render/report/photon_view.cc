#include "render/report/photon_view.h"

#include <algorithm>
#include <cstdint>

#include "absl/strings/str_format.h"

#include "render/base/text.h"
#include "render/wire/messages.h"

namespace lucerna {
namespace {

std::string Point(const v1::Triple& point) {
  return absl::StrFormat("(%.9g, %.9g, %.9g)", point.x(), point.y(), point.z());
}

std::string Flux(const v1::Triple& flux) {
  return absl::StrFormat("%.9g %.9g %.9g W", flux.x(), flux.y(), flux.z());
}

bool AreEqual(const v1::Triple& a, const v1::Triple& b) {
  return a.x() == b.x() && a.y() == b.y() && a.z() == b.z();
}

std::string Line(std::string_view term, const std::string& value) {
  return absl::StrFormat("  %-10s %s\n", std::string(term), value);
}

std::string ScatteringLines(const v1::PhotonPath::Landing::Scattering& scattering,
                            bool was_played) {
  std::string text =
      Line("scattered", Concat(scattering.chosen(), " towards ", Point(scattering.direction())));
  text += Line("flux", Flux(scattering.flux()));
  if (!was_played) return text;
  if (scattering.survival() >= 1) return text + Line("roulette", "none");
  text += Line("roulette",
               absl::StrFormat("%s, with a probability of %.9g to go on",
                               scattering.survived() ? "went on" : "lost", scattering.survival()));
  if (scattering.survived()) text += Line("flux", Flux(scattering.flux_leaving()));
  return text;
}

std::string LandingLines(const v1::PhotonPath::Landing& landing) {
  std::string text = Line("at", Point(landing.position()));
  text += Line("normal", Point(landing.geometric_normal()));
  if (!AreEqual(landing.geometric_normal(), landing.shading_normal())) {
    text += Line("shading", Point(landing.shading_normal()));
  }
  text += Line("flux", Flux(landing.flux_arriving()));
  if (landing.has_flux_landed()) {
    if (!AreEqual(landing.flux_arriving(), landing.flux_landed())) {
      text += Line("smoothed", Flux(landing.flux_landed()));
    }
    text += Line("deposit", FateInWords(landing.deposit()));
  }
  if (landing.has_scattering()) {
    text += ScatteringLines(landing.scattering(), landing.scattering().survival() > 0);
  }
  return text;
}

}  // namespace

std::string EndInWords(v1::PhotonEnd end) {
  switch (end) {
    case v1::PHOTON_END_NOT_EMITTED:
      return "was not emitted: its random numbers fell where the light sends nothing";
    case v1::PHOTON_END_ESCAPED:
      return "met nothing any more";
    case v1::PHOTON_END_ABSORBED:
      return "was absorbed";
    case v1::PHOTON_END_SMOOTHING:
      return "came or left below the horizon of the smoothed surface";
    case v1::PHOTON_END_ROULETTE:
      return "was lost at the roulette";
    case v1::PHOTON_END_DEPTH:
      return "reached the greatest depth";
    case v1::PHOTON_END_NOT_FINITE:
      return "was left out: a number was not finite";
    default:
      return "ended for a reason that this build cannot name";
  }
}

std::string FateInWords(v1::DepositFate fate) {
  switch (fate) {
    case v1::DEPOSIT_FATE_LEFT:
      return "left, for the hitpoints around it";
    case v1::DEPOSIT_FATE_DIRECT:
      return "none: the light of a first landing is direct, and sampled by the coordinator";
    case v1::DEPOSIT_FATE_TOO_BRIGHT:
      return "none: it has more than 32768 times the power of the whole scene; left out and "
             "counted";
    case v1::DEPOSIT_FATE_NOT_GATHERED:
      return "none: eye paths do not stop on this material";
    default:
      return "none";
  }
}

std::string PhotonPathText(const v1::PhotonPath& path) {
  std::string text = Concat("photon ", path.key().pass(), ":", path.key().index());
  if (path.has_emission()) {
    absl::StrAppend(&text, " from ", path.emission().light(), "\n");
    text += Line("from", Point(path.emission().position()));
    text += Line("towards", Point(path.emission().direction()));
    text += Line("flux", Flux(path.emission().flux()));
    if (path.wavelength_nm() > 0)
      text += Line("wavelength", absl::StrFormat("%.1f nm", path.wavelength_nm()));
  } else {
    text += "\n";
  }
  for (int i = 0; i < path.landings_size(); ++i) {
    const v1::PhotonPath::Landing& landing = path.landings(i);
    absl::StrAppend(&text, "landing ", i + 1, " on ", landing.shape(), ", material ",
                    landing.material(), ", ", absl::StrFormat("after %.9g\n", landing.distance()));
    text += LandingLines(landing);
  }
  return Concat(text, "the photon ", EndInWords(path.end()), "\n");
}

std::int64_t EnergyImbalance(const v1::Energy& energy) {
  return FromProto(energy).Imbalance();
}

std::string EnergyInWords(const v1::Energy& energy) {
  if (energy.emitted() <= 0) return {};
  const auto percent = [&](std::int64_t part) {
    return absl::StrFormat("%.2f %%",
                           100 * static_cast<double>(part) / static_cast<double>(energy.emitted()));
  };
  std::string text =
      Concat("of what was emitted ", percent(energy.absorbed()), " was absorbed, ",
             percent(energy.escaped()), " escaped, roulette took ", percent(energy.roulette_loss()),
             " and gave ", percent(energy.roulette_gain()));
  const auto add = [&](std::int64_t part, std::string_view words) {
    if (part != 0) absl::StrAppend(&text, ", ", percent(part), " ", std::string(words));
  };
  add(energy.smoothing(), "went to shading normals");
  add(energy.cut_off(), "was cut off at the greatest depth");
  add(energy.dropped(), "went with photons that were not finite");
  if (EnergyImbalance(energy) != 0) text += "; the counters do not balance";
  return text;
}

std::string DroppedLine(const v1::Job& job) {
  const v1::Tally& tally = job.progress().tally();
  std::string line;
  if (tally.dropped() > 0) {
    line = Concat(tally.dropped(), tally.dropped() == 1 ? " photon was" : " photons were",
                  " not finite and left out");
    if (job.dropped_photons_size() > 0) {
      const v1::PhotonKey& first = job.dropped_photons(0);
      absl::StrAppend(&line, "; the first: lucerna trace-photon ", job.job_id(), " ", first.pass(),
                      ":", first.index());
    }
  }
  if (tally.excess() > 0) {
    absl::StrAppend(&line, line.empty() ? "" : "; ", tally.excess(),
                    " landings or contributions were too bright or not finite and left out");
  }
  return line;
}

}  // namespace lucerna
