#include "render/formats/ply_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"

#include "render/base/text.h"
#include "render/formats/gzip.h"

namespace lucerna {
namespace {

Status Bad(std::string_view what) {
  return absl::InvalidArgumentError(Concat("bad PLY file: ", what));
}

enum class Format : std::uint8_t { kAscii, kLittleEndian, kBigEndian };
enum class Scalar : std::uint8_t {
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kFloat,
  kDouble
};

std::size_t SizeOf(Scalar scalar) {
  constexpr std::array<std::size_t, 8> kSizes = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(scalar)];
}

std::optional<Scalar> ScalarNamed(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, Scalar>, 16> kNames = {{
      {"char", Scalar::kInt8},
      {"int8", Scalar::kInt8},
      {"uchar", Scalar::kUint8},
      {"uint8", Scalar::kUint8},
      {"short", Scalar::kInt16},
      {"int16", Scalar::kInt16},
      {"ushort", Scalar::kUint16},
      {"uint16", Scalar::kUint16},
      {"int", Scalar::kInt32},
      {"int32", Scalar::kInt32},
      {"uint", Scalar::kUint32},
      {"uint32", Scalar::kUint32},
      {"float", Scalar::kFloat},
      {"float32", Scalar::kFloat},
      {"double", Scalar::kDouble},
      {"float64", Scalar::kDouble},
  }};
  for (const auto& [known, scalar] : kNames) {
    if (known == name) return scalar;
  }
  return std::nullopt;
}

struct Property {
  std::string name;
  bool is_list = false;
  Scalar count_type = Scalar::kUint8;  // of a list
  Scalar type = Scalar::kFloat;
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  // The fewest bytes that one of these can take.
  [[nodiscard]] std::uint64_t MinSizeBytes(Format format) const {
    // In ASCII a value is a digit and a separator, and an element without values an empty line.
    if (format == Format::kAscii) return std::max<std::uint64_t>(1, 2 * properties.size());
    std::uint64_t size = 0;
    for (const Property& property : properties) {
      size += SizeOf(property.is_list ? property.count_type : property.type);
    }
    return size;
  }
  [[nodiscard]] bool has_list() const {
    return std::any_of(properties.begin(), properties.end(),
                       [](const Property& property) { return property.is_list; });
  }
};

struct Header {
  Format format = Format::kAscii;
  std::vector<Element> elements;
  std::vector<std::string> comments;
  std::size_t body_offset = 0;
};

StatusOr<Header> ParseHeader(std::string_view bytes) {
  constexpr std::size_t kMaxHeaderBytes = 1 << 20;
  Header header;
  bool has_format = false;
  std::size_t position = 0;
  for (int line_number = 1;; ++line_number) {
    const std::size_t end = bytes.substr(0, kMaxHeaderBytes).find('\n', position);
    if (end == std::string_view::npos) return Bad("the header has no end_header line");
    std::string_view line = bytes.substr(position, end - position);
    position = end + 1;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    const auto bad_line = [&](std::string_view what) {
      return Bad(Concat("header line ", line_number, ": ", what));
    };
    if (line_number == 1) {
      if (line != "ply") return Bad("it does not begin with \"ply\"");
      continue;
    }
    const std::vector<std::string_view> words = WordsOf(line);
    if (words.empty() || words[0] == "obj_info") continue;
    if (words[0] == "comment") {
      constexpr std::size_t kWord = std::string_view("comment ").size();
      if (line.size() > kWord) header.comments.emplace_back(line.substr(kWord));
      continue;
    }
    if (words[0] == "end_header") {
      if (!has_format) return Bad("the header has no format line");
      header.body_offset = position;
      return header;
    }
    if (words[0] == "format") {
      if (words.size() != 3 || words[2] != "1.0") return bad_line("the format must be 1.0");
      if (words[1] == "ascii") {
        header.format = Format::kAscii;
      } else if (words[1] == "binary_little_endian") {
        header.format = Format::kLittleEndian;
      } else if (words[1] == "binary_big_endian") {
        header.format = Format::kBigEndian;
      } else {
        return bad_line("unknown format");
      }
      has_format = true;
    } else if (words[0] == "element") {
      Element element;
      if (words.size() != 3 || !absl::SimpleAtoi(ToAbsl(words[2]), &element.count)) {
        return bad_line("an element has a name and a count");
      }
      element.name = std::string(words[1]);
      header.elements.push_back(std::move(element));
    } else if (words[0] == "property") {
      if (header.elements.empty()) return bad_line("a property before any element");
      Property property;
      property.is_list = words.size() == 5 && words[1] == "list";
      if (!property.is_list && words.size() != 3)
        return bad_line("a property has a type and a name");
      const std::optional<Scalar> type = ScalarNamed(words[property.is_list ? 3 : 1]);
      const std::optional<Scalar> count_type =
          property.is_list ? ScalarNamed(words[2]) : Scalar::kUint8;
      if (!type.has_value() || !count_type.has_value() || *count_type == Scalar::kFloat ||
          *count_type == Scalar::kDouble) {
        return bad_line("unknown property type");
      }
      property.type = *type;
      property.count_type = *count_type;
      property.name = std::string(words.back());
      header.elements.back().properties.push_back(std::move(property));
    } else {
      return bad_line("unknown keyword");
    }
  }
}

// The values of the body, one after the other. Reads beyond the end return zeros,
// and is_truncated() says so.
class Body {
 public:
  Body(std::string_view bytes, Format format) : bytes_(bytes), format_(format) {}

  [[nodiscard]] std::size_t remaining() const { return bytes_.size() - position_; }
  [[nodiscard]] std::size_t position() const { return position_; }
  [[nodiscard]] bool is_truncated() const { return is_truncated_; }
  [[nodiscard]] bool is_malformed() const { return is_malformed_; }
  [[nodiscard]] bool ok() const { return !is_truncated_ && !is_malformed_; }

  double Read(Scalar type) {
    if (format_ == Format::kAscii) return ReadText();
    switch (type) {
      case Scalar::kInt8:
        return ReadBinary<std::int8_t>();
      case Scalar::kUint8:
        return ReadBinary<std::uint8_t>();
      case Scalar::kInt16:
        return ReadBinary<std::int16_t>();
      case Scalar::kUint16:
        return ReadBinary<std::uint16_t>();
      case Scalar::kInt32:
        return ReadBinary<std::int32_t>();
      case Scalar::kUint32:
        return ReadBinary<std::uint32_t>();
      case Scalar::kFloat:
        return static_cast<double>(ReadBinary<float>());
      case Scalar::kDouble:
        break;
    }
    return ReadBinary<double>();
  }

  // Binary only: passes over `size_bytes`.
  void Skip(std::uint64_t size_bytes) {
    if (size_bytes > remaining()) {
      is_truncated_ = true;
      return;
    }
    position_ += static_cast<std::size_t>(size_bytes);
  }

 private:
  template <typename T>
  T ReadBinary() {
    if (remaining() < sizeof(T)) {
      is_truncated_ = true;
      return 0;
    }
    std::array<char, sizeof(T)> raw{};
    std::memcpy(raw.data(), bytes_.data() + position_, sizeof(T));
    position_ += sizeof(T);
    if (format_ == Format::kBigEndian) std::reverse(raw.begin(), raw.end());
    return std::bit_cast<T>(raw);
  }

  double ReadText() {
    const char* const end = bytes_.data() + bytes_.size();
    const char* start = bytes_.data() + position_;
    while (start != end && IsSpace(*start))
      ++start;
    const char* stop = start;
    while (stop != end && !IsSpace(*stop))
      ++stop;
    position_ = static_cast<std::size_t>(stop - bytes_.data());
    if (start == stop) {
      is_truncated_ = true;
      return 0;
    }
    double value = 0;
    // absl's reader, unlike from_chars, rounds numbers beyond the range to zero or infinity.
    if (!absl::SimpleAtod({start, static_cast<std::size_t>(stop - start)}, &value)) {
      is_malformed_ = true;
    }
    return value;
  }

  static bool IsSpace(char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; }

  static_assert(std::endian::native == std::endian::little);
  std::string_view bytes_;
  Format format_;
  std::size_t position_ = 0;
  bool is_truncated_ = false;
  bool is_malformed_ = false;
};

void SkipValues(Body& body, Format format, const Property& property, double count) {
  if (!(count >= 0)) return;
  if (format != Format::kAscii) {
    body.Skip(static_cast<std::uint64_t>(count) * SizeOf(property.type));
    return;
  }
  for (double i = 0; i < count && body.ok(); ++i)
    body.Read(property.type);
}

void SkipList(Body& body, Format format, const Property& property) {
  const double count = body.Read(property.count_type);
  SkipValues(body, format, property, count);
}

Status Broken(const Body& body, const Element& element, std::uint64_t index) {
  return Bad(Concat(body.is_truncated() ? "it ends within " : "there is no number in ",
                    element.name, " ", index, " of ", element.count));
}

// Numbers of some of an element's properties, by rows; the others are passed over.
class Rows {
 public:
  Rows(Body& body, Format format, const Element& element, std::span<const std::string_view> names)
      : body_(body), format_(format), element_(element), there_(names.size()) {
    for (const Property& property : element.properties) {
      const auto known = std::ranges::find(names, property.name);
      const bool is_column = known != names.end() && !property.is_list;
      const auto column = static_cast<std::size_t>(known - names.begin());
      columns_.push_back(is_column ? column : names.size());
      if (is_column) there_[column] = true;
    }
    values_.resize(names.size() + 1);  // the last takes what goes nowhere
  }

  [[nodiscard]] bool Has(std::initializer_list<std::size_t> columns) const {
    return std::ranges::all_of(columns, [&](std::size_t column) { return there_[column]; });
  }
  [[nodiscard]] bool IsByte(std::string_view name) const {
    const auto property = std::ranges::find(element_.properties, name, &Property::name);
    return property != element_.properties.end() && property->type == Scalar::kUint8;
  }
  [[nodiscard]] Status Next(std::uint64_t row) {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const Property& property = element_.properties[i];
      if (property.is_list) {
        SkipList(body_, format_, property);
      } else {
        values_[columns_[i]] = static_cast<float>(body_.Read(property.type));
      }
    }
    return body_.ok() ? absl::OkStatus() : Broken(body_, element_, row);
  }
  [[nodiscard]] float operator[](std::size_t column) const { return values_[column]; }
  // Of three columns.
  [[nodiscard]] Vec3 VectorAt(std::size_t first) const {
    return {values_[first], values_[first + 1], values_[first + 2]};
  }

 private:
  Body& body_;
  Format format_;
  const Element& element_;
  std::vector<std::size_t> columns_;  // [properties]
  std::vector<bool> there_;
  std::vector<float> values_;
};

// Of a byte that is coded by sRGB's curve.
float LinearOf(float byte) {
  const float coded = byte / 255;
  return coded <= 0.04045F ? coded / 12.92F : std::pow((coded + 0.055F) / 1.055F, 2.4F);
}

Status ReadVertices(Body& body, Format format, const Element& element, TriangleMesh& mesh,
                    std::vector<float>* spacings = nullptr) {
  constexpr std::array<std::string_view, 21> kColumns = {
      "x",   "y",     "z",    "nx",        "ny",        "nz",        "u",
      "v",   "s",     "t",    "spacing",   "r",         "g",         "b",
      "red", "green", "blue", "texture_u", "texture_v", "texture_s", "texture_t"};
  Rows rows(body, format, element, kColumns);
  if (!rows.Has({0, 1, 2})) return Bad("its vertices have no x, y and z");
  const bool has_normals = rows.Has({3, 4, 5});
  // The column of the first of the two, under any of their names.
  const auto uv_column = [&]() -> std::optional<std::size_t> {
    for (const std::size_t column : {6U, 8U, 17U, 19U}) {
      if (rows.Has({column, column + 1})) return column;
    }
    return std::nullopt;
  }();
  const bool has_spacings = spacings != nullptr && rows.Has({10});
  mesh.positions.resize(element.count);
  if (uv_column.has_value()) mesh.uvs.resize(element.count);
  if (has_normals) mesh.normals.resize(element.count);
  // Numbers, as Mitsuba writes them, or bytes, which are coded as those of images are.
  const bool has_rgb = rows.Has({11, 12, 13});
  const bool has_bytes = !has_rgb && rows.Has({14, 15, 16}) && rows.IsByte("red") &&
                         rows.IsByte("green") && rows.IsByte("blue");
  if (has_rgb || has_bytes) mesh.colors.resize(element.count);
  if (has_spacings) spacings->resize(element.count);
  for (std::uint64_t vertex = 0; vertex < element.count; ++vertex) {
    LUCERNA_RETURN_IF_ERROR(rows.Next(vertex));
    mesh.positions[vertex] = rows.VectorAt(0);
    if (!IsFinite(mesh.positions[vertex])) {
      return Bad(Concat("the position of vertex ", vertex, " is not finite"));
    }
    if (has_normals) {
      const Vec3 normal = rows.VectorAt(3);
      mesh.normals[vertex] = IsFinite(normal) ? normal : Vec3();
    }
    if (uv_column.has_value()) {
      const Vec2 uv = {rows[*uv_column], rows[*uv_column + 1]};
      mesh.uvs[vertex] = std::isfinite(uv.x) && std::isfinite(uv.y) ? uv : Vec2();
    }
    if (has_rgb) {
      const auto held = [](float channel) { return channel > 0 ? std::min(channel, 1.0F) : 0.0F; };
      mesh.colors[vertex] = {held(rows[11]), held(rows[12]), held(rows[13])};
    } else if (has_bytes) {
      mesh.colors[vertex] = {LinearOf(rows[14]), LinearOf(rows[15]), LinearOf(rows[16])};
    }
    if (has_spacings) (*spacings)[vertex] = rows[10];
  }
  return absl::OkStatus();
}

Status ReadSegments(Body& body, Format format, const Element& element,
                    std::vector<std::array<Vec3, 2>>& segments) {
  constexpr std::array<std::string_view, 6> kColumns = {"ax", "ay", "az", "bx", "by", "bz"};
  Rows rows(body, format, element, kColumns);
  if (!rows.Has({0, 1, 2, 3, 4, 5})) return Bad("its segments have no ax, ay, az, bx, by and bz");
  segments.resize(element.count);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    LUCERNA_RETURN_IF_ERROR(rows.Next(i));
    segments[i] = {rows.VectorAt(0), rows.VectorAt(3)};
    if (!IsFinite(segments[i][0]) || !IsFinite(segments[i][1])) {
      return Bad(Concat("segment ", i, " is not finite"));
    }
  }
  return absl::OkStatus();
}

Status ReadFaces(Body& body, Format format, const Element& element, TriangleMesh& mesh,
                 PlyFaces& faces) {
  const auto is_corners = [](const Property& property) {
    return property.is_list &&
           (property.name == "vertex_indices" || property.name == "vertex_index");
  };
  if (element.count > 0 &&
      std::none_of(element.properties.begin(), element.properties.end(), is_corners)) {
    return Bad("its faces have no list vertex_indices");
  }
  mesh.indices.reserve(element.count * 3);
  for (std::uint64_t face = 0; face < element.count; ++face) {
    for (const Property& property : element.properties) {
      if (!property.is_list) {
        body.Read(property.type);
        continue;
      }
      if (!is_corners(property)) {
        SkipList(body, format, property);
        continue;
      }
      const double count = body.Read(property.count_type);
      if (!body.ok()) return Broken(body, element, face);
      if (count < 0 || count != std::floor(count))
        return Bad(Concat("face ", face, " has ", count, " corners"));
      if (count != 3 && count != 4) {
        SkipValues(body, format, property, count);
        ++faces.skipped;
        continue;
      }
      std::array<std::uint32_t, 4> corner{};
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
        const double index = body.Read(property.type);
        if (!body.ok()) return Broken(body, element, face);
        if (!(index >= 0 && index < static_cast<double>(mesh.positions.size())) ||
            index != std::floor(index)) {
          return Bad(
              Concat("face ", face, " refers to vertex ", index, " of ", mesh.positions.size()));
        }
        corner[i] = static_cast<std::uint32_t>(index);
      }
      if (count == 4) faces.quads.push_back(mesh.indices.size() / 3);
      mesh.indices.insert(mesh.indices.end(), {corner[0], corner[1], corner[2]});
      if (count == 4) mesh.indices.insert(mesh.indices.end(), {corner[0], corner[2], corner[3]});
    }
    if (!body.ok()) return Broken(body, element, face);
  }
  return absl::OkStatus();
}

Status ReadBuckets(Body& body, Format format, const Element& element,
                   std::vector<SensorBucket>& buckets) {
  constexpr std::array<std::string_view, 13> kColumns = {"ax", "ay", "az", "bx", "by", "bz", "cx",
                                                         "cy", "cz", "ox", "oy", "oz", "r"};
  Rows rows(body, format, element, kColumns);
  if (!rows.Has({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12})) {
    return Bad("its buckets have no ax, ay, az, bx, by, bz, cx, cy, cz, ox, oy, oz and r");
  }
  buckets.resize(element.count);
  for (std::uint64_t i = 0; i < element.count; ++i) {
    LUCERNA_RETURN_IF_ERROR(rows.Next(i));
    SensorBucket& bucket = buckets[i];
    bucket = {{rows.VectorAt(0), rows.VectorAt(3), rows.VectorAt(6)}, rows.VectorAt(9), rows[12]};
    const bool is_finite =
        std::ranges::all_of(bucket.corners, [](Vec3 corner) { return IsFinite(corner); }) &&
        IsFinite(bucket.ball_center) && std::isfinite(bucket.ball_radius);
    if (!is_finite) return Bad(Concat("bucket ", i, " is not finite"));
  }
  return absl::OkStatus();
}

Status SkipElement(Body& body, Format format, const Element& element) {
  if (element.properties.empty()) return absl::OkStatus();
  if (format != Format::kAscii && !element.has_list()) {
    // No overflow: the counts were checked against the size of the file.
    body.Skip(element.count * element.MinSizeBytes(format));
    return body.ok() ? absl::OkStatus() : Broken(body, element, 0);
  }
  for (std::uint64_t i = 0; i < element.count; ++i) {
    for (const Property& property : element.properties) {
      if (property.is_list) {
        SkipList(body, format, property);
      } else {
        body.Read(property.type);
      }
    }
    if (!body.ok()) return Broken(body, element, i);
  }
  return absl::OkStatus();
}

// The header of a file, of which `bytes` are unpacked into `unpacked` when they are packed. Its
// counts are no more than the size can hold.
StatusOr<Header> Open(std::string_view& bytes, std::string& unpacked) {
  if (IsGzip(bytes)) {
    StatusOr<std::string> inflated = Gunzip(bytes);
    if (!inflated.ok()) return Bad(std::string(inflated.status().message()));
    bytes = unpacked = *std::move(inflated);
  }
  LUCERNA_ASSIGN_OR_RETURN(Header header, ParseHeader(bytes));
  // One element at a time, each against what the ones before it leave: no sum can overflow.
  std::uint64_t left = bytes.size() - header.body_offset;
  for (const Element& element : header.elements) {
    const std::uint64_t size_bytes = element.MinSizeBytes(header.format);
    if (size_bytes == 0) continue;  // has no values, and is never read
    // The last value of an ASCII file may lack its separator.
    const std::uint64_t room = left + (header.format == Format::kAscii ? 1 : 0);
    if (element.count > room / size_bytes) {
      return Bad(Concat("it announces ", element.count, " times ", element.name, ", more than its ",
                        bytes.size(), " bytes can hold"));
    }
    left -= std::min(left, element.count * size_bytes);
  }
  return header;
}

}  // namespace

StatusOr<TriangleMesh> ParsePly(std::string_view bytes, PlyFaces* faces) {
  PlyFaces found;
  std::string unpacked;
  LUCERNA_ASSIGN_OR_RETURN(const Header header, Open(bytes, unpacked));
  TriangleMesh mesh;
  bool has_vertices = false;
  bool has_faces = false;
  Body body(bytes.substr(header.body_offset), header.format);
  for (const Element& element : header.elements) {
    if (element.name == "vertex") {
      if (std::exchange(has_vertices, true)) return Bad("it has two elements vertex");
      if (element.count > 0xFFFFFFFFU) return Bad("it has more than 2^32 vertices");
      LUCERNA_RETURN_IF_ERROR(ReadVertices(body, header.format, element, mesh));
    } else if (element.name == "face") {
      if (!has_vertices) return Bad("its faces come before its vertices");
      if (std::exchange(has_faces, true)) return Bad("it has two elements face");
      LUCERNA_RETURN_IF_ERROR(ReadFaces(body, header.format, element, mesh, found));
    } else {
      LUCERNA_RETURN_IF_ERROR(SkipElement(body, header.format, element));
    }
  }
  if (!has_vertices || !has_faces) return Bad("it has no vertices or no faces");
  if (faces != nullptr) *faces = std::move(found);
  return mesh;
}

StatusOr<PlyPoints> ParsePlyPoints(std::string_view bytes) {
  std::string unpacked;
  LUCERNA_ASSIGN_OR_RETURN(Header header, Open(bytes, unpacked));
  Body body(bytes.substr(header.body_offset), header.format);
  PlyPoints points;
  bool has_vertices = false;
  bool has_segments = false;
  bool has_buckets = false;
  for (const Element& element : header.elements) {
    if (element.count > 0xFFFFFFFFU) {
      return Bad(Concat("it has more than 2^32 times ", element.name));
    }
    if (element.name == "vertex") {
      if (std::exchange(has_vertices, true)) return Bad("it has two elements vertex");
      TriangleMesh mesh;
      LUCERNA_RETURN_IF_ERROR(ReadVertices(body, header.format, element, mesh, &points.spacings));
      if (mesh.normals.empty() && !mesh.positions.empty()) {
        return Bad("its vertices have no nx, ny and nz");
      }
      points.positions = std::move(mesh.positions);
      points.normals = std::move(mesh.normals);
    } else if (element.name == "segment") {
      if (std::exchange(has_segments, true)) return Bad("it has two elements segment");
      LUCERNA_RETURN_IF_ERROR(ReadSegments(body, header.format, element, points.segments));
    } else if (element.name == "bucket") {
      if (std::exchange(has_buckets, true)) return Bad("it has two elements bucket");
      LUCERNA_RETURN_IF_ERROR(ReadBuckets(body, header.format, element, points.buckets));
    } else {
      LUCERNA_RETURN_IF_ERROR(SkipElement(body, header.format, element));
    }
  }
  if (!has_vertices) return Bad("it has no vertices");
  points.comments = std::move(header.comments);
  return points;
}

}  // namespace lucerna
