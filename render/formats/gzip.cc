#include "render/formats/gzip.h"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <zlib.h>

#include "render/base/text.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kMaxInflation = 200;

// zlib's stream, which ends itself.
class Inflater {
 public:
  Inflater() { LUCERNA_CHECK(inflateInit2(&stream_, 15 + 16) == Z_OK); }  // +16: gzip
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;
  z_stream& stream() { return stream_; }

 private:
  z_stream stream_{};
};

}  // namespace

bool IsGzip(std::string_view bytes) {
  return bytes.starts_with("\x1f\x8b");
}

StatusOr<std::string> Gunzip(std::string_view bytes) {
  const std::uint64_t limit = kMaxInflation * bytes.size();
  std::string out;
  std::vector<unsigned char> piece(std::size_t{1} << 18);
  Inflater inflater;
  z_stream& stream = inflater.stream();
  int result = Z_OK;
  std::size_t consumed = 0;
  while (result != Z_STREAM_END) {
    if (stream.avail_in == 0) {
      // zlib counts in 32 bits.
      const std::size_t given = std::min<std::size_t>(bytes.size() - consumed, 1U << 30);
      if (given == 0) return absl::InvalidArgumentError("its gzip stream is truncated");
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data() + consumed));
      stream.avail_in = static_cast<uInt>(given);
      consumed += given;
    }
    stream.next_out = piece.data();
    stream.avail_out = static_cast<uInt>(piece.size());
    result = inflate(&stream, Z_NO_FLUSH);
    if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR) {
      return absl::InvalidArgumentError("its gzip stream is damaged");
    }
    const std::size_t made = piece.size() - stream.avail_out;
    if (out.size() + made > limit) {
      return absl::InvalidArgumentError(
          Concat("it unpacks to more than ", kMaxInflation, " times its size"));
    }
    out.append(reinterpret_cast<const char*>(piece.data()), made);
  }
  return out;
}

}  // namespace lucerna
