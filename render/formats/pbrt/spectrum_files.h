// Spectra that a parameter names by a file of wavelengths and values (.spd).
#pragma once

#include <vector>

#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/pbrt/parameter_list.h"

namespace lucerna {

// Puts the numbers of the file in the place of its name, in all parameters of type spectrum whose
// value is the name of a file; what the numbers mean is checked where the parameter is read. A file
// that cannot be read is reported.
void ReadSpectrumFiles(AssetReader& assets, std::vector<Parameter>& parameters,
                       Diagnostics& diagnostics);

}  // namespace lucerna
