#include "client/selfcheck/selfcheck_scenes.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"

namespace lucerna {
namespace {

using Point = std::array<double, 3>;
using Triangle = std::array<Point, 3>;

Point Middle(const Point& a, const Point& b) {
  return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
}

std::vector<Triangle> Split(const std::vector<Triangle>& triangles) {
  std::vector<Triangle> split;
  for (const auto& [a, b, c] : triangles) {
    const Point ab = Middle(a, b);
    const Point bc = Middle(b, c);
    const Point ca = Middle(c, a);
    split.insert(split.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return split;
}

// Corners in the order that makes (b - a) x (c - a) the side that the surface faces.
std::vector<Triangle> Quad(const Point& a, const Point& b, const Point& c, const Point& d) {
  return {{a, b, c}, {a, c, d}};
}

// A block standing on the floor, turned so that no face is along an axis.
std::vector<Triangle> Block(const Point& center, double half_width, double height) {
  std::array<Point, 8> corners;
  for (std::size_t i = 0; i < 8; ++i) {
    const double x = (i & 1) != 0 ? half_width : -half_width;
    const double z = (i & 2) != 0 ? half_width : -half_width;
    corners[i] = {center[0] + 0.875 * x + 0.4375 * z, center[1] + ((i & 4) != 0 ? height : 0),
                  center[2] - 0.4375 * x + 0.875 * z};
  }
  std::vector<Triangle> triangles;
  for (const auto& [a, b, c, d] : std::array<std::array<std::size_t, 4>, 6>{
           {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}}) {
    const std::vector<Triangle> face = Quad(corners[a], corners[b], corners[c], corners[d]);
    triangles.insert(triangles.end(), face.begin(), face.end());
  }
  return triangles;
}

class RoomText {
 public:
  explicit RoomText(const CheckRoom& room) : room_(room) {}

  std::string Make();

 private:
  [[nodiscard]] Point Turned(Point p) const {
    for (const int axis : room_.turns) {
      const auto first = static_cast<std::size_t>((axis + 1) % 3);
      const auto second = static_cast<std::size_t>((axis + 2) % 3);
      const double old = p[first];
      p[first] = -p[second];
      p[second] = old;
    }
    return p;
  }
  [[nodiscard]] Point Placed(const Point& p) const {
    const Point turned = Turned(p);
    return {room_.offset[0] + room_.scale * turned[0], room_.offset[1] + room_.scale * turned[1],
            room_.offset[2] + room_.scale * turned[2]};
  }
  static std::string Words(const Point& p) {
    return absl::StrFormat("%.17g %.17g %.17g", p[0], p[1], p[2]);
  }
  // A colour of the light; half of it when there are two of them.
  [[nodiscard]] std::string Light(const Point& color, double factor) const {
    const double share = room_.has_halved_light ? 0.5 : 1;
    const double by = room_.light_scale * factor * share;
    return Words({color[0] * by, color[1] * by, color[2] * by});
  }

  [[nodiscard]] std::string Mesh(std::vector<Triangle> triangles) const;
  // A shape in its own space, whose axis z is `axis`.
  [[nodiscard]] std::string Standing(const Point& center, const Point& axis,
                                     const std::string& shape) const;
  [[nodiscard]] std::string BallMesh(const Point& center, double radius) const;
  [[nodiscard]] std::string ObjectText() const;
  [[nodiscard]] std::string LightText() const;
  [[nodiscard]] std::string AreaLight(double low_x, double high_x) const;

  const CheckRoom& room_;
};

std::string RoomText::Mesh(std::vector<Triangle> triangles) const {
  for (int split = 0; split < room_.triangle_splits; ++split)
    triangles = Split(triangles);
  if (room_.is_reversed) std::ranges::reverse(triangles);
  std::vector<std::string> points;
  std::vector<std::string> uvs;
  std::vector<std::size_t> indices;
  for (const Triangle& triangle : triangles) {
    for (const Point& corner : triangle) {
      indices.push_back(points.size());
      points.push_back(Words(Placed(corner)));
      // Of the floor, the only mesh with a texture.
      uvs.push_back(absl::StrFormat("%.17g %.17g", (corner[0] + 1) / 2, (corner[2] + 1) / 2));
    }
  }
  return absl::StrCat("Shape \"trianglemesh\" \"point3 P\" [", absl::StrJoin(points, "  "),
                      "] \"point2 uv\" [", absl::StrJoin(uvs, "  "), "] \"integer indices\" [",
                      absl::StrJoin(indices, " "), "]\n");
}

std::string RoomText::Standing(const Point& center, const Point& axis,
                               const std::string& shape) const {
  // The axes follow one another as the right hand has them.
  const Point x = {axis[1], axis[2], axis[0]};
  const Point y = {axis[1] * x[2] - axis[2] * x[1], axis[2] * x[0] - axis[0] * x[2],
                   axis[0] * x[1] - axis[1] * x[0]};
  return absl::StrCat("AttributeBegin\nTransform [", Words(Turned(x)), " 0  ", Words(Turned(y)),
                      " 0  ", Words(Turned(axis)), " 0  ", Words(Placed(center)), " 1]\n", shape,
                      "\nAttributeEnd\n");
}

// A ball of 16 x 8 faces with the normals of a sphere.
std::string RoomText::BallMesh(const Point& center, double radius) const {
  constexpr int kAround = 16;
  constexpr int kDown = 8;
  std::vector<std::string> points;
  std::vector<std::string> normals;
  std::vector<int> indices;
  for (int i = 0; i <= kDown; ++i) {
    for (int j = 0; j < kAround; ++j) {
      const double theta = std::numbers::pi * i / kDown;
      const double phi = 2 * std::numbers::pi * j / kAround;
      const Point normal = {std::sin(theta) * std::cos(phi), std::cos(theta),
                            std::sin(theta) * std::sin(phi)};
      normals.push_back(Words(Turned(normal)));
      points.push_back(Words(Placed({center[0] + radius * normal[0], center[1] + radius * normal[1],
                                     center[2] + radius * normal[2]})));
      if (i == kDown) continue;
      const int next = (j + 1) % kAround;
      const int a = i * kAround + j;
      const int b = i * kAround + next;
      const int c = a + kAround;
      const int d = b + kAround;
      if (i > 0) indices.insert(indices.end(), {a, b, c});
      if (i + 1 < kDown) indices.insert(indices.end(), {b, d, c});
    }
  }
  return absl::StrCat("Shape \"trianglemesh\" \"point3 P\" [", absl::StrJoin(points, "  "),
                      "] \"normal N\" [", absl::StrJoin(normals, "  "), "] \"integer indices\" [",
                      absl::StrJoin(indices, " "), "]\n");
}

std::string RoomText::ObjectText() const {
  constexpr char kGlass[] = "Material \"dielectric\" \"float eta\" [1.5]\n";
  const Point center = {0.3, -0.45, 0.1};
  const std::string sphere =
      Standing(center, {0, 1, 0},
               absl::StrFormat("Shape \"sphere\" \"float radius\" [%.17g]", 0.5 * room_.scale));
  const std::vector<Triangle> block = Block({0.25, -0.9, 0}, 0.35, 0.8);
  switch (room_.object) {
    case CheckRoom::Object::kBlock:
      return absl::StrCat("Material \"diffuse\" \"rgb reflectance\" [0.6 0.55 0.3]\n", Mesh(block));
    case CheckRoom::Object::kGlassSphere:
      return absl::StrCat(kGlass, sphere);
    case CheckRoom::Object::kGlassBlock:
      return absl::StrCat(kGlass, Mesh(block));
    case CheckRoom::Object::kMirrorSphere:
      return absl::StrCat("Material \"conductor\" \"rgb reflectance\" [0.9 0.85 0.8]\n", sphere);
    case CheckRoom::Object::kRoughSphere:
      return absl::StrCat(
          "Material \"conductor\" \"rgb reflectance\" [0.9 0.85 0.8] \"float roughness\" [0.3]"
          " \"bool remaproughness\" [false]\n",
          sphere);
    case CheckRoom::Object::kSmoothMesh:
      return absl::StrCat(kGlass, BallMesh(center, 0.5));
  }
  return {};
}

// Points down.
std::string RoomText::AreaLight(double low_x, double high_x) const {
  return Mesh(
      Quad({low_x, 0.96, -0.3}, {high_x, 0.96, -0.3}, {high_x, 0.96, 0.3}, {low_x, 0.96, 0.3}));
}

std::string RoomText::LightText() const {
  const double scale_squared = room_.scale * room_.scale;
  const auto area = [&](const Point& radiance) {
    const double by = room_.light_scale;
    return absl::StrCat(
        "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\nAreaLightSource \"diffuse\" \"rgb L\" [",
        Words({radiance[0] * by, radiance[1] * by, radiance[2] * by}), "]\n");
  };
  switch (room_.light) {
    case CheckRoom::Light::kLamp:
      // Two halves are side by side.
      if (room_.has_halved_light) {
        return absl::StrCat(area({9, 8, 6}), AreaLight(-0.3, 0), AreaLight(0, 0.3));
      }
      return absl::StrCat(area({9, 8, 6}), AreaLight(-0.3, 0.3));
    case CheckRoom::Light::kDisk:
      return absl::StrCat(
          area({9, 8, 6}),
          Standing({0, 0.95, 0}, {0, -1, 0},
                   absl::StrFormat("Shape \"disk\" \"float radius\" [%.17g]", 0.3 * room_.scale)));
    case CheckRoom::Light::kSphere:
      return absl::StrCat(area({9, 8, 6}),
                          Standing({-0.4, 0.4, 0}, {0, 1, 0},
                                   absl::StrFormat("Shape \"sphere\" \"float radius\" [%.17g]",
                                                   0.15 * room_.scale)));
    case CheckRoom::Light::kPoint:
    case CheckRoom::Light::kSpot:
    case CheckRoom::Light::kDistant:
    case CheckRoom::Light::kSky:
      break;
  }
  const Point above = {-0.3, 0.8, -0.2};
  const Point below = {-0.1, -1, -0.1};
  std::string one;
  if (room_.light == CheckRoom::Light::kPoint) {
    one = absl::StrCat("LightSource \"point\" \"point3 from\" [", Words(Placed(above)),
                       "] \"rgb I\" [", Light({2, 1.5, 1}, scale_squared), "]\n");
  } else if (room_.light == CheckRoom::Light::kSpot) {
    one = absl::StrCat("LightSource \"spot\" \"point3 from\" [", Words(Placed(above)),
                       "] \"point3 to\" [", Words(Placed(below)), "] \"rgb I\" [",
                       Light({4, 3, 2}, scale_squared), "] \"float coneangle\" [50]\n");
  } else if (room_.light == CheckRoom::Light::kDistant) {
    one = absl::StrCat("LightSource \"distant\" \"point3 from\" [", Words(Turned({0.25, 0.5, -1})),
                       "] \"point3 to\" [0 0 0] \"rgb L\" [", Light({2, 1.5, 1}, 1), "]\n");
  } else {
    one = absl::StrCat("LightSource \"infinite\" \"rgb L\" [", Light({0.8, 1, 1.2}, 1), "]\n");
  }
  return room_.has_halved_light ? absl::StrCat(one, one) : one;
}

std::string RoomText::Make() {
  std::string text =
      absl::StrCat("LookAt ", Words(Placed({0.1, 0.1, -3.5})), "  ", Words(Placed({0, -0.05, 0})),
                   "  ", Words(Turned({0, 1, 0})), "\n");
  absl::StrAppend(&text,
                  "Camera \"perspective\" \"float fov\" [40]\n"
                  "Film \"rgb\" \"integer xresolution\" [32] \"integer yresolution\" [32]\n"
                  "PixelFilter \"box\"\nWorldBegin\n");
  const auto diffuse = [](const char* color) {
    return absl::StrCat("Material \"diffuse\" \"rgb reflectance\" [", color, "]\n");
  };
  const std::string floor =
      room_.has_texture
          ? "Texture \"tiles\" \"spectrum\" \"checkerboard\" \"float uscale\" [4]"
            " \"float vscale\" [4] \"rgb tex1\" [0.8 0.7 0.6] \"rgb tex2\" [0.1 0.2 0.3]"
            "\nMaterial \"diffuse\" \"texture reflectance\" [\"tiles\"]\n"
          : diffuse("0.7 0.68 0.64");
  std::vector<std::string> shapes = {
      absl::StrCat(floor, Mesh(Quad({-1, -0.9, -1}, {-1, -0.9, 1}, {1, -0.9, 1}, {1, -0.9, -1}))),
      absl::StrCat(diffuse("0.7 0.68 0.64"),
                   Mesh(Quad({-1, -0.9, 1}, {-1, 1, 1}, {1, 1, 1}, {1, -0.9, 1}))),
      absl::StrCat(diffuse("0.12 0.42 0.4"),
                   Mesh(Quad({-1, -0.9, -1}, {-1, 1, -1}, {-1, 1, 1}, {-1, -0.9, 1}))),
      absl::StrCat(diffuse("0.65 0.36 0.1"),
                   Mesh(Quad({1, -0.9, 1}, {1, 1, 1}, {1, 1, -1}, {1, -0.9, -1}))),
      ObjectText(),
  };
  // Sun and sky come from above.
  if (room_.light != CheckRoom::Light::kSky && room_.light != CheckRoom::Light::kDistant) {
    shapes.push_back(absl::StrCat(diffuse("0.7 0.68 0.64"),
                                  Mesh(Quad({-1, 1, 1}, {-1, 1, -1}, {1, 1, -1}, {1, 1, 1}))));
  }
  shapes.push_back(LightText());
  if (room_.is_reversed) std::ranges::reverse(shapes);
  for (const std::string& shape : shapes)
    absl::StrAppend(&text, "AttributeBegin\n", shape, "AttributeEnd\n");
  return text;
}

}  // namespace

std::string NameOf(const CheckRoom& room) {
  constexpr std::array<const char*, 6> kObjects = {
      "block", "glass sphere", "glass block", "mirror sphere", "rough sphere", "smooth glass mesh"};
  constexpr std::array<const char*, 7> kLights = {
      "lamp", "disk", "glowing sphere", "point", "spot", "distant", "sky"};
  return absl::StrCat(kObjects[static_cast<std::size_t>(room.object)], " under ",
                      kLights[static_cast<std::size_t>(room.light)],
                      room.has_texture ? " on tiles" : "");
}

std::string TextOf(const CheckRoom& room) {
  return RoomText(room).Make();
}

}  // namespace lucerna
