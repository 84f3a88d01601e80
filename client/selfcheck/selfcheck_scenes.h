// Which scenes does `lucerna selfcheck` render?
//
// Small rooms as pbrt-v4 text. A room is written as it is and as it is changed: moved, turned,
// scaled, cut up or lit by more. Numbers are written with all digits of a double, so a length times
// a power of two is read as exactly that.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace lucerna {

// A room 2 wide, 2 high and 2 deep, open to a camera in front of it, with coloured side walls.
struct CheckRoom {
  enum class Object : std::uint8_t {
    kBlock,         // diffuse, of triangles
    kGlassSphere,   // smooth
    kGlassBlock,    // of triangles
    kMirrorSphere,  // smooth
    kRoughSphere,   // metal that photons are gathered on
    kSmoothMesh,    // glass with shading normals
  };
  enum class Light : std::uint8_t { kLamp, kDisk, kSphere, kPoint, kSpot, kDistant, kSky };

  Object object = Object::kBlock;
  Light light = Light::kLamp;
  bool has_texture = false;  // a checkerboard floor

  // Every point p becomes offset + scale · R p.
  double scale = 1;
  std::vector<int> turns = {};  // R: quarter turns about these axes (0 to 2), the first one first
  std::array<double, 3> offset = {0, 0, 0};
  // Of radiance and intensity. The intensity of point and spot lights also grows with scale², so
  // that the image stays.
  double light_scale = 1;

  int triangle_splits = 0;   // each splits every triangle in four
  bool is_reversed = false;  // the order of the shapes
  bool has_halved_light = false;

  bool operator==(const CheckRoom&) const = default;
};

[[nodiscard]] std::string NameOf(const CheckRoom& room);
// The scene at 32x32 pixels.
[[nodiscard]] std::string TextOf(const CheckRoom& room);

}  // namespace lucerna
