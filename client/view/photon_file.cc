#include "client/view/photon_file.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "absl/strings/str_format.h"

#include "client/exit_code.h"
#include "render/base/escape.h"

namespace lucerna {
namespace {

template <typename Number>
void Append(Number number, std::string& bytes) {
  char raw[sizeof(Number)];
  std::memcpy(raw, &number, sizeof(Number));
  bytes.append(raw, sizeof(Number));
}

std::string PointsOf(const v1::PhotonPaths& paths) {
  std::string points;
  std::size_t count = 0;
  for (const v1::PhotonPath& path : paths.paths()) {
    for (int i = 0; i < path.landings_size(); ++i) {
      const v1::PhotonPath::Landing& landing = path.landings(i);
      if (landing.deposit() != v1::DEPOSIT_FATE_LEFT) continue;
      const v1::Triple& flux = landing.flux_landed();
      const float largest = std::max({flux.x(), flux.y(), flux.z(), 1e-30F});
      for (const float coordinate :
           {landing.position().x(), landing.position().y(), landing.position().z()})
        Append(coordinate, points);
      for (const float channel : {flux.x(), flux.y(), flux.z()})
        Append(
            static_cast<std::uint8_t>(std::lround(255 * std::clamp(channel / largest, 0.0F, 1.0F))),
            points);
      for (const float channel : {flux.x(), flux.y(), flux.z()})
        Append(channel, points);
      // Of a pass with more than 2^32 photons the lower bits.
      Append(static_cast<std::uint32_t>(path.key().index()), points);
      Append(static_cast<std::uint16_t>(std::min(i + 1, 65535)), points);
      ++count;
    }
  }
  return absl::StrCat(
      "ply\nformat binary_little_endian 1.0\ncomment photons of lucerna trace-photon\n"
      "element vertex ",
      count,
      "\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property float flux_r\nproperty float flux_g\nproperty float flux_b\n"
      "property uint photon\nproperty ushort landing\nend_header\n",
      points);
}

std::string LinesOf(const v1::PhotonPaths& paths) {
  std::string text = "# ways of photons, of lucerna trace-photon\n";
  std::size_t next = 1;  // OBJ counts from 1
  const auto add = [&](const v1::Triple& place) {
    absl::StrAppendFormat(&text, "v %.9g %.9g %.9g\n", place.x(), place.y(), place.z());
  };
  for (const v1::PhotonPath& path : paths.paths()) {
    if (!path.has_emission() || path.landings_size() == 0) continue;
    absl::StrAppend(&text, "g photon_", path.key().pass(), "_", path.key().index(), "\n");
    add(path.emission().position());
    for (const v1::PhotonPath::Landing& landing : path.landings())
      add(landing.position());
    text += "l";
    for (int i = 0; i <= path.landings_size(); ++i)
      absl::StrAppend(&text, " ", next++);
    text += "\n";
  }
  return text;
}

}  // namespace

StatusOr<PhotonFileFormat> PhotonFileFormatOf(std::string_view path) {
  if (path.ends_with(".ply")) return PhotonFileFormat::kPly;
  if (path.ends_with(".obj")) return PhotonFileFormat::kObj;
  return Failure(ExitCode::kUsage,
                 absl::StrCat(Escaped(path),
                              ": its name must end with .ply, for the places where photons "
                              "landed, or .obj, for their ways"));
}

std::string PhotonFile(const v1::PhotonPaths& paths, PhotonFileFormat format) {
  return format == PhotonFileFormat::kPly ? PointsOf(paths) : LinesOf(paths);
}

}  // namespace lucerna
