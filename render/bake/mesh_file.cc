#include "render/bake/mesh_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <map>
#include <optional>
#include <utility>

#include "absl/strings/str_format.h"
#include <nlohmann/json.hpp>

#include "render/base/text.h"
#include "render/base/version.h"
#include "render/formats/asset_reader.h"
#include "render/formats/diagnostic.h"
#include "render/formats/gltf/accessors.h"
#include "render/formats/gltf/document.h"
#include "render/math/double3.h"
#include "render/scene/scene_files.h"

namespace lucerna {
namespace {

static_assert(std::endian::native == std::endian::little);

// Of glTF 2.0.
constexpr int kFloat = 5126;
constexpr int kUnsignedInt = 5125;
constexpr int kArrayBuffer = 34962;
constexpr int kElementArrayBuffer = 34963;
// What is this many times as bright as the mean is white for viewers.
constexpr double kWhite = 4;
// How its `extras` name elements.
constexpr const char* kQuadraticElements = "quadratic";
constexpr const char* kLinearElements = "linear";

template <typename Values>
void Append(std::string& bytes, const Values& values) {
  if (!values.empty()) {
    bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(values[0]));
  }
}

void AppendUint32(std::string& bytes, std::size_t value) {
  const auto word = static_cast<std::uint32_t>(value);
  std::array<char, sizeof(word)> raw{};
  std::memcpy(raw.data(), &word, sizeof(word));
  bytes.append(raw.data(), raw.size());
}

// Without line ends, which would end a comment.
std::string OneLine(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c == '\n' || c == '\r'; }, ' ');
  return text;
}

double MeanOf(const BakedMesh& mesh) {
  double sum = 0;
  double count = 0;
  for (const BakedMesh::Surface& surface : mesh.surfaces) {
    for (const Rgb irradiance : surface.irradiance)
      sum += static_cast<double>(Luminance(irradiance));
    count += static_cast<double>(surface.irradiance.size());
  }
  return count > 0 ? sum / count : 0;
}

// Builds the parts of a glTF file that lie in its one buffer.
class Buffer {
 public:
  template <typename T>
  std::size_t Add(const std::vector<T>& values, const char* type, int component, int target) {
    views_.push_back({{"buffer", 0},
                      {"byteOffset", bytes_.size()},
                      {"byteLength", values.size() * sizeof(T)},
                      {"target", target}});
    Append(bytes_, values);
    accessors_.push_back({{"bufferView", views_.size() - 1},
                          {"componentType", component},
                          {"count", values.size()},
                          {"type", type}});
    return accessors_.size() - 1;
  }
  // glTF asks for the box of positions.
  std::size_t AddPositions(const std::vector<Vec3>& positions) {
    const std::size_t accessor = Add(positions, "VEC3", kFloat, kArrayBuffer);
    Bounds box;
    for (const Vec3 position : positions)
      box.Add(position);
    accessors_.back()["min"] = {box.low.x, box.low.y, box.low.z};
    accessors_.back()["max"] = {box.high.x, box.high.y, box.high.z};
    return accessor;
  }

  [[nodiscard]] const std::string& bytes() const { return bytes_; }
  [[nodiscard]] const nlohmann::ordered_json& views() const { return views_; }
  [[nodiscard]] const nlohmann::ordered_json& accessors() const { return accessors_; }

 private:
  std::string bytes_;
  nlohmann::ordered_json views_ = nlohmann::ordered_json::array();
  nlohmann::ordered_json accessors_ = nlohmann::ordered_json::array();
};

// A .glb file names no other files.
class NoFiles final : public SceneFiles {
 public:
  [[nodiscard]] StatusOr<std::string> Read(const std::string& logical_path) override {
    return absl::NotFoundError(Concat(logical_path, " is not read"));
  }
};

// One primitive. False: an error, which is in the diagnostics.
bool ReadSurface(const JsonObject& primitive, GltfBuffers& buffers, BakedMesh::Surface& surface) {
  const JsonObject attributes = primitive.Child("attributes");
  if (!attributes.Has("_IRRADIANCE")) {
    primitive.Error("has no attribute _IRRADIANCE; give a file that lucerna bake has written");
    return false;
  }
  const auto open = [&](const JsonObject& object, const char* name,
                        GltfUse use) -> const GltfAccessor* {
    const std::optional<std::size_t> index = object.Index(name, "accessors");
    if (!index) {
      if (!object.Has(name)) object.Error(Concat("needs ", name));
      return nullptr;
    }
    return buffers.Open(*index, use);
  };
  const GltfAccessor* const positions = open(attributes, "POSITION", GltfUse::kVec3);
  const GltfAccessor* const normals = open(attributes, "NORMAL", GltfUse::kVec3);
  const GltfAccessor* const irradiance = open(attributes, "_IRRADIANCE", GltfUse::kVec3);
  const GltfAccessor* const indices = open(primitive, "indices", GltfUse::kIndices);
  const GltfAccessor* const noise = open(attributes, "_NOISE", GltfUse::kScalar);
  if (!positions || !normals || !irradiance || !noise || !indices) return false;
  const std::size_t count = positions->count();
  if (normals->count() != count || irradiance->count() != count || noise->count() != count ||
      indices->count() % 3 != 0) {
    primitive.Error("has columns of different lengths");
    return false;
  }
  const auto vector_of = [](const std::array<double, 4>& v) {
    return ToFloat(Double3(v[0], v[1], v[2]));
  };
  for (std::size_t i = 0; i < count; ++i) {
    surface.positions.push_back(vector_of(positions->At(i)));
    surface.normals.push_back(vector_of(normals->At(i)));
    const Vec3 e = vector_of(irradiance->At(i));
    surface.irradiance.push_back({e.x, e.y, e.z});
    surface.noise.push_back(static_cast<float>(noise->At(i)[0]));
    if (!IsFinite(surface.positions.back()) || !IsFinite(surface.normals.back()) || !IsFinite(e) ||
        !std::isfinite(surface.noise.back())) {
      primitive.Error(Concat("vertex ", i, " is not finite"));
      return false;
    }
  }
  for (std::size_t i = 0; i < indices->count(); i += 3) {
    auto& face = surface.faces.emplace_back();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      face[corner] = indices->WholeAt(i + corner);
      if (face[corner] < count) continue;
      primitive.Error(Concat("refers to vertex ", face[corner], " of ", count));
      return false;
    }
  }
  return true;
}

}  // namespace

BakedMesh BakedMeshOf(const SurfaceMesh& mesh) {
  using Corners = std::array<std::uint32_t, 3>;
  BakedMesh baked;
  baked.is_quadratic = mesh.elements() == MeshElements::kQuadratic;
  // Of the surfaces of `mesh`, where they are in `baked`.
  std::map<std::uint32_t, std::size_t> at;
  std::map<std::uint32_t, std::uint32_t> vertex_at;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> node_at;  // by ends of edges
  for (const MeshFace& face : mesh.faces()) {
    const auto [found, is_new] = at.try_emplace(face.surface, baked.surfaces.size());
    if (is_new) {
      const MeshSurface& surface = mesh.surfaces()[face.surface];
      BakedMesh::Surface& added = baked.surfaces.emplace_back();
      added.name = NameOf(surface);
      added.material = surface.name;
    }
    BakedMesh::Surface& to = baked.surfaces[found->second];
    const auto add = [&](const MeshVertex& vertex, const Irradiance& irradiance) {
      to.positions.push_back(vertex.position);
      to.normals.push_back(vertex.normal);
      to.irradiance.push_back(irradiance.value);
      to.noise.push_back(irradiance.noise);
      return static_cast<std::uint32_t>(to.positions.size() - 1);
    };
    Corners corners{};
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const std::uint32_t number = face.vertices[i];
      const MeshVertex& vertex = mesh.vertices()[number];
      if (face.bucket) {
        corners[i] = add(vertex, *face.bucket);
        continue;
      }
      const auto [known, is_first] = vertex_at.try_emplace(number, 0);
      if (is_first) known->second = add(vertex, *vertex.irradiance);
      corners[i] = known->second;
    }
    if (!baked.is_quadratic || face.bucket) {
      to.faces.push_back(corners);
      continue;
    }
    Corners nodes{};  // of the edges from each corner to the next
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const std::uint32_t from = face.vertices[i];
      const std::uint32_t end = face.vertices[(i + 1) % 3];
      const auto [known, is_first] = node_at.try_emplace(std::minmax(from, end), 0);
      if (is_first) {
        const MeshVertex node = mesh.NodeOf(face, from, end);
        known->second = add(node, *node.irradiance);
      }
      nodes[i] = known->second;
    }
    const auto [a, b, c] = corners;
    const auto [ab, bc, ca] = nodes;
    to.faces.insert(to.faces.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return baked;
}

std::string MeshPly(const BakedMesh& mesh, bool is_ascii) {
  std::size_t vertices = 0;
  std::size_t faces = 0;
  for (const BakedMesh::Surface& surface : mesh.surfaces) {
    vertices += surface.positions.size();
    faces += surface.faces.size();
  }
  std::string bytes = Concat("ply\nformat ", is_ascii ? "ascii" : "binary_little_endian",
                             " 1.0\ncomment irradiance of ", OneLine(mesh.scene), " by lucerna ",
                             Version(), ", W/m^2\nelement vertex ", vertices, "\n");
  for (const char* name :
       {"x", "y", "z", "nx", "ny", "nz", "irradiance_r", "irradiance_g", "irradiance_b", "noise"}) {
    bytes += Concat("property float ", name, "\n");
  }
  bytes += Concat("element face ", faces, "\nproperty list uchar int vertex_indices\nend_header\n");
  for (const BakedMesh::Surface& surface : mesh.surfaces) {
    for (std::size_t i = 0; i < surface.positions.size(); ++i) {
      const Vec3 p = surface.positions[i];
      const Vec3 n = surface.normals[i];
      const Rgb e = surface.irradiance[i];
      const std::array<float, 10> row = {p.x, p.y, p.z, n.x, n.y,
                                         n.z, e.r, e.g, e.b, surface.noise[i]};
      if (!is_ascii) {
        Append(bytes, row);
        continue;
      }
      for (std::size_t column = 0; column < row.size(); ++column) {
        // Nine digits read back as the same float.
        absl::StrAppendFormat(&bytes, "%s%.9g", column == 0 ? "" : " ", row[column]);
      }
      bytes += '\n';
    }
  }
  std::uint32_t first = 0;
  for (const BakedMesh::Surface& surface : mesh.surfaces) {
    for (const auto& face : surface.faces) {
      const std::array<std::uint32_t, 3> corners = {first + face[0], first + face[1],
                                                    first + face[2]};
      if (is_ascii) {
        bytes += Concat("3 ", corners[0], " ", corners[1], " ", corners[2], "\n");
      } else {
        bytes += '\x03';
        Append(bytes, corners);
      }
    }
    first += static_cast<std::uint32_t>(surface.positions.size());
  }
  return bytes;
}

std::string MeshGlb(const BakedMesh& mesh) {
  using Json = nlohmann::ordered_json;
  const double mean = MeanOf(mesh);
  const auto scale = static_cast<float>(mean > 0 ? 1 / (kWhite * mean) : 0);
  Buffer buffer;
  Json meshes = Json::array();
  Json nodes = Json::array();
  Json roots = Json::array();
  for (const BakedMesh::Surface& surface : mesh.surfaces) {
    std::vector<std::array<float, 4>> colors;
    colors.reserve(surface.irradiance.size());
    for (const Rgb irradiance : surface.irradiance) {
      const auto shown = [&](float value) { return std::clamp(value * scale, 0.0F, 1.0F); };
      colors.push_back({shown(irradiance.r), shown(irradiance.g), shown(irradiance.b), 1});
    }
    Json attributes;
    attributes["POSITION"] = buffer.AddPositions(surface.positions);
    attributes["NORMAL"] = buffer.Add(surface.normals, "VEC3", kFloat, kArrayBuffer);
    attributes["COLOR_0"] = buffer.Add(colors, "VEC4", kFloat, kArrayBuffer);
    if (!surface.uvs.empty()) {
      attributes["TEXCOORD_0"] = buffer.Add(surface.uvs, "VEC2", kFloat, kArrayBuffer);
    }
    attributes["_IRRADIANCE"] = buffer.Add(surface.irradiance, "VEC3", kFloat, kArrayBuffer);
    attributes["_NOISE"] = buffer.Add(surface.noise, "SCALAR", kFloat, kArrayBuffer);
    std::vector<std::uint32_t> indices;
    indices.reserve(3 * surface.faces.size());
    for (const auto& face : surface.faces)
      indices.insert(indices.end(), face.begin(), face.end());
    const std::size_t index_accessor =
        buffer.Add(indices, "SCALAR", kUnsignedInt, kElementArrayBuffer);
    meshes.push_back({{"name", surface.name},
                      {"extras", {{"material", surface.material}}},
                      {"primitives",
                       {{{"attributes", attributes},
                         {"indices", index_accessor},
                         {"material", 0},
                         {"mode", 4}}}}});
    nodes.push_back({{"mesh", meshes.size() - 1}, {"name", surface.name}});
    roots.push_back(nodes.size() - 1);
  }
  Json file;
  file["asset"] = {{"version", "2.0"}, {"generator", Concat("lucerna ", Version())}};
  file["extensionsUsed"] = {"KHR_materials_unlit"};
  file["scene"] = 0;
  file["scenes"] = {{{"nodes", roots}}};
  file["nodes"] = nodes;
  file["meshes"] = meshes;
  file["materials"] = {{{"name", "irradiance"},
                        {"doubleSided", true},
                        {"pbrMetallicRoughness", {{"metallicFactor", 0}}},
                        {"extensions", {{"KHR_materials_unlit", Json::object()}}}}};
  file["accessors"] = buffer.accessors();
  file["bufferViews"] = buffer.views();
  file["buffers"] = {{{"byteLength", buffer.bytes().size()}}};
  file["extras"] = {{"irradiance_unit", "W/m^2"},
                    {"scene", mesh.scene},
                    {"spacing", mesh.spacing},
                    {"elements", mesh.is_quadratic ? kQuadraticElements : kLinearElements},
                    {"indirect_only", mesh.is_indirect},
                    {"relative_error", mesh.estimate}};

  std::string json = file.dump(-1, ' ', false, Json::error_handler_t::replace);
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::size_t binary = buffer.bytes().size();  // of floats and integers: a multiple of 4
  std::string bytes = "glTF";
  AppendUint32(bytes, 2);
  AppendUint32(bytes, 12 + 8 + json.size() + 8 + binary);
  AppendUint32(bytes, json.size());
  bytes += "JSON";
  bytes += json;
  AppendUint32(bytes, binary);
  bytes.append("BIN\0", 4);
  bytes += buffer.bytes();
  return bytes;
}

StatusOr<BakedMesh> ReadMeshGlb(const std::string& path, std::string_view bytes) {
  Diagnostics diagnostics;
  NoFiles no_files;
  AssetReader assets(no_files, {});
  const GltfDocument document(path, bytes, diagnostics);
  BakedMesh mesh;
  if (document.is_readable()) {
    GltfBuffers buffers(document, assets);
    const JsonObject extras = document.Root().Child("extras");
    mesh.scene = extras.String("scene", "");
    mesh.is_indirect = extras.Bool("indirect_only", false);
    mesh.is_quadratic = extras.String("elements", kLinearElements) == kQuadraticElements;
    for (std::size_t i = 0; i < document.Count("meshes"); ++i) {
      const JsonObject of_mesh = document.At("meshes", i);
      for (const JsonObject& primitive : of_mesh.Children("primitives")) {
        BakedMesh::Surface& surface = mesh.surfaces.emplace_back();
        surface.name = of_mesh.String("name", "");
        surface.material = of_mesh.Child("extras").String("material", "");
        if (!ReadSurface(primitive, buffers, surface)) break;
        if (mesh.is_quadratic && surface.faces.size() % 4 != 0) {
          primitive.Error("has quadratic elements that are not four faces each");
        }
      }
      if (diagnostics.has_error()) break;
    }
    if (mesh.surfaces.empty() && !diagnostics.has_error()) {
      document.Root().Error("it has no meshes; give a file that lucerna bake has written");
    }
  }
  if (!diagnostics.has_error()) return mesh;
  return absl::InvalidArgumentError(diagnostics.Take().front().ToString());
}

}  // namespace lucerna
