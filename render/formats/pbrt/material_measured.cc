// Material "measured".
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "render/base/text.h"
#include "render/formats/pbrt/material_readers.h"
#include "render/scene/measured_table.h"

namespace lucerna {
namespace {

// Stands for a table that could not be read, so that its error is the only one: black.
std::shared_ptr<const MeasuredTable> BlackTable() {
  constexpr GridSize kSize = {2, 2};
  const std::vector<float> black(4, 0.0F);
  return std::make_shared<const MeasuredTable>(MeasuredData{
      {0}, {0}, {550}, false, kSize, kSize, kSize, kSize, black, black, black, black, black});
}

}  // namespace

void ReadMeasured(const MaterialInput& input, Material& material) {
  ParameterList& parameters = input.parameters;
  const std::optional<std::string> file = parameters.FindString("filename");
  std::shared_ptr<const MeasuredTable> table;
  if (!file.has_value() || file->empty()) {
    parameters.Error("filename", "must name a .bsdf file");
  } else {
    StatusOr<std::shared_ptr<const MeasuredTable>> read = input.from.assets.ReadMeasured(*file);
    if (read.ok()) {
      table = *std::move(read);
    } else {
      parameters.Error("filename", Concat("cannot be read: ", read.status().message()));
    }
  }
  if (table == nullptr) table = BlackTable();
  constexpr float kMostAlbedo = 1.05F;
  const Rgb albedo = table->Albedo(table->WorkingSpace());
  if (MaxChannel(albedo) > kMostAlbedo) {
    parameters.Warning("filename", Concat("scatters ", MaxChannel(albedo),
                                          " of the light that falls on it from above; a surface "
                                          "scatters 1 at most"));
  }
  material.measured = table.get();
  material.measured_planes = table->WorkingSpace();
  material.is_measured_with_direction = table->is_anisotropic();
  material.owned_measured = std::move(table);
}

}  // namespace lucerna
