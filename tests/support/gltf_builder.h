// A glTF document that a test puts together: arrays go into one buffer, and the JSON is written by
// hand.
#pragma once

#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <zlib.h>

#include "render/formats/read_scene.h"
#include "tests/support/memory_files.h"

namespace lucerna {

// A PNG of `channels` bytes a pixel: 1 grey, 3 colours, 4 with opacity.
[[nodiscard]] inline std::string Png(std::uint32_t width, std::uint32_t height, int channels,
                                     const std::vector<std::uint8_t>& pixels) {
  const auto word = [](std::uint32_t value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8)
      bytes += static_cast<char>(value >> static_cast<unsigned>(shift) & 0xFFU);
    return bytes;
  };
  const auto chunk = [&](const std::string& type, const std::string& data) {
    const std::string checked = type + data;
    const auto crc =
        crc32(0, reinterpret_cast<const Bytef*>(checked.data()), static_cast<uInt>(checked.size()));
    return word(static_cast<std::uint32_t>(data.size())) + checked +
           word(static_cast<std::uint32_t>(crc));
  };
  std::string rows;
  const std::size_t row = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels);
  for (std::size_t y = 0; y < height; ++y) {
    rows += '\0';
    rows.append(reinterpret_cast<const char*>(pixels.data()) + y * row, row);
  }
  std::string packed(compressBound(rows.size()), '\0');
  uLongf packed_size = packed.size();
  compress(reinterpret_cast<Bytef*>(packed.data()), &packed_size,
           reinterpret_cast<const Bytef*>(rows.data()), rows.size());
  packed.resize(packed_size);
  const char color_type = channels == 1 ? 0 : channels == 3 ? 2 : 6;
  const std::string header = word(width) + word(height) + '\x08' + color_type + '\0' + '\0' + '\0';
  return "\x89PNG\r\n\x1A\n" + chunk("IHDR", header) + chunk("IDAT", packed) + chunk("IEND", "");
}

class GltfBuilder {
 public:
  using Json = nlohmann::json;

  Json json = {{"asset", {{"version", "2.0"}}}};
  std::map<std::string, std::string> files;

  // The component types, by OpenGL's numbers.
  template <typename Number>
  static int ComponentType() {
    if constexpr (std::is_same_v<Number, std::int8_t>) return 5120;
    if constexpr (std::is_same_v<Number, std::uint8_t>) return 5121;
    if constexpr (std::is_same_v<Number, std::int16_t>) return 5122;
    if constexpr (std::is_same_v<Number, std::uint16_t>) return 5123;
    if constexpr (std::is_same_v<Number, std::uint32_t>) return 5125;
    return 5126;
  }

  // Each returns the index of what it added.
  int AddView(const std::string& bytes) {
    while (buffer_.size() % 4 != 0)
      buffer_ += '\0';
    json["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes.size()}});
    buffer_ += bytes;
    return Last("bufferViews");
  }
  template <typename Number>
  int AddNumbers(const std::vector<Number>& numbers) {
    std::string bytes(numbers.size() * sizeof(Number), '\0');
    std::memcpy(bytes.data(), numbers.data(), bytes.size());
    return AddView(bytes);
  }
  template <typename Number>
  int AddAccessor(const std::vector<Number>& numbers, const std::string& type,
                  bool is_normalized = false) {
    const std::size_t components = type == "SCALAR" ? 1 : type.at(3) - '0';
    Json accessor = {{"bufferView", AddNumbers(numbers)},
                     {"componentType", ComponentType<Number>()},
                     {"count", numbers.size() / components},
                     {"type", type}};
    if (is_normalized) accessor["normalized"] = true;
    return Add("accessors", accessor);
  }
  int Add(const std::string& array, const Json& entry) {
    json[array].push_back(entry);
    return Last(array);
  }
  // A triangle with corners at (0, 0, 0), (1, 0, 0) and (0, 1, 0), which faces along +z.
  int AddTriangleMesh(const Json& primitive = Json::object()) {
    Json of_triangle = primitive;
    of_triangle["attributes"]["POSITION"] = AddAccessor<float>({0, 0, 0, 1, 0, 0, 0, 1, 0}, "VEC3");
    return Add("meshes", {{"primitives", {of_triangle}}});
  }
  int AddNode(const Json& node) {
    const int index = Add("nodes", node);
    if (json["scenes"].empty()) json["scenes"] = Json::array({{{"nodes", Json::array()}}});
    json["scenes"][0]["nodes"].push_back(index);
    return index;
  }
  // A camera at the origin that looks along -z.
  void AddCamera(const Json& node = Json::object()) {
    Json with_camera = node;
    with_camera["camera"] =
        Add("cameras", {{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}}}});
    AddNode(with_camera);
  }
  // An image, with a texture of its own.
  int AddTexture(const std::string& png, const Json& sampler = nullptr) {
    Json texture = {
        {"source", Add("images", {{"bufferView", AddView(png)}, {"mimeType", "image/png"}})}};
    if (!sampler.is_null()) texture["sampler"] = Add("samplers", sampler);
    return Add("textures", texture);
  }

  [[nodiscard]] std::string Text() const {
    Json whole = json;
    if (!buffer_.empty() && !whole.contains("buffers"))
      whole["buffers"] = {{{"byteLength", buffer_.size()}, {"uri", "b.bin"}}};
    return whole.dump();
  }
  [[nodiscard]] std::map<std::string, std::string> AllFiles() const {
    std::map<std::string, std::string> all = files;
    all.emplace("s.gltf", Text());
    all.emplace("b.bin", buffer_);
    return all;
  }
  // In one file.
  [[nodiscard]] std::string Glb() const {
    Json whole = json;
    whole["buffers"] = {{{"byteLength", buffer_.size()}}};
    const auto word = [](std::size_t value) {
      const auto number = static_cast<std::uint32_t>(value);
      std::string bytes(4, '\0');
      std::memcpy(bytes.data(), &number, 4);
      return bytes;
    };
    std::string text = whole.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string binary = buffer_;
    binary.resize((binary.size() + 3) / 4 * 4, '\0');
    const std::string chunks =
        word(text.size()) + "JSON" + text + word(binary.size()) + std::string("BIN\0", 4) + binary;
    return "glTF" + word(2) + word(12 + chunks.size()) + chunks;
  }
  [[nodiscard]] ParsedScene Read(const SceneLimits& limits = {}) const {
    MemoryFiles all(AllFiles());
    return ReadScene(all, "s.gltf", limits);
  }
  [[nodiscard]] const std::string& buffer() const { return buffer_; }

 private:
  int Last(const std::string& array) const { return static_cast<int>(json[array].size()) - 1; }

  std::string buffer_;
};

}  // namespace lucerna
