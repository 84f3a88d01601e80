// An image without noise and without blur, of scenes so simple that their light has a closed form.
//
// A flat diffuse floor, area lights of triangles, and black surfaces between them, which as seen
// from the floor do not hide each other. Glass that hardly bends light (an index of up to 1.001) is
// left out: what it changes is of the order of the index less 1.
//
// The irradiance of a polygon is Lambert's formula (Lambert 1760, "Photometria"; in vectors: Arvo
// 1995, "Applications of Irradiance Tensors to the Simulation of Non-Lambertian Phenomena"); what a
// black triangle hides of a light is cut out by the planes through the point and its edges
// (Sutherland & Hodgman 1974, "Reentrant Polygon Clipping").
#pragma once

#include "render/image/image.h"
#include "render/scene/render_settings.h"
#include "render/scene/scene.h"

namespace lucerna {

// R, G, B, each pixel the mean of 1,597 points of it. Requires a pinhole camera and a box filter
// of a pixel; aborts for scenes that are not as said above.
[[nodiscard]] Image RenderClosedForm(const Scene& scene, const RenderSettings& settings);

}  // namespace lucerna
