#include "render/image/exr_file.h"

#include <algorithm>
#include <array>
#include <climits>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <new>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIO.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfThreading.h>
#include <zlib.h>

#include "render/base/mutex.h"
#include "render/base/parallel.h"

namespace lucerna {
namespace {

constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 28;
// What is read takes 4 GiB at most, or 256 times the file: an image of ours at its largest has some
// 2^33 samples, and a small file must not fill the memory.
constexpr std::uint64_t kSamplesOfAnyFile = std::uint64_t{1} << 30;
constexpr std::uint64_t kSamplesPerByte = 64;
// No compression of the format puts more lines than this into one block.
constexpr std::uint64_t kMaxLinesPerBlock = 256;
constexpr std::size_t kMaxAttributeName = 255;

class MemoryOutput final : public Imf::OStream {
 public:
  // Room for `most_bytes` from the start: a block that grows would take up to three times what it
  // holds, and where it is large what is never written takes no memory.
  explicit MemoryOutput(std::uint64_t most_bytes) : Imf::OStream("image") {
    bytes_.reserve(most_bytes);
  }

  void write(const char bytes[], int count) override {
    const auto size = static_cast<std::size_t>(count);
    LUCERNA_CHECK(position_ <= bytes_.size());
    const std::size_t within = std::min(size, bytes_.size() - position_);
    std::memcpy(bytes_.data() + position_, bytes, within);
    bytes_.append(bytes + within, size - within);
    position_ += size;
  }
  std::uint64_t tellp() override { return position_; }
  // The library goes back once, to fill in the table of block offsets.
  void seekp(std::uint64_t position) override { position_ = position; }

  // All that was written; nothing is left here.
  [[nodiscard]] std::string Take() {
    constexpr std::size_t kLarge = std::size_t{16} << 20;
    if (bytes_.capacity() < kLarge) bytes_.shrink_to_fit();
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
  std::size_t position_ = 0;
};

class MemoryInput final : public Imf::IStream {
 public:
  explicit MemoryInput(std::string_view bytes) : Imf::IStream("image"), bytes_(bytes) {}

  bool read(char bytes[], int count) override {
    const auto size = static_cast<std::uint64_t>(std::max(count, 0));
    if (position_ > bytes_.size() || size > bytes_.size() - position_) {
      throw std::runtime_error("the file ends too early");
    }
    std::memcpy(bytes, bytes_.data() + position_, size);
    position_ += size;
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override { position_ = position; }

 private:
  std::string_view bytes_;
  std::uint64_t position_ = 0;
};

// Reads little-endian values off the front of bytes that may end anywhere.
class HeaderReader {
 public:
  explicit HeaderReader(std::string_view bytes) : bytes_(bytes) {}

  [[nodiscard]] std::optional<std::uint32_t> Number() {
    if (bytes_.size() < 4) return std::nullopt;
    std::uint32_t value = 0;
    std::memcpy(&value, bytes_.data(), 4);
    bytes_.remove_prefix(4);
    return value;
  }
  [[nodiscard]] std::optional<std::string_view> Text() {
    const std::size_t end = bytes_.substr(0, kMaxAttributeName + 1).find('\0');
    if (end == std::string_view::npos) return std::nullopt;
    const std::string_view text = bytes_.substr(0, end);
    bytes_.remove_prefix(end + 1);
    return text;
  }
  [[nodiscard]] std::size_t remaining() const { return bytes_.size(); }
  [[nodiscard]] std::optional<std::string_view> Bytes(std::uint64_t size) {
    if (size > bytes_.size()) return std::nullopt;
    const std::string_view piece = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return piece;
  }

 private:
  std::string_view bytes_;
};

struct Extent {
  std::int64_t width = 0, height = 0;            // [pixels]
  std::int64_t tile_width = 0, tile_height = 0;  // 0: scanlines
  std::uint8_t compression = 0;
  std::uint64_t pixel_bytes = 0;   // of all channels
  std::uint64_t packed_bytes = 0;  // the same as PXR24 packs them
  std::size_t header_bytes = 0;
};

Status Garbage(const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat("not a usable EXR file: ", what));
}

// What the header promises, read before OpenEXR sees the bytes: the library allocates whatever
// the attribute sizes, the data window and the tile size ask for.
StatusOr<Extent> CheckHeader(std::string_view bytes) {
  constexpr std::uint32_t kMagic = 20000630;
  constexpr std::uint32_t kNotAnImage = 0x800;  // deep pixels
  constexpr std::uint32_t kMultiPart = 0x1000;
  HeaderReader reader(bytes);
  const auto magic = reader.Number();
  const auto version = reader.Number();
  if (!magic || !version || *magic != kMagic) return Garbage("it does not begin like one");
  if ((*version & (kNotAnImage | kMultiPart)) != 0) {
    return Garbage("deep and multi-part files are not read; save a single flat part");
  }

  Extent extent;
  bool has_window = false;
  for (;;) {
    const auto name = reader.Text();
    if (!name) return Garbage("its header is cut off");
    if (name->empty()) break;
    const auto type = reader.Text();
    const auto size = reader.Number();
    if (!type || !size) return Garbage("its header is cut off");
    const auto value = reader.Bytes(*size);
    if (!value)
      return Garbage(absl::StrCat("its attribute \"", std::string(*name), "\" is cut off"));
    HeaderReader fields(*value);
    if (*name == "dataWindow") {
      std::array<std::int64_t, 4> corners{};  // x0 y0 x1 y1, both ends inside
      for (std::int64_t& corner : corners) {
        const auto field = fields.Number();
        if (!field) return Garbage("its data window is cut off");
        corner = static_cast<std::int32_t>(*field);
      }
      extent.width = corners[2] - corners[0] + 1;
      extent.height = corners[3] - corners[1] + 1;
      has_window = true;
    } else if (*name == "compression") {
      extent.compression = value->empty() ? 0 : static_cast<std::uint8_t>(value->front());
    } else if (*name == "channels") {
      extent.pixel_bytes = 0;
      extent.packed_bytes = 0;
      for (auto channel = fields.Text(); channel && !channel->empty(); channel = fields.Text()) {
        constexpr std::uint32_t kHalf = 1;
        constexpr std::uint32_t kFloat = 2;
        const auto pixel_type = fields.Number();
        if (!pixel_type || !fields.Bytes(12)) return Garbage("its channels are cut off");
        extent.pixel_bytes += *pixel_type == kHalf ? 2 : 4;
        extent.packed_bytes += *pixel_type == kHalf ? 2 : *pixel_type == kFloat ? 3 : 4;
      }
    } else if (*name == "tiles") {
      const auto tile_width = fields.Number();
      const auto tile_height = fields.Number();
      if (!tile_width || !tile_height || *tile_width == 0 || *tile_height == 0) {
        return Garbage("its tile size is not one");
      }
      extent.tile_width = *tile_width;
      extent.tile_height = *tile_height;
    }
  }
  if (!has_window) return Garbage("it has no data window");
  if (extent.width <= 0 || extent.height <= 0) return Garbage("its data window is empty");
  constexpr auto kMaxSide = static_cast<std::int64_t>(kMaxPixels);
  if (extent.width > kMaxSide || extent.height > kMaxSide / extent.width) {
    return Garbage(absl::StrCat("it has ", extent.width, " x ", extent.height,
                                " pixels, more than the 2^28 that are allowed"));
  }
  // Every block has eight bytes in the table of offsets; a file too short for its own table is
  // refused before that table is allocated.
  const auto width = static_cast<std::uint64_t>(extent.width);
  const auto height = static_cast<std::uint64_t>(extent.height);
  std::uint64_t blocks = (height + kMaxLinesPerBlock - 1) / kMaxLinesPerBlock;
  if (extent.tile_width > 0) {
    const auto tile_width = static_cast<std::uint64_t>(extent.tile_width);
    const auto tile_height = static_cast<std::uint64_t>(extent.tile_height);
    if (tile_width * tile_height > kMaxPixels) return Garbage("its tiles are too large");
    blocks = ((width + tile_width - 1) / tile_width) * ((height + tile_height - 1) / tile_height);
  }
  if (blocks * 8 > bytes.size()) return Garbage("it is too short for its size in pixels");
  extent.header_bytes = bytes.size() - reader.remaining();
  return extent;
}

// How many bytes a zlib stream unpacks to, at most `limit` + 1; nothing when it is damaged.
std::optional<std::uint64_t> InflatedSize(std::string_view packed, std::uint64_t limit) {
  std::array<unsigned char, 65536> scratch{};
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) return std::nullopt;
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  int outcome = Z_OK;
  while (outcome == Z_OK && stream.total_out <= limit) {
    stream.next_out = scratch.data();
    stream.avail_out = static_cast<uInt>(scratch.size());
    outcome = inflate(&stream, Z_NO_FLUSH);
  }
  const std::uint64_t size = stream.total_out;
  inflateEnd(&stream);
  if (outcome != Z_STREAM_END && outcome != Z_OK) return std::nullopt;
  return std::min(size, limit + 1);
}

// The same for OpenEXR's run lengths: a count below zero says how many bytes stand as they are.
std::uint64_t RunsSize(std::string_view packed, std::uint64_t limit) {
  std::uint64_t size = 0;
  for (std::size_t at = 0; at < packed.size() && size <= limit;) {
    const auto count = static_cast<signed char>(packed[at]);
    size += static_cast<std::uint64_t>(count < 0 ? -count : count + 1);
    at += count < 0 ? 1 + static_cast<std::size_t>(-count) : 2;
  }
  return size;
}

// Every block of scanlines unpacks to all of its pixels. The library does not check: where one has
// fewer, it would go on with whatever lies in memory.
Status CheckBlocks(std::string_view bytes, const Extent& extent) {
  enum : std::uint8_t { kNone, kRuns, kZips, kZip, kPiz, kPxr24 };
  const std::uint8_t compression = extent.compression;
  if (extent.tile_width > 0 || compression > kPxr24 || compression == kPiz) {
    return absl::OkStatus();
  }
  const std::int64_t lines_per_block = compression == kZip || compression == kPxr24 ? 16 : 1;
  const auto width = static_cast<std::uint64_t>(extent.width);
  std::string_view table = bytes.substr(extent.header_bytes);
  for (std::int64_t line = 0; line < extent.height; line += lines_per_block) {
    const auto lines = static_cast<std::uint64_t>(std::min(lines_per_block, extent.height - line));
    const std::uint64_t plain_bytes = width * lines * extent.pixel_bytes;
    const std::uint64_t expected =
        compression == kPxr24 ? width * lines * extent.packed_bytes : plain_bytes;
    std::uint64_t offset = 0;
    if (table.size() < sizeof(offset)) return Garbage("its table of blocks is cut off");
    std::memcpy(&offset, table.data(), sizeof(offset));
    table.remove_prefix(sizeof(offset));
    if (offset > bytes.size()) return Garbage("its table of blocks is damaged");
    HeaderReader block(bytes.substr(offset));
    const auto first_line = block.Number();
    const auto size = block.Number();
    const auto packed = size ? block.Bytes(*size) : std::nullopt;
    if (!first_line || !packed) return Garbage("a block of its scanlines is cut off");
    if (packed->size() == plain_bytes) continue;  // what does not get smaller is not packed
    const std::optional<std::uint64_t> unpacked =
        packed->size() > plain_bytes || compression == kNone ? std::nullopt
        : compression == kRuns ? std::optional(RunsSize(*packed, expected))
                               : InflatedSize(*packed, expected);
    if (unpacked != expected) return Garbage("a block of its scanlines is damaged");
  }
  return absl::OkStatus();
}

// Writes a file band by band. What the library refuses is thrown.
class ExrWriter {
 public:
  // Of an image like `head`, whose channels come with the first band.
  ExrWriter(const Image& head, int threads) : header_(head.width, head.height) {
    if (head.whole_width > 0 && head.whole_height > 0) {
      header_.displayWindow() =
          Box(Corner(0, 0), Corner(head.whole_width - 1, head.whole_height - 1));
      header_.dataWindow() = Box(Corner(head.x0, head.y0),
                                 Corner(head.x0 + head.width - 1, head.y0 + head.height - 1));
    }
    // Line by line at this level takes 0.6 of the time of the library's own choice, for 2 % more
    // bytes; the coordinator does it while workers wait for their next job.
    header_.compression() = Imf::ZIPS_COMPRESSION;
    header_.zipCompressionLevel() = 2;
    for (const auto& [key, value] : head.metadata) {
      header_.insert(key, Imf::StringAttribute(value));
      attribute_bytes_ += key.size() + value.size() + kBytesPerAttribute;
    }
    // Of the threads that the library has for all files at once this one uses so many. Where the
    // system gives none, the caller's does it all.
    threads_ = ThreadsOrAll(threads);
    if (threads_ == 1) threads_ = 0;
    static Mutex mutex;
    const MutexLock lock(mutex);
    try {
      if (Imf::globalThreadCount() < threads_) Imf::setGlobalThreadCount(threads_);
    } catch (const std::system_error&) {
      threads_ = 0;
    }
  }

  // The rows [first, last), behind those added so far.
  void Add(const std::vector<ImageChannel>& band, int first, int last) {
    const Box window = header_.dataWindow();
    if (!file_) Begin(band);
    Imf::FrameBuffer planes;
    const auto width = static_cast<std::size_t>(window.max.x - window.min.x) + 1;
    for (const ImageChannel& channel : band) {
      LUCERNA_CHECK(channel.pixels.size() == width * static_cast<std::size_t>(last - first));
      LUCERNA_CHECK(planes.findSlice(channel.name) == nullptr);
      // The library reads through this pointer and never writes; its type is shared with reading.
      planes.insert(channel.name,
                    Imf::Slice::Make(Imf::FLOAT, const_cast<float*>(channel.pixels.data()),
                                     Box(Corner(window.min.x, window.min.y + first),
                                         Corner(window.max.x, window.min.y + last - 1)),
                                     sizeof(float), sizeof(float) * width));
    }
    file_->setFrameBuffer(planes);
    file_->writePixels(last - first);
  }

  // The file, once all rows have been added.
  [[nodiscard]] std::string Take() {
    file_.reset();  // writes the table of offsets
    return output_->Take();
  }

 private:
  using Box = Imath::Box2i;
  using Corner = Imath::V2i;
  // Sizes and types of an attribute, and of a line and its place in the table; the library's own
  // attributes.
  static constexpr std::uint64_t kBytesPerAttribute = 32;
  static constexpr std::uint64_t kBytesPerLine = 16;
  static constexpr std::uint64_t kOwnBytes = 4096;

  void Begin(const std::vector<ImageChannel>& band) {
    if (band.empty()) throw std::invalid_argument("it has no channels");
    for (const ImageChannel& channel : band) {
      header_.channels().insert(channel.name, Imf::Channel(Imf::FLOAT));
      attribute_bytes_ += channel.name.size() + kBytesPerAttribute;
    }
    // Lines that would not get smaller are not packed.
    const Box& window = header_.dataWindow();
    const auto width = static_cast<std::uint64_t>(window.max.x - window.min.x) + 1;
    const auto height = static_cast<std::uint64_t>(window.max.y - window.min.y) + 1;
    output_.emplace(kOwnBytes + attribute_bytes_ +
                    height * (kBytesPerLine + width * band.size() * sizeof(float)));
    file_.emplace(*output_, header_, threads_);
  }

  Imf::Header header_;
  int threads_ = 0;
  std::uint64_t attribute_bytes_ = 0;
  std::optional<MemoryOutput> output_;
  std::optional<Imf::OutputFile> file_;  // goes before its output
};

// The file of an image like `head`; `add_rows` adds all of them to a writer.
StatusOr<std::string> Encode(const Image& head, int threads,
                             const std::function<void(ExrWriter& writer)>& add_rows) {
  if (head.width <= 0 || head.height <= 0) {
    return absl::InvalidArgumentError("an image without pixels cannot be written as EXR");
  }
  const auto pixels =
      static_cast<std::uint64_t>(head.width) * static_cast<std::uint64_t>(head.height);
  if (pixels > kMaxPixels) {
    return absl::InvalidArgumentError(absl::StrCat("an image of ", head.width, " x ", head.height,
                                                   " pixels is too large for EXR here"));
  }
  for (const auto& [key, value] : head.metadata) {
    if (key.empty() || key.size() > kMaxAttributeName || key.find('\0') != std::string::npos) {
      return absl::InvalidArgumentError(
          absl::StrCat("\"", key, "\" cannot be the name of an EXR attribute"));
    }
  }
  try {
    ExrWriter writer(head, threads);
    add_rows(writer);
    return writer.Take();
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write as EXR: ", error.what()));
  }
}

}  // namespace

StatusOr<std::string> EncodeExr(const Image& image) {
  return Encode(image, 1, [&](ExrWriter& writer) { writer.Add(image.channels, 0, image.height); });
}

StatusOr<std::string> EncodeExr(const BandedImage& image, int threads) {
  return Encode(image.head, threads, [&](ExrWriter& writer) {
    ForBands(image.head.width, image.head.height,
             [&](int first, int last) { writer.Add(image.rows(first, last), first, last); });
  });
}

StatusOr<Image> DecodeExr(std::string_view bytes) {
  LUCERNA_ASSIGN_OR_RETURN(const Extent extent, CheckHeader(bytes));
  LUCERNA_RETURN_IF_ERROR(CheckBlocks(bytes, extent));
  try {
    MemoryInput input(bytes);
    Imf::InputFile file(input, /*numThreads=*/0);
    const Imf::Header& header = file.header();
    const auto& window = header.dataWindow();
    Image image;
    image.width = window.max.x - window.min.x + 1;
    image.height = window.max.y - window.min.y + 1;
    // A header can name its window twice; the library then uses one of them.
    if (image.width != extent.width || image.height != extent.height) {
      return Garbage("its data window is ambiguous");
    }

    const auto& whole = header.displayWindow();
    const bool is_part = window != whole && whole.min == Imath::V2i(0, 0) &&
                         whole.max.x < INT_MAX && whole.max.y < INT_MAX && whole.max.x >= 0 &&
                         whole.max.y >= 0;
    if (is_part) {
      image.x0 = window.min.x;
      image.y0 = window.min.y;
      image.whole_width = whole.max.x + 1;
      image.whole_height = whole.max.y + 1;
    }

    for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
      if (channel.channel().xSampling != 1 || channel.channel().ySampling != 1) {
        return Garbage(absl::StrCat("its channel \"", channel.name(), "\" is subsampled"));
      }
      image.channels.push_back({channel.name(), {}});
    }
    const auto width = static_cast<std::size_t>(image.width);
    const auto height = static_cast<std::size_t>(image.height);
    if (image.channels.empty()) return Garbage("it has no channels");
    if (width * height * image.channels.size() >
        std::max(kSamplesOfAnyFile, kSamplesPerByte * bytes.size())) {
      return Garbage(absl::StrCat("it has ", image.channels.size(),
                                  " channels, too many for its size in pixels"));
    }
    for (auto attribute = header.begin(); attribute != header.end(); ++attribute) {
      const auto* text = dynamic_cast<const Imf::StringAttribute*>(&attribute.attribute());
      if (text != nullptr) image.metadata.emplace(attribute.name(), text->value());
    }

    // Memory grows band by band, as pixels really arrive: a short file that promises a large
    // image fails before much is allocated. Bands are whole rows of tiles, each read once.
    const auto tile_height =
        static_cast<std::size_t>(std::max<std::int64_t>(1, extent.tile_height));
    const std::size_t band = (kMaxLinesPerBlock + tile_height - 1) / tile_height * tile_height;
    for (std::size_t first = 0; first < height; first += band) {
      const std::size_t end = std::min(height, first + band);
      Imf::FrameBuffer planes;
      for (ImageChannel& channel : image.channels) {
        channel.pixels.resize(end * width);
        planes.insert(channel.name, Imf::Slice::Make(Imf::FLOAT, channel.pixels.data(), window,
                                                     sizeof(float), sizeof(float) * width));
      }
      file.setFrameBuffer(planes);
      file.readPixels(window.min.y + static_cast<int>(first),
                      window.min.y + static_cast<int>(end) - 1);
    }
    return image;
  } catch (const std::exception& error) {
    return Garbage(error.what());
  }
}

}  // namespace lucerna
