#include "render/bake/surface_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "render/bake/decimation.h"
#include "render/base/text.h"
#include "render/math/double3.h"
#include "render/math/union_find.h"
#include "render/scene/material.h"
#include "render/scene/shape_lists.h"

namespace lucerna {
namespace {

// Faces that bend by more have vertices of their own.
const double kCreaseCosine = std::cos(30 * std::numbers::pi / 180);
// Sensors lie so far inside of the faces of their vertices, in spacings: beside what stands on an
// edge, and on one side of it.
constexpr double kInset = 0.001;
// And at most this share of the way to the middle of the face.
constexpr double kLargestInset = 0.1;
// Irradiance below this share of the mean is as good as none.
constexpr double kDarkShare = 0.1;
// Differences below so many standard deviations are noise.
constexpr double kNoiseDeviations = 2;
// The same for means over faces of the first mesh, whose noise is estimated from few passes.
constexpr double kSurveyDeviations = 4;
// Direct light that the mesh misses on a face of the first mesh, over what it has there.
constexpr double kMissedShare = 0.5;
// Into so many parts a disk's rim and a sphere's equator are divided.
constexpr int kRoundParts = 32;

// A bucket's disc holds its corners, whatever rounding does.
constexpr double kBeyondCorners = 1.001;

constexpr std::uint32_t kNoVertex = UINT32_MAX;

using Triangles = std::vector<std::array<std::uint32_t, 3>>;

Vec3 ToFile(Vec3 position, double unit) {
  return ToFloat(Double3(position) * unit);
}

// Two vectors that make a right-handed frame with `axis`, which is unit length.
std::pair<Double3, Double3> AcrossOf(Double3 axis) {
  const Double3 other = std::abs(axis.x) < 0.6 ? Double3(1, 0, 0) : Double3(0, 1, 0);
  const Double3 u = Cross(other, axis);
  const Double3 unit_u = u * (1 / Length(u));
  return {unit_u, Cross(axis, unit_u)};
}

struct Triangulated {
  std::vector<Vec3> positions;
  Triangles triangles;
  std::optional<MeshSurface::Ball> ball;
};

Triangulated Triangulate(const TriangleMesh& mesh, const Transform& to_world, double unit) {
  Triangulated out;
  out.positions.reserve(mesh.positions.size());
  for (const Vec3 position : mesh.positions)
    out.positions.push_back(ToFile(to_world.Point(position), unit));
  const bool is_mirrored = to_world.SwapsHandedness();
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    out.triangles.push_back({mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]});
    if (is_mirrored) std::swap(out.triangles.back()[1], out.triangles.back()[2]);
  }
  return out;
}

Triangulated Triangulate(const Disk& disk, double unit) {
  Triangulated out;
  const auto [u, v] = AcrossOf(Double3(disk.normal));
  const Double3 center(disk.center);
  const auto ring = [&, u = u, v = v](float radius) {
    for (int i = 0; i < kRoundParts; ++i) {
      const double angle = 2 * std::numbers::pi * i / kRoundParts;
      const auto r = static_cast<double>(radius);
      out.positions.push_back(
          ToFile(ToFloat(center + u * (r * std::cos(angle)) + v * (r * std::sin(angle))), unit));
    }
  };
  ring(disk.radius);
  const bool is_ring = disk.inner_radius > 0;
  if (is_ring) {
    ring(disk.inner_radius);
  } else {
    out.positions.push_back(ToFile(disk.center, unit));
  }
  for (std::uint32_t i = 0; i < kRoundParts; ++i) {
    const std::uint32_t next = (i + 1) % kRoundParts;
    if (is_ring) {
      out.triangles.push_back({i, next, kRoundParts + i});
      out.triangles.push_back({next, kRoundParts + next, kRoundParts + i});
    } else {
      out.triangles.push_back({i, next, static_cast<std::uint32_t>(kRoundParts)});
    }
  }
  return out;
}

// An octahedron, each face of which is split twice: 128 faces.
Triangulated Triangulate(const Sphere& sphere, double unit) {
  Triangulated out;
  out.ball = MeshSurface::Ball{ToFile(sphere.center, unit),
                               static_cast<float>(static_cast<double>(sphere.radius) * unit)};
  std::vector<Double3> directions = {{1, 0, 0},  {-1, 0, 0}, {0, 1, 0},
                                     {0, -1, 0}, {0, 0, 1},  {0, 0, -1}};
  out.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4},
                   {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int level = 0; level < 2; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [found, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(directions.size()));
      if (is_new) {
        const Double3 sum = directions[a] + directions[b];
        directions.push_back(sum * (1 / Length(sum)));
      }
      return found->second;
    };
    Triangles finer;
    for (const auto& [a, b, c] : out.triangles) {
      const std::uint32_t ab = middle(a, b);
      const std::uint32_t bc = middle(b, c);
      const std::uint32_t ca = middle(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    out.triangles = std::move(finer);
  }
  for (const Double3 direction : directions) {
    out.positions.push_back(ToFile(
        ToFloat(Double3(sphere.center) + direction * static_cast<double>(sphere.radius)), unit));
  }
  if (sphere.inward) {
    for (auto& triangle : out.triangles)
      std::swap(triangle[1], triangle[2]);
  }
  return out;
}

Triangulated Triangulate(const CurvePiece& /*curve*/, double /*unit*/) {
  return {};
}

Status TooManyFaces(std::size_t max_faces) {
  return absl::ResourceExhaustedError(
      Concat("the mesh has more than ", max_faces, " triangles; give a larger spacing"));
}

double LuminanceOf(const Irradiance& irradiance) {
  return static_cast<double>(Luminance(irradiance.value));
}

}  // namespace

std::string NameOf(const MeshSurface& surface) {
  return Concat(surface.shape, surface.name.empty() ? "" : " ", surface.name,
                surface.is_back ? ", back" : "");
}

StatusOr<SurfaceMesh> SurfaceMesh::FromScene(const Scene& scene, const Options& options) {
  SurfaceMesh mesh;
  mesh.spacing_ = options.spacing;
  mesh.max_faces_ = options.max_faces;
  mesh.elements_ = options.elements;
  std::set<std::string> names;
  std::uint32_t shape = 0;
  const auto is_wanted = [&](const ShapeTraits& traits) {
    const Material& material = scene.materials[static_cast<std::size_t>(traits.material)];
    if (!Gathers(material)) return false;
    names.insert(material.name);
    return options.names.empty() || std::ranges::count(options.names, material.name) > 0;
  };
  const auto add = [&](const ShapeTraits& traits, Triangulated triangulated) {
    if (triangulated.triangles.empty()) return;
    MeshSurface surface;
    surface.name = scene.materials[static_cast<std::size_t>(traits.material)].name;
    surface.shape = shape++;
    surface.ball = triangulated.ball;
    if (options.sides != MeasuredSides::kBack) {
      mesh.AddSurface(triangulated.positions, triangulated.triangles, surface);
    }
    if (options.sides == MeasuredSides::kFront) return;
    surface.is_back = true;
    for (auto& triangle : triangulated.triangles)
      std::swap(triangle[1], triangle[2]);
    mesh.AddSurface(triangulated.positions, triangulated.triangles, surface);
  };
  for (const TriangleMesh& triangles : scene.meshes) {
    if (is_wanted(triangles.traits)) {
      add(triangles.traits, Triangulate(triangles, Transform(), scene.unit));
    }
  }
  for (const Instance& instance : scene.instances) {
    const InstancedObject& object = scene.objects[instance.object];
    for (std::uint32_t i = 0; i < object.mesh_count; ++i) {
      const TriangleMesh& triangles = scene.object_meshes[object.first_mesh + i];
      if (is_wanted(triangles.traits)) {
        add(triangles.traits, Triangulate(triangles, instance.to_world, scene.unit));
      }
    }
  }
  ForEachAnalyticShape(scene, [&](const auto& analytic) {
    if (is_wanted(analytic.traits)) add(analytic.traits, Triangulate(analytic, scene.unit));
  });
  if (!mesh.faces_.empty()) return mesh;
  if (names.empty()) {
    return absl::NotFoundError("no surface of the scene keeps photons: all are smooth or black");
  }
  return absl::NotFoundError(Concat("no surface has such a material; there are ", Listed(names)));
}

std::uint32_t SurfaceMesh::PlaceOf(Vec3 position) {
  // Of two zeros the positive one.
  const std::array<float, 3> key = {position.x + 0.0F, position.y + 0.0F, position.z + 0.0F};
  return places_.try_emplace(key, static_cast<std::uint32_t>(places_.size())).first->second;
}

void SurfaceMesh::AddSurface(const std::vector<Vec3>& positions, const Triangles& triangles,
                             MeshSurface surface) {
  const auto number = static_cast<std::uint32_t>(surfaces_.size());
  std::vector<std::uint32_t> places;
  places.reserve(positions.size());
  for (const Vec3 position : positions)
    places.push_back(PlaceOf(position));
  const auto normal_of = [&](const std::array<std::uint32_t, 3>& triangle) {
    return TriangleCross(positions[triangle[0]], positions[triangle[1]], positions[triangle[2]]);
  };

  // Corners of faces that share an edge without a crease are one vertex.
  UnionFind corners(3 * triangles.size());
  struct Side {
    std::uint32_t face;
    std::uint32_t first, second;  // corners, by their places
  };
  std::map<Pair, std::vector<Side>> sides;
  for (std::uint32_t face = 0; face < triangles.size(); ++face) {
    for (std::uint32_t i = 0; i < 3; ++i) {
      std::uint32_t a = 3 * face + i;
      std::uint32_t b = 3 * face + (i + 1) % 3;
      std::uint32_t place_a = places[triangles[face][a % 3]];
      std::uint32_t place_b = places[triangles[face][b % 3]];
      if (place_a == place_b) continue;
      if (place_a > place_b) {
        std::swap(a, b);
        std::swap(place_a, place_b);
      }
      sides[{place_a, place_b}].push_back({face, a, b});
    }
  }
  for (const auto& [edge, faces] : sides) {
    for (std::size_t i = 1; i < faces.size(); ++i) {
      const Double3 n0 = normal_of(triangles[faces[i - 1].face]);
      const Double3 n1 = normal_of(triangles[faces[i].face]);
      if (!(Dot(n0, n1) >= kCreaseCosine * Length(n0) * Length(n1))) continue;
      corners.Unite(faces[i - 1].first, faces[i].first);
      corners.Unite(faces[i - 1].second, faces[i].second);
    }
  }

  std::map<std::uint32_t, std::uint32_t> vertex_of;  // by the set of corners
  std::vector<Double3> normals;
  const auto first_face = static_cast<std::uint32_t>(faces_.size());
  const auto first_vertex = static_cast<std::uint32_t>(vertices_.size());
  for (std::uint32_t face = 0; face < triangles.size(); ++face) {
    const Double3 normal = normal_of(triangles[face]);
    if (!(Length(normal) > 0)) continue;  // no area in the file's unit
    MeshFace added;
    added.surface = number;
    for (std::uint32_t i = 0; i < 3; ++i) {
      const auto [found, is_new] = vertex_of.try_emplace(
          corners.Find(3 * face + i), static_cast<std::uint32_t>(vertices_.size()));
      if (is_new) {
        MeshVertex vertex;
        vertex.position = positions[triangles[face][i]];
        vertex.place = places[triangles[face][i]];
        vertex.surface = number;
        vertices_.push_back(vertex);
        normals.emplace_back();
      }
      added.vertices[i] = found->second;
      Double3& sum = normals[found->second - first_vertex];
      sum = sum + normal;
    }
    faces_.push_back(added);
  }
  surfaces_.push_back(std::move(surface));
  for (std::uint32_t face = first_face; face < faces_.size(); ++face) {
    for (const std::uint32_t number_of : faces_[face].vertices) {
      MeshVertex& vertex = vertices_[number_of];
      if (vertex.normal != Vec3()) continue;
      const Double3 sum = normals[number_of - first_vertex];
      const Double3 own = TriangleCross(vertices_[faces_[face].vertices[0]].position,
                                        vertices_[faces_[face].vertices[1]].position,
                                        vertices_[faces_[face].vertices[2]].position);
      // Faces that cancel each other have the first one's.
      const Double3 normal = Length(sum) > 1e-6 * Length(own) ? sum : own;
      vertex.normal = ToFloat(normal * (1 / Length(normal)));
      vertex.sensor = SensorOn(faces_[face], vertex.position, vertex.normal);
    }
  }
}

Sensor SurfaceMesh::SensorOn(const MeshFace& face, Vec3 position, Vec3 normal) const {
  const Double3 at(position);
  if (const auto& ball = surfaces_[face.surface].ball; ball) {
    const Double3 out = at - Double3(ball->center);
    const double length = Length(out);
    if (length > 0) {
      const Double3 radial = out * (1 / length);
      const bool is_same = Dot(radial, Double3(normal)) > 0;
      const auto radius = static_cast<double>(ball->radius);
      return {ToFloat(Double3(ball->center) + radial * radius),
              ToFloat(radial * (is_same ? 1 : -1)), static_cast<float>(spacing_)};
    }
  }
  Double3 middle;
  for (const std::uint32_t vertex : face.vertices)
    middle = middle + Double3(vertices_[vertex].position) * (1.0 / 3);
  const Double3 inward = middle - at;
  const double length = Length(inward);
  if (!(length > 0)) return {position, normal, static_cast<float>(spacing_)};
  const double inset = std::min(kInset * spacing_, kLargestInset * length);
  return {ToFloat(at + inward * (inset / length)), normal, static_cast<float>(spacing_)};
}

double SurfaceMesh::AreaOf(const MeshFace& face) const {
  return Length(TriangleCross(vertices_[face.vertices[0]].position,
                              vertices_[face.vertices[1]].position,
                              vertices_[face.vertices[2]].position)) /
         2;
}

SurfaceMesh::Pair SurfaceMesh::EdgeOf(const MeshFace& face, int edge) const {
  return std::minmax(face.vertices[static_cast<std::size_t>(edge)],
                     face.vertices[static_cast<std::size_t>((edge + 1) % 3)]);
}

SurfaceMesh::Pair SurfaceMesh::PlacesOf(Pair edge) const {
  return std::minmax(vertices_[edge.first].place, vertices_[edge.second].place);
}

double SurfaceMesh::LengthOf(Pair edge) const {
  return Length(Double3(vertices_[edge.first].position) - Double3(vertices_[edge.second].position));
}

int SurfaceMesh::LongestEdgeOf(const MeshFace& face) const {
  int longest = 0;
  for (int edge = 1; edge < 3; ++edge) {
    // Of equally long ones, faces on both sides choose the same.
    const auto rank = [&](int of) {
      const Pair vertices = EdgeOf(face, of);
      return std::pair(LengthOf(vertices), PlacesOf(vertices));
    };
    if (rank(edge) > rank(longest)) longest = edge;
  }
  return longest;
}

MeshVertex SurfaceMesh::MiddleOf(const MeshFace& face, const MeshVertex& a,
                                 const MeshVertex& b) const {
  MeshVertex middle;
  middle.surface = face.surface;
  Double3 position = (Double3(a.position) + Double3(b.position)) * 0.5;
  const Double3 sum = Double3(a.normal) + Double3(b.normal);
  middle.normal = Length(sum) > 0 ? ToFloat(sum * (1 / Length(sum))) : a.normal;
  if (const auto& ball = surfaces_[face.surface].ball; ball) {
    const Double3 out = position - Double3(ball->center);
    if (Length(out) > 0) {
      position = Double3(ball->center) + out * (static_cast<double>(ball->radius) / Length(out));
    }
  }
  middle.position = ToFloat(position);
  middle.sensor = SensorOn(face, middle.position, middle.normal);
  return middle;
}

MeshVertex& SurfaceMesh::PointOf(const AskedProbe& asked) {
  Probe& probe = probes_.at(asked.edge);
  return asked.point == 0 ? probe.middle
                          : (*probe.quarters)[static_cast<std::size_t>(asked.point - 1)];
}

MeshVertex SurfaceMesh::NodeOf(const MeshFace& face, std::uint32_t from, std::uint32_t to) const {
  const auto probe = probes_.find(std::minmax(from, to));
  if (probe != probes_.end() && probe->second.middle.irradiance) return probe->second.middle;
  const MeshVertex& a = vertices_[std::min(from, to)];
  const MeshVertex& b = vertices_[std::max(from, to)];
  MeshVertex node = MiddleOf(face, a, b);
  node.irradiance = {(a.irradiance->value + b.irradiance->value) * 0.5F,
                     std::hypot(a.irradiance->noise, b.irradiance->noise) / 2,
                     (a.irradiance->direct + b.irradiance->direct) / 2};
  return node;
}

Status SurfaceMesh::Split(std::set<Pair> places) {
  // A face with an edge that is split is split at its longest one too.
  for (bool has_grown = true; has_grown;) {
    has_grown = false;
    for (const MeshFace& face : faces_) {
      bool is_split = false;
      for (int edge = 0; edge < 3; ++edge)
        is_split = is_split || places.contains(PlacesOf(EdgeOf(face, edge)));
      if (!is_split) continue;
      has_grown = places.insert(PlacesOf(EdgeOf(face, LongestEdgeOf(face)))).second || has_grown;
    }
  }
  std::map<Pair, std::uint32_t> middles;  // new vertices, by the vertices of the edge
  std::vector<MeshFace> finer;
  finer.reserve(faces_.size());
  for (const MeshFace& face : faces_) {
    const int longest = LongestEdgeOf(face);
    // The longest edge goes from the first corner to the second.
    std::array<std::uint32_t, 3> v{};
    std::array<std::uint32_t, 3> m{};  // middles of the edges, or kNoVertex
    for (int i = 0; i < 3; ++i) {
      const int edge = (longest + i) % 3;
      const auto index = static_cast<std::size_t>(i);
      v[index] = face.vertices[static_cast<std::size_t>(edge)];
      m[index] = kNoVertex;
      const Pair vertices = EdgeOf(face, edge);
      if (!places.contains(PlacesOf(vertices))) continue;
      const auto [found, is_new] =
          middles.try_emplace(vertices, static_cast<std::uint32_t>(vertices_.size()));
      if (is_new) {
        const auto probe = probes_.find(vertices);
        MeshVertex middle = probe == probes_.end() ? MiddleOf(face, vertices_[vertices.first],
                                                              vertices_[vertices.second])
                                                   : probe->second.middle;
        middle.place = PlaceOf(middle.position);
        vertices_.push_back(std::move(middle));
        if (probe != probes_.end()) {
          probe->second.is_used = true;
          if (const auto quarters = probe->second.quarters; quarters) {
            // New vertices have larger numbers.
            probes_[{vertices.first, found->second}].middle = (*quarters)[0];
            probes_[{vertices.second, found->second}].middle = (*quarters)[1];
          }
        }
      }
      m[index] = found->second;
    }
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
      finer.push_back({{a, b, c}, face.surface, std::nullopt, face.survey});
    };
    if (m[0] == kNoVertex) {
      finer.push_back(face);
    } else if (m[1] != kNoVertex && m[2] != kNoVertex) {
      add(v[0], m[0], m[2]);
      add(m[0], v[1], m[1]);
      add(m[2], m[1], v[2]);
      add(m[0], m[1], m[2]);
    } else if (m[1] != kNoVertex) {
      add(v[0], m[0], v[2]);
      add(m[0], v[1], m[1]);
      add(m[0], m[1], v[2]);
    } else if (m[2] != kNoVertex) {
      add(v[0], m[0], m[2]);
      add(m[2], m[0], v[2]);
      add(m[0], v[1], v[2]);
    } else {
      add(v[0], m[0], v[2]);
      add(m[0], v[1], v[2]);
    }
  }
  faces_ = std::move(finer);
  return faces_.size() <= max_faces_ ? absl::OkStatus() : TooManyFaces(max_faces_);
}

Status SurfaceMesh::CheckLongEdges(double longest) const {
  // A triangle with such an edge has at most an area of sqrt(3)/4 of its square.
  double area = 0;
  for (const MeshFace& face : faces_)
    area += AreaOf(face);
  if (!(area < static_cast<double>(max_faces_) * std::sqrt(3.0) / 4 * longest * longest)) {
    return TooManyFaces(max_faces_);
  }
  return absl::OkStatus();
}

Status SurfaceMesh::SplitLongEdges(double longest) {
  LUCERNA_RETURN_IF_ERROR(CheckLongEdges(longest));
  for (;;) {
    std::set<Pair> places;
    for (const MeshFace& face : faces_) {
      for (int edge = 0; edge < 3; ++edge) {
        const Pair vertices = EdgeOf(face, edge);
        if (LengthOf(vertices) > longest) places.insert(PlacesOf(vertices));
      }
    }
    if (places.empty()) return absl::OkStatus();
    LUCERNA_RETURN_IF_ERROR(Split(std::move(places)));
  }
}

std::vector<Sensor> SurfaceMesh::NextSensors(bool with_edges) {
  asked_vertices_.clear();
  asked_probes_.clear();
  std::vector<Sensor> sensors;
  std::vector<std::uint8_t> is_used(vertices_.size());
  for (const MeshFace& face : faces_) {
    for (const std::uint32_t number : face.vertices) {
      if (std::exchange(is_used[number], 1) != 0 || vertices_[number].irradiance) continue;
      asked_vertices_.push_back(number);
      sensors.push_back(vertices_[number].sensor);
    }
  }
  if (!with_edges) return sensors;
  for (const MeshFace& face : faces_) {
    for (int edge = 0; edge < 3; ++edge) {
      const Pair vertices = EdgeOf(face, edge);
      const double length = LengthOf(vertices);
      if (!(length > spacing_)) continue;
      const MeshVertex& a = vertices_[vertices.first];
      const MeshVertex& b = vertices_[vertices.second];
      const auto [found, is_new] = probes_.try_emplace(vertices);
      Probe& probe = found->second;
      if (is_new) {
        probe.middle = MiddleOf(face, a, b);
        asked_probes_.push_back({vertices, 0});
        sensors.push_back(probe.middle.sensor);
      }
      if (elements_ == MeshElements::kLinear || probe.quarters || !(length > 2 * spacing_)) {
        continue;
      }
      probe.quarters = {MiddleOf(face, a, probe.middle), MiddleOf(face, b, probe.middle)};
      for (const int point : {1, 2}) {
        asked_probes_.push_back({vertices, point});
        sensors.push_back(PointOf(asked_probes_.back()).sensor);
      }
    }
  }
  return sensors;
}

void SurfaceMesh::SetMeasured(const std::vector<Irradiance>& measured) {
  for (std::size_t i = 0; i < asked_vertices_.size(); ++i)
    vertices_[asked_vertices_[i]].irradiance = measured[i];
  for (std::size_t i = 0; i < asked_probes_.size(); ++i)
    PointOf(asked_probes_[i]).irradiance = measured[asked_vertices_.size() + i];
}

SensorSet SurfaceMesh::Buckets() const {
  SensorSet set;
  set.sensors.reserve(faces_.size());
  set.buckets.reserve(faces_.size());
  std::map<Pair, std::array<Vec3, 2>> borders;  // by places
  for (const MeshFace& face : faces_) {
    SensorBucket bucket;
    Double3 middle;
    for (std::size_t i = 0; i < 3; ++i) {
      bucket.corners[i] = vertices_[face.vertices[i]].position;
      middle = middle + Double3(bucket.corners[i]) * (1.0 / 3);
    }
    const Vec3 normal = TriangleNormal(bucket.corners[0], bucket.corners[1], bucket.corners[2]);
    Sensor sensor = {ToFloat(middle), normal, 0};
    if (const auto& ball = surfaces_[face.surface].ball; ball) {
      const Double3 out = middle - Double3(ball->center);
      middle = Double3(ball->center) + out * (static_cast<double>(ball->radius) / Length(out));
      sensor = SensorOn(face, ToFloat(middle), normal);
      bucket.ball_center = ball->center;
      bucket.ball_radius = ball->radius;
    }
    double reach = 0;
    for (const Vec3 corner : bucket.corners)
      reach = std::max(reach, Length(Double3(corner) - middle));
    sensor.spacing = static_cast<float>(kBeyondCorners * reach);
    set.sensors.push_back(sensor);
    set.buckets.push_back(bucket);
    for (int edge = 0; edge < 3; ++edge) {
      const Pair vertices = EdgeOf(face, edge);
      borders.try_emplace(PlacesOf(vertices), std::array{vertices_[vertices.first].position,
                                                         vertices_[vertices.second].position});
    }
  }
  set.borders.reserve(borders.size());
  for (const auto& [places, border] : borders)
    set.borders.push_back(border);
  return set;
}

void SurfaceMesh::SetBuckets(const std::vector<Irradiance>& measured) {
  for (std::size_t i = 0; i < faces_.size(); ++i)
    faces_[i].bucket = measured[i];
}

void SurfaceMesh::KeepAsSurvey() {
  surveys_.clear();
  for (MeshFace& face : faces_) {
    face.survey = static_cast<std::uint32_t>(surveys_.size());
    surveys_.push_back({*face.bucket, !surfaces_[face.surface].ball});
    face.bucket.reset();
  }
}

void SurfaceMesh::DropDarkerSides() {
  std::vector<double> flux(surfaces_.size());
  for (const MeshFace& face : faces_)
    flux[face.surface] += AreaOf(face) * LuminanceOf(*face.bucket);
  // The two sides of a shape follow each other.
  for (std::size_t i = 0; i + 1 < surfaces_.size(); i += 2) {
    const bool is_back_brighter = flux[i + 1] > flux[i];
    surfaces_[is_back_brighter ? i : i + 1].is_kept = false;
  }
  std::erase_if(faces_, [&](const MeshFace& face) { return !surfaces_[face.surface].is_kept; });
}

double SurfaceMesh::MeanIrradiance() const {
  double sum = 0;
  double area = 0;
  for (const MeshFace& face : faces_) {
    for (const std::uint32_t vertex : face.vertices) {
      if (!face.bucket && !vertices_[vertex].irradiance) continue;
      sum += AreaOf(face) * LuminanceOf(AtCorner(face, vertex));
      area += AreaOf(face);
    }
  }
  return area > 0 ? sum / area : 0;
}

SurfaceMesh::FaceMean SurfaceMesh::MeanOn(const MeshFace& face) const {
  FaceMean corners;
  FaceMean middles;
  const auto add = [](const Irradiance& irradiance, FaceMean& sums) {
    sums.all += LuminanceOf(irradiance);
    sums.direct += static_cast<double>(irradiance.direct);
  };
  for (std::size_t i = 0; i < 3; ++i) {
    const std::uint32_t from = face.vertices[i];
    add(*vertices_[from].irradiance, corners);
    add(*NodeOf(face, from, face.vertices[(i + 1) % 3]).irradiance, middles);
  }
  // Of a quadratic function; of four linear ones, between corners and middles.
  if (elements_ == MeshElements::kQuadratic) return {middles.all / 3, middles.direct / 3};
  return {(corners.all + 3 * middles.all) / 12, (corners.direct + 3 * middles.direct) / 12};
}

void SurfaceMesh::AddUnlikeSurvey(double tolerance, double floor, std::set<Pair>& places) const {
  struct Sums {
    double flux = 0, direct = 0, area = 0;
  };
  std::vector<Sums> sums(surveys_.size());
  for (const MeshFace& face : faces_) {
    const double area = AreaOf(face);
    const FaceMean mean = MeanOn(face);
    Sums& of = sums[face.survey];
    of.flux += area * mean.all;
    of.direct += area * mean.direct;
    of.area += area;
  }
  const double shortest = elements_ == MeshElements::kQuadratic ? 2 * spacing_ : spacing_;
  for (const MeshFace& face : faces_) {
    const Survey& survey = surveys_[face.survey];
    if (!survey.is_flat) continue;
    const Sums& of = sums[face.survey];
    const double mean = of.flux / of.area;
    const double surveyed = LuminanceOf(survey.mean);
    const double difference = std::abs(mean - surveyed);
    const auto noise = static_cast<double>(survey.mean.noise);
    // Where nothing arrived, nothing is known of the noise either.
    const bool differs = noise > 0 && difference > kSurveyDeviations * noise &&
                         difference >= tolerance * std::max({mean, surveyed, floor});
    // Of direct light a few samples that are far brighter tell more than their mean's noise.
    const double direct = of.direct / of.area;
    const bool lacks_direct =
        static_cast<double>(survey.mean.direct) - direct > kMissedShare * std::max(direct, floor);
    if (!differs && !lacks_direct) continue;
    for (int edge = 0; edge < 3; ++edge) {
      const Pair vertices = EdgeOf(face, edge);
      if (LengthOf(vertices) > shortest) places.insert(PlacesOf(vertices));
    }
  }
}

StatusOr<std::size_t> SurfaceMesh::Refine(double tolerance) {
  const double floor = kDarkShare * MeanIrradiance();
  std::set<Pair> places;
  const bool is_quadratic = elements_ == MeshElements::kQuadratic;
  for (const AskedProbe& asked : asked_probes_) {
    const Pair& edge = asked.edge;
    // Quadratic elements have the middle as a node.
    if (is_quadratic == (asked.point == 0)) continue;
    const Irradiance& at_point = *PointOf(asked).irradiance;
    // Of the nearer end, the middle and the other end.
    const bool is_nearer_second = asked.point == 2;
    const Irradiance& at_near = *vertices_[is_nearer_second ? edge.second : edge.first].irradiance;
    const Irradiance& at_middle = *probes_.at(edge).middle.irradiance;
    const Irradiance& at_far = *vertices_[is_nearer_second ? edge.first : edge.second].irradiance;
    const std::array<double, 3> weights =
        is_quadratic ? std::array{0.375, 0.75, -0.125} : std::array{0.5, 0.0, 0.5};
    const double value = LuminanceOf(at_point);
    const double expected = weights[0] * LuminanceOf(at_near) +
                            weights[1] * LuminanceOf(at_middle) + weights[2] * LuminanceOf(at_far);
    const double difference = std::abs(value - expected);
    const double noise = std::sqrt(std::pow(static_cast<double>(at_point.noise), 2) +
                                   std::pow(weights[0] * static_cast<double>(at_near.noise), 2) +
                                   std::pow(weights[1] * static_cast<double>(at_middle.noise), 2) +
                                   std::pow(weights[2] * static_cast<double>(at_far.noise), 2));
    const bool is_noise = tolerance > 0 && difference <= kNoiseDeviations * noise;
    if (!is_noise && difference >= tolerance * std::max({value, expected, floor})) {
      places.insert(PlacesOf(edge));
    }
  }
  if (!surveys_.empty() && tolerance > 0) AddUnlikeSurvey(tolerance, floor, places);
  const std::size_t count = places.size();
  if (count > 0) LUCERNA_RETURN_IF_ERROR(Split(std::move(places)));
  return count;
}

std::size_t SurfaceMesh::Decimate(double tolerance, double longest) {
  std::vector<MeasuredPoint> points;
  for (const auto& [edge, probe] : probes_) {
    if (probe.is_used || !probe.middle.irradiance) continue;
    const double length = LengthOf(edge);
    points.push_back({edge, LuminanceOf(*probe.middle.irradiance), length * length});
  }
  DecimationRules rules;
  rules.tolerance = tolerance;
  rules.floor = kDarkShare * MeanIrradiance();
  rules.longest = longest;
  rules.flatness = kInset * spacing_;
  for (const MeshSurface& surface : surfaces_)
    rules.is_kept_whole.push_back(surface.ball.has_value());
  Decimation done = DecimateMesh(vertices_, faces_, points, rules);
  faces_ = std::move(done.faces);
  remainders_.emplace();
  for (const Decimation::Difference& of : done.differences)
    remainders_->push_back({of.value, of.weight});
  return done.removed;
}

double SurfaceMesh::InterpolationError() const {
  double sum = 0;
  double weight = 0;
  const auto add = [&](double difference, double of_point) {
    sum += of_point * difference * difference;
    weight += of_point;
  };
  if (remainders_) {
    for (const Remainder& of : *remainders_)
      add(of.difference, of.weight);
  } else {
    for (const auto& [edge, probe] : probes_) {
      if (probe.is_used || !probe.middle.irradiance) continue;
      const auto& a = vertices_[edge.first].irradiance;
      const auto& b = vertices_[edge.second].irradiance;
      if (!a || !b) continue;
      const double length = LengthOf(edge);
      const double middle = LuminanceOf(*probe.middle.irradiance);
      if (elements_ == MeshElements::kLinear) {
        add(middle - (LuminanceOf(*a) + LuminanceOf(*b)) / 2, length * length);
        continue;
      }
      if (!probe.quarters) continue;
      for (const std::size_t quarter : {0U, 1U}) {
        const auto& at = (*probe.quarters)[quarter].irradiance;
        if (!at) continue;
        const double near = LuminanceOf(quarter == 0 ? *a : *b);
        const double far = LuminanceOf(quarter == 0 ? *b : *a);
        add(LuminanceOf(*at) - (0.375 * near + 0.75 * middle - 0.125 * far), length * length / 2);
      }
    }
  }
  const double mean = MeanIrradiance();
  return weight > 0 && mean > 0 ? std::sqrt(sum / weight) / mean : 0;
}

}  // namespace lucerna
