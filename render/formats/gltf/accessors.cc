#include "render/formats/gltf/accessors.h"

#include <algorithm>
#include <cctype>
#include <cstring>

#include "render/base/text.h"

namespace lucerna {
namespace {

// The component types, by OpenGL's numbers.
constexpr int kByte = 5120;
constexpr int kUnsignedByte = 5121;
constexpr int kShort = 5122;
constexpr int kUnsignedShort = 5123;
constexpr int kUnsignedInt = 5125;
constexpr int kFloat = 5126;

// Of an accessor without a view, whose zeros stand in no file. What is made of them is counted like
// anything else (GltfBudget).
constexpr std::uint64_t kMaxZeroBytes = std::uint64_t{64} << 20;

std::size_t BytesOfComponent(int type) {
  switch (type) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    case kUnsignedInt:
    case kFloat:
      return 4;
    default:
      return 0;
  }
}

bool IsUnsignedInteger(int type) {
  return type == kUnsignedByte || type == kUnsignedShort || type == kUnsignedInt;
}

template <typename Number>
Number Load(const char* at) {
  Number number;
  std::memcpy(&number, at, sizeof(number));
  return number;
}

std::uint32_t LoadWhole(int type, const char* at) {
  switch (type) {
    case kUnsignedByte:
      return Load<std::uint8_t>(at);
    case kUnsignedShort:
      return Load<std::uint16_t>(at);
    default:
      return Load<std::uint32_t>(at);
  }
}

struct UseRule {
  std::string_view type;
  std::size_t components;
  std::string_view says;
};

UseRule RuleOf(GltfUse use) {
  switch (use) {
    case GltfUse::kIndices:
    case GltfUse::kScalar:
      return {"SCALAR", 1, "must be of type SCALAR here"};
    case GltfUse::kVec2:
      return {"VEC2", 2, "must be of type VEC2 here"};
    case GltfUse::kVec3:
      return {"VEC3", 3, "must be of type VEC3 here"};
    case GltfUse::kVec4:
      return {"VEC4", 4, "must be of type VEC4 here"};
    case GltfUse::kMat4:
      break;
  }
  return {"MAT4", 16, "must be of type MAT4 here"};
}

int Base64Value(char c) {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  if (c == '+') return 62;
  if (c == '/') return 63;
  return -1;
}

bool IsSpace(char c) {
  return std::isspace(static_cast<unsigned char>(c)) != 0;
}

// Some writers break the lines.
StatusOr<std::string> FromBase64(std::string_view text) {
  for (int padding = 0; !text.empty();) {
    if (text.back() == '=' ? ++padding > 2 : !IsSpace(text.back())) break;
    text.remove_suffix(1);
  }
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int bit_count = 0;
  for (const char c : text) {
    if (IsSpace(c)) continue;
    const int value = Base64Value(c);
    if (value < 0) return absl::InvalidArgumentError("a data: URI is damaged: it is no base64");
    bits = (bits << 6U | static_cast<std::uint32_t>(value)) & 0xFFFFFFU;
    bit_count += 6;
    if (bit_count >= 8) {
      bit_count -= 8;
      bytes += static_cast<char>(bits >> static_cast<unsigned>(bit_count) & 0xFFU);
    }
  }
  return bytes;
}

bool EqualButForCase(std::string_view a, std::string_view lower_case) {
  return std::ranges::equal(a, lower_case, [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) == y;
  });
}

// With %20 and the like as the bytes they stand for; a '%' that begins none stands for itself.
std::string Unescaped(std::string_view uri) {
  const auto digit = [](char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    return -1;
  };
  std::string path;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const bool has_digits = uri[i] == '%' && i + 2 < uri.size();
    const int high = has_digits ? digit(uri[i + 1]) : -1;
    const int low = has_digits ? digit(uri[i + 2]) : -1;
    if (high < 0 || low < 0) {
      path += uri[i];
      continue;
    }
    path += static_cast<char>(high * 16 + low);
    i += 2;
  }
  return path;
}

// The path that a URI without a scheme names. "a/../b" is b; what leads out of the folder is left
// as it is, for who reads files to judge.
std::string PathOfUri(std::string_view uri) {
  std::string path = Unescaped(uri);
  std::ranges::replace(path, '\\', '/');
  std::vector<std::string_view> components;
  for (std::size_t start = 0; start <= path.size();) {
    const std::string_view component =
        std::string_view(path).substr(start, path.find('/', start) - start);
    start += component.size() + 1;
    if (component == ".") continue;
    if (component != "..") {
      components.push_back(component);
    } else if (components.empty() || components.back().empty()) {
      return path;
    } else {
      components.pop_back();
    }
  }
  std::string normal;
  for (std::size_t i = 0; i < components.size(); ++i)
    normal += Concat(i == 0 ? "" : "/", components[i]);
  return normal;
}

}  // namespace

StatusOr<std::string> ReadGltfUri(std::string_view uri, AssetReader& assets) {
  constexpr std::string_view kData = "data:";
  constexpr std::string_view kBase64 = ";base64";
  if (EqualButForCase(uri.substr(0, kData.size()), kData)) {
    const std::size_t comma = uri.find(',');
    const std::string_view type = uri.substr(0, comma == std::string_view::npos ? 0 : comma);
    if (type.size() < kBase64.size() ||
        !EqualButForCase(type.substr(type.size() - kBase64.size()), kBase64)) {
      return absl::InvalidArgumentError("a data: URI is not in base64, which is not supported");
    }
    return FromBase64(uri.substr(comma + 1));
  }
  // A scheme ends before the first slash; "a:b.bin" would have to be written "./a:b.bin".
  if (const std::size_t colon = uri.find(':');
      colon != std::string_view::npos && uri.substr(0, colon).find('/') == std::string_view::npos) {
    return absl::InvalidArgumentError(
        Concat("the URI ", Quoted(uri), " is no file beside the scene, and nothing is fetched"));
  }
  StatusOr<std::string> bytes = assets.ReadBytes(PathOfUri(uri));
  // A file's name may hold what begins a query or a fragment, so that is cut off second.
  const std::size_t name_end = uri.find_first_of("?#");
  if (bytes.status().code() != absl::StatusCode::kNotFound || name_end == std::string_view::npos)
    return bytes;
  return assets.ReadBytes(PathOfUri(uri.substr(0, name_end)));
}

// ---- GltfAccessor

const char* GltfAccessor::ElementAt(std::size_t index) const {
  if (!sparse_indices_.empty()) {
    const auto found = std::ranges::lower_bound(sparse_indices_, index);
    if (found != sparse_indices_.end() && *found == index) {
      const auto place = static_cast<std::size_t>(found - sparse_indices_.begin());
      return sparse_data_ + place * components_ * component_bytes_;
    }
  }
  return data_ == nullptr ? nullptr : data_ + index * stride_;
}

double GltfAccessor::NumberAt(const char* at) const {
  const double scale = is_normalized_ ? 1 : 0;
  const auto scaled = [&](double number, double largest) {
    return scale == 0 ? number : std::max(number / largest, -1.0);
  };
  switch (component_type_) {
    case kByte:
      return scaled(Load<std::int8_t>(at), 127);
    case kUnsignedByte:
      return scaled(Load<std::uint8_t>(at), 255);
    case kShort:
      return scaled(Load<std::int16_t>(at), 32767);
    case kUnsignedShort:
      return scaled(Load<std::uint16_t>(at), 65535);
    case kUnsignedInt:
      return Load<std::uint32_t>(at);
    default:
      return static_cast<double>(Load<float>(at));
  }
}

template <std::size_t kCount>
std::array<double, kCount> GltfAccessor::NumbersAt(std::size_t index) const {
  std::array<double, kCount> numbers{};
  const char* element = ElementAt(index);
  if (element == nullptr) return numbers;
  for (std::size_t i = 0; i < std::min(components_, kCount); ++i)
    numbers[i] = NumberAt(element + i * component_bytes_);
  return numbers;
}
template std::array<double, 4> GltfAccessor::NumbersAt(std::size_t index) const;
template std::array<double, 16> GltfAccessor::NumbersAt(std::size_t index) const;

std::uint32_t GltfAccessor::WholeAt(std::size_t index) const {
  const char* element = ElementAt(index);
  return element == nullptr ? 0 : LoadWhole(component_type_, element);
}

// ---- GltfBuffers

std::optional<std::string_view> GltfBuffers::BytesOf(std::size_t index) {
  Buffer& buffer = buffers_[index];
  if (buffer.is_read) return buffer.bytes;
  buffer.is_read = true;
  const JsonObject object = document_.At("buffers", index);
  const std::optional<std::uint64_t> size = object.Whole("byteLength");
  if (!size.has_value()) {
    if (!object.Has("byteLength")) object.Error("needs byteLength");
    return std::nullopt;
  }
  std::string_view bytes;
  if (object.Has("uri")) {
    StatusOr<std::string> read = ReadGltfUri(object.String("uri", ""), assets_);
    if (!read.ok()) {
      object.Error(Concat("cannot be read: ", read.status().message()));
      return std::nullopt;
    }
    buffer.owned = *std::move(read);
    bytes = *buffer.owned;
  } else if (index == 0 && document_.binary_chunk().has_value()) {
    bytes = *document_.binary_chunk();
  } else {
    object.Error("has neither a uri nor the binary chunk of a .glb file");
    return std::nullopt;
  }
  if (*size > bytes.size()) {
    object.Error(Concat("has ", bytes.size(), " bytes, and byteLength is ", *size));
    return std::nullopt;
  }
  buffer.bytes = bytes.substr(0, *size);
  return buffer.bytes;
}

std::optional<std::string_view> GltfBuffers::View(std::size_t index) {
  const JsonObject view = document_.At("bufferViews", index);
  const std::optional<std::size_t> buffer = view.Index("buffer", "buffers");
  const std::optional<std::uint64_t> size = view.Whole("byteLength");
  const std::uint64_t offset = view.Whole("byteOffset").value_or(0);
  if (!buffer.has_value() || !size.has_value()) {
    if (!view.Has("buffer") || !view.Has("byteLength")) view.Error("needs buffer and byteLength");
    return std::nullopt;
  }
  const std::optional<std::string_view> bytes = BytesOf(*buffer);
  if (!bytes.has_value()) return std::nullopt;
  if (offset > bytes->size() || *size > bytes->size() - offset) {
    view.Error(Concat("bytes ", offset, " to ", offset + *size, " lie beyond its buffer of ",
                      bytes->size(), " bytes"));
    return std::nullopt;
  }
  return bytes->substr(offset, *size);
}

const char* GltfBuffers::Elements(const JsonObject& object, std::size_t view, std::uint64_t offset,
                                  std::uint64_t count, std::uint64_t element_bytes,
                                  std::uint64_t stride) {
  const std::optional<std::string_view> bytes = View(view);
  if (!bytes.has_value()) return nullptr;
  // All but the last element have a whole stride.
  const std::uint64_t room = bytes->size();
  if (offset > room || element_bytes > room - offset ||
      (count - 1) > (room - offset - element_bytes) / stride) {
    object.Error(Concat("its ", count, " elements lie beyond the ", room, " bytes of bufferViews[",
                        view, "]"));
    return nullptr;
  }
  return bytes->data() + offset;
}

bool GltfBuffers::ReadSparse(const JsonObject& object, GltfAccessor& accessor) {
  const JsonObject sparse = object.Child("sparse");
  if (!sparse.exists()) return !object.Has("sparse");
  const std::uint64_t count = sparse.Whole("count").value_or(0);
  if (count == 0 || count > accessor.count_) {
    sparse.Error(Concat("count must be from 1 to the accessor's ", accessor.count_));
    return false;
  }
  const JsonObject indices = sparse.Child("indices");
  const JsonObject values = sparse.Child("values");
  const std::optional<std::size_t> index_view = indices.Index("bufferView", "bufferViews");
  const std::optional<std::size_t> value_view = values.Index("bufferView", "bufferViews");
  const auto type = static_cast<int>(
      std::min<std::uint64_t>(indices.Whole("componentType").value_or(0), 1U << 16U));
  if (!index_view.has_value() || !value_view.has_value() || !IsUnsignedInteger(type)) {
    sparse.Error("needs indices of unsigned integers, and values, each with a bufferView");
    return false;
  }
  const std::size_t index_bytes = BytesOfComponent(type);
  const std::size_t element_bytes = accessor.components_ * accessor.component_bytes_;
  const char* index_data = Elements(indices, *index_view, indices.Whole("byteOffset").value_or(0),
                                    count, index_bytes, index_bytes);
  if (index_data == nullptr) return false;
  accessor.sparse_data_ = Elements(values, *value_view, values.Whole("byteOffset").value_or(0),
                                   count, element_bytes, element_bytes);
  if (accessor.sparse_data_ == nullptr) return false;
  accessor.sparse_indices_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t index = LoadWhole(type, index_data + i * index_bytes);
    const bool is_rising = i == 0 || index > accessor.sparse_indices_.back();
    if (!is_rising || index >= accessor.count_) {
      indices.Error(Concat("must rise from each to the next, below the accessor's count of ",
                           accessor.count_));
      return false;
    }
    accessor.sparse_indices_.push_back(index);
  }
  return true;
}

const GltfAccessor* GltfBuffers::Open(std::size_t index, GltfUse use) {
  const auto [opened, is_new] = opened_.try_emplace({index, use});
  if (is_new) opened->second = Read(index, use);
  return opened->second.has_value() ? &*opened->second : nullptr;
}

std::optional<GltfAccessor> GltfBuffers::Read(std::size_t index, GltfUse use) {
  const JsonObject object = document_.At("accessors", index);
  const UseRule rule = RuleOf(use);
  GltfAccessor accessor;
  accessor.component_type_ = static_cast<int>(
      std::min<std::uint64_t>(object.Whole("componentType").value_or(0), 1U << 16U));
  accessor.component_bytes_ = BytesOfComponent(accessor.component_type_);
  accessor.components_ = rule.components;
  accessor.is_normalized_ = object.Bool("normalized", false);
  accessor.count_ = object.Whole("count").value_or(0);
  if (object.String("type", "") != rule.type) {
    object.Error(rule.says);
    return std::nullopt;
  }
  if (accessor.component_bytes_ == 0) {
    object.Error("componentType must be one of 5120, 5121, 5122, 5123, 5125 and 5126");
    return std::nullopt;
  }
  if (use == GltfUse::kIndices && !IsUnsignedInteger(accessor.component_type_)) {
    object.Error("indices must be unsigned integers: componentType 5121, 5123 or 5125");
    return std::nullopt;
  }
  if (accessor.count_ == 0) {
    object.Error("count must be at least 1");
    return std::nullopt;
  }
  const std::uint64_t element_bytes = accessor.components_ * accessor.component_bytes_;
  if (object.Has("bufferView")) {
    const std::optional<std::size_t> view = object.Index("bufferView", "bufferViews");
    if (!view.has_value()) return std::nullopt;
    const JsonObject of_view = document_.At("bufferViews", *view);
    const std::uint64_t stride = of_view.Whole("byteStride").value_or(element_bytes);
    constexpr std::uint64_t kMaxStride = 252;
    if (stride < element_bytes || (of_view.Has("byteStride") && stride > kMaxStride)) {
      of_view.Error(Concat("byteStride is ", stride, "; it must be from the ", element_bytes,
                           " bytes of an element to ", kMaxStride));
      return std::nullopt;
    }
    accessor.stride_ = stride;
    accessor.data_ = Elements(object, *view, object.Whole("byteOffset").value_or(0),
                              accessor.count_, element_bytes, stride);
    if (accessor.data_ == nullptr) return std::nullopt;
  }
  if (accessor.data_ == nullptr && accessor.count_ > kMaxZeroBytes / element_bytes) {
    object.Error(Concat("has no bufferView, so it is zeros, of which it may have ", kMaxZeroBytes,
                        " bytes; it has ", accessor.count_, " elements of ", element_bytes));
    return std::nullopt;
  }
  if (!ReadSparse(object, accessor)) return std::nullopt;
  return accessor;
}

}  // namespace lucerna
