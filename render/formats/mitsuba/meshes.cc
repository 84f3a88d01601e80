#include "render/formats/mitsuba/meshes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <string>
#include <tuple>

#include <tiny_obj_loader.h>
#include <zlib.h>

#include "render/base/text.h"
#include "render/math/double3.h"

namespace lucerna {
namespace {

// What a vertex of an OBJ file is made of.
using ObjCorner = std::tuple<int, int, int>;  // position, normal, texture coordinates

// Numbers of a serialized mesh as they are unpacked.
class Inflating {
 public:
  explicit Inflating(std::string_view bytes) {
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream_.avail_in = static_cast<uInt>(std::min<std::size_t>(bytes.size(), UINT32_MAX));
    is_good_ = inflateInit(&stream_) == Z_OK;
  }
  ~Inflating() { inflateEnd(&stream_); }
  Inflating(const Inflating&) = delete;
  Inflating& operator=(const Inflating&) = delete;

  // False when the stream has not as many bytes.
  bool Read(void* to, std::size_t size) {
    auto* at = static_cast<Bytef*>(to);
    while (size > 0 && is_good_) {
      const auto part = static_cast<uInt>(std::min<std::size_t>(size, 1U << 30U));
      stream_.next_out = at;
      stream_.avail_out = part;
      const int result = inflate(&stream_, Z_NO_FLUSH);
      const std::size_t done = part - stream_.avail_out;
      at += done;
      size -= done;
      if (size > 0 && (result != Z_OK || done == 0)) is_good_ = false;
    }
    return is_good_;
  }
  template <typename Number>
  Number Next() {
    Number number{};
    Read(&number, sizeof(number));
    return number;
  }
  [[nodiscard]] bool is_good() const { return is_good_; }

 private:
  z_stream stream_{};
  bool is_good_ = false;
};

constexpr std::uint16_t kSerializedMagic = 0x041C;
// In the flags of a serialized mesh.
constexpr std::uint32_t kHasNormals = 0x1;
constexpr std::uint32_t kHasUvs = 0x2;
constexpr std::uint32_t kHasColors = 0x8;
constexpr std::uint32_t kIsDouble = 0x2000;

template <typename Number>
Number NumberAt(std::string_view bytes, std::size_t at) {
  Number number{};
  std::memcpy(&number, bytes.data() + at, sizeof(number));
  return number;
}

// The file's part that holds the `index`th mesh.
StatusOr<std::string_view> PartOf(std::string_view bytes, std::uint64_t index) {
  constexpr std::size_t kHeader = 4;
  if (bytes.size() < 2 * kHeader || NumberAt<std::uint16_t>(bytes, 0) != kSerializedMagic)
    return absl::InvalidArgumentError("is no serialized mesh");
  const auto version = NumberAt<std::uint16_t>(bytes, 2);
  if (version != 3 && version != 4)
    return absl::InvalidArgumentError(Concat("has version ", version, ", not 3 or 4"));
  if (index == 0) return bytes;
  // A table at the end: where each mesh begins, and how many there are.
  const std::size_t width = version == 4 ? 8 : 4;
  const auto count = NumberAt<std::uint32_t>(bytes, bytes.size() - 4);
  if (index >= count || count > (bytes.size() - 4) / width)
    return absl::InvalidArgumentError(Concat("has no mesh number ", index));
  const std::size_t at = bytes.size() - 4 - width * (count - index);
  const std::uint64_t begin =
      width == 8 ? NumberAt<std::uint64_t>(bytes, at) : NumberAt<std::uint32_t>(bytes, at);
  if (begin > bytes.size() - kHeader) return absl::InvalidArgumentError("has a damaged table");
  return bytes.substr(begin);
}

bool ReadFloats(Inflating& stream, bool is_double, std::size_t count, float* to) {
  if (!is_double) return stream.Read(to, count * sizeof(float));
  for (std::size_t i = 0; i < count; ++i)
    to[i] = static_cast<float>(stream.Next<double>());
  return stream.is_good();
}

// Removes what no surface can have, or says that it cannot.
Status CheckMesh(TriangleMesh& mesh) {
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    if (!IsFinite(mesh.positions[i]))
      return absl::InvalidArgumentError(Concat("the position of vertex ", i, " is not finite"));
  }
  for (const std::uint32_t index : mesh.indices) {
    if (index >= mesh.positions.size()) {
      return absl::InvalidArgumentError(
          Concat("a triangle refers to vertex ", index, " of ", mesh.positions.size()));
    }
  }
  for (Vec3& normal : mesh.normals) {
    const float size = MaxAbs(normal);
    normal = size > 0 && std::isfinite(size) ? Normalize(normal / size) : Vec3{};
  }
  for (Vec2& uv : mesh.uvs) {
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) uv = {};
  }
  return absl::OkStatus();
}

}  // namespace

std::vector<std::string> MaterialsOfObj(std::string_view bytes) {
  std::set<std::string> names;
  constexpr std::string_view kBegin = "usemtl";
  for (std::size_t at = bytes.find(kBegin); at != std::string_view::npos;
       at = bytes.find(kBegin, at)) {
    const std::size_t line = bytes.find_last_of("\r\n", at);
    const std::size_t begin = line == std::string_view::npos ? 0 : line + 1;
    const bool begins_line =
        bytes.substr(begin, at - begin).find_first_not_of(" \t") == std::string_view::npos;
    at += kBegin.size();
    const std::string_view rest = bytes.substr(at, bytes.find_first_of("\r\n", at) - at);
    const std::vector<std::string_view> words = WordsOf(rest);
    if (begins_line && !words.empty()) names.emplace(words.front());
  }
  return {names.begin(), names.end()};
}

StatusOr<TriangleMesh> ParseObj(std::string_view bytes) {
  LUCERNA_ASSIGN_OR_RETURN(std::vector<TriangleMesh> parts, ParseObjParts(bytes, {}));
  return std::move(parts.front());
}

StatusOr<std::vector<TriangleMesh>> ParseObjParts(std::string_view bytes,
                                                  std::span<const std::string> materials) {
  tinyobj::ObjReaderConfig config;
  config.triangulate = true;
  tinyobj::ObjReader reader;
  // The file of materials is not read: names are all that is asked for.
  std::string text(bytes);
  std::string names;
  for (const std::string& material : materials)
    names += Concat("newmtl ", material, "\n");
  if (!materials.empty()) text.insert(0, "mtllib names\n");
  if (!reader.ParseFromString(text, names, config))
    return absl::InvalidArgumentError(Concat("is no usable OBJ file: ", reader.Error()));
  const tinyobj::attrib_t& attributes = reader.GetAttrib();
  const auto has = [](const std::vector<tinyobj::real_t>& numbers, int index, std::size_t width) {
    return index >= 0 && (static_cast<std::size_t>(index) + 1) * width <= numbers.size();
  };
  const auto at = [](const std::vector<tinyobj::real_t>& numbers, int index, std::size_t width,
                     std::size_t i) {
    return static_cast<float>(numbers[static_cast<std::size_t>(index) * width + i]);
  };
  bool has_normals = true;
  bool has_uvs = false;
  for (const tinyobj::shape_t& shape : reader.GetShapes()) {
    for (const tinyobj::index_t& corner : shape.mesh.indices) {
      has_normals = has_normals && has(attributes.normals, corner.normal_index, 3);
      has_uvs = has_uvs || has(attributes.texcoords, corner.texcoord_index, 2);
    }
  }
  std::vector<TriangleMesh> parts(1 + materials.size());
  std::vector<std::map<ObjCorner, std::uint32_t>> vertices(parts.size());
  const auto part_of = [&](int material) -> std::size_t {
    if (material < 0 || static_cast<std::size_t>(material) >= reader.GetMaterials().size())
      return 0;
    const std::string& name = reader.GetMaterials()[static_cast<std::size_t>(material)].name;
    const auto found = std::ranges::find(materials, name);
    return found == materials.end() ? 0 : 1 + static_cast<std::size_t>(found - materials.begin());
  };
  for (const tinyobj::shape_t& shape : reader.GetShapes()) {
    // Polygons are split; should one have been left whole, its corners would be taken for those of
    // triangles.
    for (const auto corners : shape.mesh.num_face_vertices) {
      if (corners != 3) return absl::InvalidArgumentError("has a face that cannot be split");
    }
    for (std::size_t i = 0; i < shape.mesh.indices.size(); ++i) {
      const tinyobj::index_t& corner = shape.mesh.indices[i];
      const std::size_t part = materials.empty() ? 0 : part_of(shape.mesh.material_ids.at(i / 3));
      TriangleMesh& mesh = parts[part];
      if (!has(attributes.vertices, corner.vertex_index, 3))
        return absl::InvalidArgumentError("has a face that refers to a vertex that is not there");
      const bool has_uv = has(attributes.texcoords, corner.texcoord_index, 2);
      const ObjCorner key = {corner.vertex_index, has_normals ? corner.normal_index : -1,
                             has_uv ? corner.texcoord_index : -1};
      const auto [vertex, is_new] =
          vertices[part].try_emplace(key, static_cast<std::uint32_t>(mesh.positions.size()));
      mesh.indices.push_back(vertex->second);
      if (!is_new) continue;
      const auto vec3 = [&](const std::vector<tinyobj::real_t>& numbers, int index) {
        return Vec3{at(numbers, index, 3, 0), at(numbers, index, 3, 1), at(numbers, index, 3, 2)};
      };
      mesh.positions.push_back(vec3(attributes.vertices, corner.vertex_index));
      if (has_normals) mesh.normals.push_back(vec3(attributes.normals, corner.normal_index));
      if (has_uv) {
        mesh.uvs.push_back({at(attributes.texcoords, corner.texcoord_index, 2, 0),
                            at(attributes.texcoords, corner.texcoord_index, 2, 1)});
      } else if (has_uvs) {
        mesh.uvs.emplace_back();
      }
    }
  }
  bool is_empty = true;
  for (TriangleMesh& mesh : parts) {
    is_empty = is_empty && mesh.indices.empty();
    LUCERNA_RETURN_IF_ERROR(CheckMesh(mesh));
  }
  if (is_empty) return absl::InvalidArgumentError("has no faces");
  return parts;
}

StatusOr<TriangleMesh> ParseSerialized(std::string_view bytes, std::uint64_t index,
                                       std::uint64_t max_size_bytes) {
  LUCERNA_ASSIGN_OR_RETURN(const std::string_view part, PartOf(bytes, index));
  const auto version = NumberAt<std::uint16_t>(bytes, 2);
  Inflating stream(part.substr(4));
  const auto flags = stream.Next<std::uint32_t>();
  // Its name.
  while (version == 4 && stream.is_good() && stream.Next<char>() != 0) {
  }
  const auto vertices = stream.Next<std::uint64_t>();
  const auto triangles = stream.Next<std::uint64_t>();
  const Status cut_off = absl::InvalidArgumentError("is cut off or damaged");
  // No stream unpacks to more than about a thousand times its size.
  constexpr std::uint64_t kMostUnpacked = 1032;
  const std::uint64_t most = kMostUnpacked * part.size() / 12;
  if (!stream.is_good() || vertices > most || triangles > most || vertices > UINT32_MAX)
    return cut_off;
  if ((vertices * (2 * sizeof(Vec3) + sizeof(Vec2)) + triangles * 12) > max_size_bytes)
    return absl::ResourceExhaustedError("has more vertices than there is memory for");
  TriangleMesh mesh;
  static_assert(sizeof(Vec3) == 3 * sizeof(float) && sizeof(Vec2) == 2 * sizeof(float));
  const bool is_double = (flags & kIsDouble) != 0;
  mesh.positions.resize(vertices);
  bool is_whole =
      vertices == 0 || ReadFloats(stream, is_double, 3 * vertices, &mesh.positions[0].x);
  if ((flags & kHasNormals) != 0 && vertices > 0) {
    mesh.normals.resize(vertices);
    is_whole = is_whole && ReadFloats(stream, is_double, 3 * vertices, &mesh.normals[0].x);
  }
  if ((flags & kHasUvs) != 0 && vertices > 0) {
    mesh.uvs.resize(vertices);
    is_whole = is_whole && ReadFloats(stream, is_double, 2 * vertices, &mesh.uvs[0].x);
  }
  if ((flags & kHasColors) != 0 && is_whole) {
    std::vector<float> colors(3 * vertices);
    is_whole = vertices == 0 || ReadFloats(stream, is_double, 3 * vertices, colors.data());
  }
  mesh.indices.resize(3 * triangles);
  is_whole =
      is_whole && stream.Read(mesh.indices.data(), mesh.indices.size() * sizeof(std::uint32_t));
  if (!is_whole) return cut_off;
  LUCERNA_RETURN_IF_ERROR(CheckMesh(mesh));
  return mesh;
}

TriangleMesh UnitSquare() {
  TriangleMesh mesh;
  mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
  mesh.normals.assign(4, {0, 0, 1});
  mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh.indices = {0, 1, 2, 0, 2, 3};
  return mesh;
}

TriangleMesh UnitCube() {
  // The directions in which u and v grow on each side, as in Mitsuba.
  struct Side {
    Vec3 normal, u, v;
  };
  constexpr std::array kSides = {
      Side{{1, 0, 0}, {0, 1, 0}, {0, 0, -1}},  Side{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
      Side{{0, 1, 0}, {-1, 0, 0}, {0, 0, -1}}, Side{{0, -1, 0}, {0, 0, 1}, {1, 0, 0}},
      Side{{0, 0, 1}, {0, 1, 0}, {1, 0, 0}},   Side{{0, 0, -1}, {0, -1, 0}, {1, 0, 0}}};
  TriangleMesh mesh;
  for (const Side& side : kSides) {
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const Vec2 uv : {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}, Vec2{0, 1}}) {
      mesh.positions.push_back(side.normal + side.u * (2 * uv.x - 1) + side.v * (2 * uv.y - 1));
      mesh.normals.push_back(side.normal);
      mesh.uvs.push_back(uv);
    }
    // Around the normal from u to v, or the other way.
    const bool is_right_handed = Dot(Cross(side.u, side.v), side.normal) > 0;
    for (const std::uint32_t corner : {0U, 1U, 2U, 0U, 2U, 3U})
      mesh.indices.push_back(first + (is_right_handed ? corner : 3 - corner));
  }
  return mesh;
}

void ComputeNormals(TriangleMesh& mesh) {
  std::vector<Double3> sums(mesh.positions.size());
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const std::array<Double3, 3> corners = {Double3(mesh.positions[mesh.indices[i]]),
                                            Double3(mesh.positions[mesh.indices[i + 1]]),
                                            Double3(mesh.positions[mesh.indices[i + 2]])};
    const Double3 cross = Cross(corners[1] - corners[0], corners[2] - corners[0]);
    const double size = Length(cross);
    if (!(size > 0)) continue;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Double3 a = corners[(corner + 1) % 3] - corners[corner];
      const Double3 b = corners[(corner + 2) % 3] - corners[corner];
      const double angle = std::atan2(size, Dot(a, b));
      sums[mesh.indices[i + corner]] = sums[mesh.indices[i + corner]] + cross * (angle / size);
    }
  }
  mesh.normals.assign(mesh.positions.size(), {});
  for (std::size_t i = 0; i < sums.size(); ++i) {
    const double size = Length(sums[i]);
    if (size > 0) mesh.normals[i] = ToFloat(sums[i] * (1 / size));
  }
}

}  // namespace lucerna
