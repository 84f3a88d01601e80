// Reads the directives before WorldBegin: camera, film, pixel filter, integrator, sampler.
#pragma once

#include <string_view>

#include "render/formats/pbrt/parameter_list.h"
#include "render/scene/scene.h"

namespace lucerna {

// The camera's share of the exposure is shutterclose - shutteropen, the film's own iso / 100; the
// reader multiplies the two.
void ReadCamera(std::string_view type, ParameterList& parameters, Camera& camera,
                SceneMotion& motion);
void ReadFilm(std::string_view type, ParameterList& parameters, FilmSettings& film);
void ReadPixelFilter(std::string_view type, ParameterList& parameters, PixelFilter& filter);
void ReadIntegrator(std::string_view type, ParameterList& parameters,
                    IntegratorSettings& integrator);
void ReadSampler(std::string_view type, ParameterList& parameters, IntegratorSettings& integrator);

}  // namespace lucerna
