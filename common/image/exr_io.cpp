#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfFramesPerSecond.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfTimeCode.h>
#include <fmt/format.h>
#include <half.h>

#include <algorithm>
#include <array>
#include <exception>
#include <limits>
#include <optional>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/image/exr_planes.h"
#include "common/image/image_io.h"
#include "common/image/openexr_colors.h"

namespace baton {
namespace {

/// Level of zlib. OpenEXR's own choice is 4: a quarter slower for files that are two per cent
/// smaller.
constexpr int kZipLevel = 1;
constexpr float kMaxHalf = 65504.0f;
constexpr int kMostSmpteFrames = 30;  // a second

/// Collects what OpenEXR writes. Errors of the disk then belong to write_file_atomic, which reports
/// them all; OpenEXR's destructors would swallow them.
class MemoryStream : public Imf::OStream {
 public:
  explicit MemoryStream(const char* name) : Imf::OStream(name) {}
  void write(const char chars[], int count) override {
    const auto size = static_cast<std::size_t>(count);
    if (bytes_.size() < position_ + size) bytes_.resize(position_ + size);
    std::memcpy(bytes_.data() + position_, chars, size);
    position_ += size;
  }
  std::uint64_t tellp() override { return position_; }
  void seekp(std::uint64_t position) override { position_ = position; }
  Bytes take() { return std::move(bytes_); }

 private:
  Bytes bytes_;
  std::size_t position_ = 0;
};

std::optional<Imf::Compression> compression_of(const std::string& name) {
  if (name == "none") return Imf::NO_COMPRESSION;
  if (name == "rle") return Imf::RLE_COMPRESSION;
  if (name == "zips") return Imf::ZIPS_COMPRESSION;
  if (name == "zip") return Imf::ZIP_COMPRESSION;
  if (name == "piz") return Imf::PIZ_COMPRESSION;
  return std::nullopt;
}

std::vector<half> to_half(std::span<const float> values) {
  std::vector<half> halves(values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    halves[i] = half(std::clamp(values[i], -kMaxHalf, kMaxHalf));
  return halves;
}

Imath::M44f matrix(const std::array<float, 16>& rows) {
  Imath::M44f m;
  std::copy(rows.begin(), rows.end(), m.getValue());
  return m;
}

/// The field of frames counts to 39, and no rate between that and the largest of SMPTE is in use.
void add_time_code(Imf::Header& header, int frame, double frames_per_second) {
  const int rate = static_cast<int>(frames_per_second);
  if (rate != frames_per_second || rate > kMostSmpteFrames) return;
  const int second = frame / rate;
  Imf::addTimeCode(header,
                   Imf::TimeCode(second / 3600 % 24, second / 60 % 60, second % 60, frame % rate));
}

/// Both corners belong to OpenEXR's boxes.
Imath::Box2i box_of(const PixelRect& rect) {
  return {Imath::V2i(rect.x0, rect.y0), Imath::V2i(rect.x1 - 1, rect.y1 - 1)};
}

/// Header with channels and metadata.
Result<Imf::Header> make_header(const std::string& name, const FilmTile& image,
                                const ExrOptions& options) {
  const std::optional<Imf::Compression> compression = compression_of(options.compression);
  if (!compression) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: compression {}, expected none, rle, zips, zip or piz", name,
                             options.compression)};
  }
  Imf::Header header(box_of(options.display_window.value_or(image.rect)), box_of(image.rect));
  header.compression() = *compression;
  header.zipCompressionLevel() = kZipLevel;
  for (const std::string& channel : image.channels) {
    const bool is_half =
        options.half_float && std::ranges::find(options.whole, channel) == options.whole.end();
    header.channels().insert(stored_channel(channel, options.naming).name,
                             Imf::Channel(is_half ? Imf::HALF : Imf::FLOAT));
  }
  for (const auto& [key, value] : options.metadata) {
    if (header.find(key) != header.end()) {
      return Error{ErrorKind::bad_input,
                   fmt::format("{}: metadata {} is there already", name, key)};
    }
    header.insert(key, Imf::StringAttribute(value));
  }
  if (options.world_to_camera) Imf::addWorldToCamera(header, matrix(*options.world_to_camera));
  if (options.world_to_ndc) Imf::addWorldToNDC(header, matrix(*options.world_to_ndc));
  if (options.frames_per_second) {
    Imf::addFramesPerSecond(header, Imf::guessExactFps(*options.frames_per_second));
    if (options.frame_number)
      add_time_code(header, *options.frame_number, *options.frames_per_second);
  }
  Imf::addChromaticities(header, to_openexr(options.chromaticities));
  return header;
}

/// The whole file in memory. Throws what OpenEXR throws.
Bytes encode_planes(const std::string& name, const Imf::Header& header, const FilmTile& image,
                    ChannelNaming naming) {
  const std::size_t width = static_cast<std::size_t>(image.rect.width());
  std::vector<std::vector<half>> halves;
  halves.reserve(image.channels.size());
  std::vector<std::vector<float>> turned;
  turned.reserve(image.channels.size());
  Imf::FrameBuffer frame_buffer;
  for (std::size_t c = 0; c < image.channels.size(); ++c) {
    const StoredChannel stored = stored_channel(image.channels[c], naming);
    const Imf::PixelType type = header.channels()[stored.name].type;
    const float* plane = image.plane(c);
    if (stored.is_negated) {
      turned.emplace_back(plane, plane + image.num_pixels());
      negate(turned.back());
      plane = turned.back().data();
    }
    const char* base = reinterpret_cast<const char*>(plane);
    if (type == Imf::HALF) {
      halves.push_back(to_half({plane, image.num_pixels()}));
      base = reinterpret_cast<const char*>(halves.back().data());
    }
    const std::size_t pixel_bytes = type == Imf::HALF ? sizeof(half) : sizeof(float);
    // OpenEXR only reads through this pointer when it writes a file.
    frame_buffer.insert(
        stored.name, Imf::Slice(type, at_corner(const_cast<char*>(base), image.rect, pixel_bytes),
                                pixel_bytes, pixel_bytes * width));
  }
  MemoryStream stream(name.c_str());
  {
    Imf::OutputFile file(stream, header, kOpenExrWriters);
    file.setFrameBuffer(frame_buffer);
    file.writePixels(image.rect.height());
  }
  return stream.take();
}

}  // namespace

Result<Bytes> encode_exr(const std::string& name, const FilmTile& image,
                         const ExrOptions& options) {
  BATON_CHECK(image.rect.fits_within(limits::kMaxImageSide, limits::kMaxOverscan));
  BATON_CHECK(!image.channels.empty() &&
              image.values.size() == image.channels.size() * image.num_pixels());
  try {
    BATON_ASSIGN(const Imf::Header header, make_header(name, image, options));
    return encode_planes(name, header, image, options.naming);
  } catch (const std::exception& fault) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: cannot be written as EXR: {}", name, fault.what())};
  }
}

Status write_exr(const std::filesystem::path& path, const FilmTile& image,
                 const ExrOptions& options) {
  BATON_ASSIGN(const Bytes bytes, encode_exr(path.string(), image, options));
  return write_file_atomic(path, bytes);
}

}  // namespace baton
