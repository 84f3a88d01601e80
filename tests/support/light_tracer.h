// An image without the kernel's blur, to measure other images by.
//
// Where the camera sees a diffuse surface directly, each photon that lands there and is not hidden
// from the camera adds its light to the pixel in which it is seen (light tracing: Dutre, Lafortune
// & Willems 1993, "Monte Carlo Light Tracing with Direct Computation of Pixel Intensities"): no
// radius, so no bias, however sharp an edge is. What is not by photons, and pixels that show
// something else as well, are those of an ordinary render. What else a pixel shows is missed where
// it is thinner than a quarter of the pixel: light by photons on such glass or metal is left out.
//
// Photons are those of the renderer itself, drawn by the guides that the render has learned, so
// that what both have wrong does not show: for that there are closed forms and path_tracer.h.
#pragma once

#include <cstddef>
#include <cstdint>

#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"

namespace lucerna {

struct LightTracedImage {
  Image image;  // R, G, B
  std::size_t traced_pixels = 0;
  std::uint64_t photons = 0;  // of the ordinary render; as many, but for a few passes, were traced
};

// The mean of `passes` passes, more than kFirstLongRound, each with as many photons as the ordinary
// render's. Requires a pinhole camera and a box filter of a pixel; aborts for others, and for
// scenes with media, motion, wavelengths or a crop window.
[[nodiscard]] LightTracedImage TraceLight(const Scene& scene, const RenderSettings& settings,
                                          int passes, int threads = 0);

}  // namespace lucerna
