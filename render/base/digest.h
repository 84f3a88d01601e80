// What is the name of these bytes?
//
// A Digest is the SHA-256 of bytes. Scenes, hitpoint blocks and accumulations are named by it,
// so equal names mean equal bytes wherever they came from.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "render/base/status.h"

namespace lucerna {

class Digest {
 public:
  static constexpr std::size_t kSize = 32;

  Digest() = default;
  explicit Digest(const std::array<std::uint8_t, kSize>& bytes) : bytes_(bytes) {}

  // Errors: INVALID_ARGUMENT unless `bytes` is 32 bytes long.
  [[nodiscard]] static StatusOr<Digest> FromBytes(std::string_view bytes);

  [[nodiscard]] std::string Hex() const;
  // The 32 bytes themselves, as protobuf `bytes` carries them.
  [[nodiscard]] std::string_view Bytes() const {
    return {reinterpret_cast<const char*>(bytes_.data()), kSize};
  }

  auto operator<=>(const Digest&) const = default;

 private:
  std::array<std::uint8_t, kSize> bytes_{};
};

// The digest of `bytes`.
[[nodiscard]] Digest Sha256(std::string_view bytes);

// The digest of bytes that arrive piece by piece.
class Sha256Stream {
 public:
  Sha256Stream();
  ~Sha256Stream();
  Sha256Stream(const Sha256Stream&) = delete;
  Sha256Stream& operator=(const Sha256Stream&) = delete;

  void Add(std::string_view bytes);
  // Ends the stream; nothing may be added after it.
  [[nodiscard]] Digest Finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lucerna

template <>
struct std::hash<lucerna::Digest> {
  std::size_t operator()(const lucerna::Digest& digest) const noexcept {
    std::size_t value = 0;
    std::memcpy(&value, digest.Bytes().data(), sizeof(value));
    return value;
  }
};
