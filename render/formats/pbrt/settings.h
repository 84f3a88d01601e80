// Reads the directives before WorldBegin: camera, film, pixel filter, integrator, sampler.
#pragma once

#include <string_view>

#include "render/formats/pbrt/parameter_list.h"
#include "render/scene/scene.h"

namespace lucerna {

// `exposure_time_s` is shutterclose - shutteropen; the film's own share of the exposure is
// iso / 100, and the reader multiplies the two.
void ReadCamera(std::string_view type, ParameterList& parameters, Camera& camera,
                double& exposure_time_s);
void ReadFilm(std::string_view type, ParameterList& parameters, FilmSettings& film);
void ReadPixelFilter(std::string_view type, ParameterList& parameters, PixelFilter& filter);
void ReadIntegrator(std::string_view type, ParameterList& parameters,
                    IntegratorSettings& integrator);
void ReadSampler(std::string_view type, ParameterList& parameters, IntegratorSettings& integrator);

}  // namespace lucerna
