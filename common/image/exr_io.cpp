#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfFramesPerSecond.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfMatrixAttribute.h>
#include <ImfOutputFile.h>
#include <ImfRational.h>
#include <ImfRationalAttribute.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfTimeCode.h>
#include <ImfTimeCodeAttribute.h>
#include <fmt/format.h>
#include <half.h>

#include <algorithm>
#include <array>
#include <exception>
#include <limits>
#include <optional>

#include "common/base/files.h"
#include "common/base/limits.h"
#include "common/image/exr_channels.h"
#include "common/image/exr_header.h"
#include "common/image/image_io.h"
#include "common/image/openexr_colors.h"

namespace baton {
namespace {

/// OpenEXR compresses on the calling thread: the worker has its own threads.
constexpr int kOpenExrThreads = 0;
/// Level of zlib. OpenEXR's own choice is 4: a quarter slower for files that are two per cent
/// smaller.
constexpr int kZipLevel = 1;
constexpr float kMaxHalf = 65504.0f;
constexpr int kMostSmpteFrames = 30;  // a second
/// Rows read at a time, so that memory grows only with data that is really there.
constexpr int kRowsPerRead = 256;

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

/// nullopt: an attribute of another kind.
std::optional<std::string> attribute_text(const Imf::Attribute& attribute) {
  if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&attribute))
    return text->value();
  if (const auto* rows = dynamic_cast<const Imf::M44fAttribute*>(&attribute)) {
    const float* const values = rows->value().getValue();
    return fmt::format("{}", fmt::join(values, values + 16, " "));
  }
  if (const auto* ratio = dynamic_cast<const Imf::RationalAttribute*>(&attribute))
    return fmt::format("{}/{}", ratio->value().n, ratio->value().d);
  if (const auto* code = dynamic_cast<const Imf::TimeCodeAttribute*>(&attribute)) {
    const Imf::TimeCode& t = code->value();
    return fmt::format("{:02}:{:02}:{:02}:{:02}", t.hours(), t.minutes(), t.seconds(), t.frame());
  }
  return std::nullopt;
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

void negate(std::vector<float>& values) {
  for (float& v : values) v = -v;
}

/// The address that pixel (0, 0) would have, which OpenEXR wants, where `rect` is stored from
/// `base`.
char* at_corner(char* base, const PixelRect& rect, std::size_t pixel_bytes) {
  const auto bytes = static_cast<std::ptrdiff_t>(pixel_bytes);
  return base - bytes * (std::ptrdiff_t{rect.y0} * rect.width() + rect.x0);
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
    Imf::OutputFile file(stream, header, kOpenExrThreads);
    file.setFrameBuffer(frame_buffer);
    file.writePixels(image.rect.height());
  }
  return stream.take();
}

PixelRect rect_of(const Imath::Box2i& box) {
  const auto past = [](int last) {
    return last == std::numeric_limits<int>::max() ? last : last + 1;
  };
  return {box.min.x, box.min.y, past(box.max.x), past(box.max.y)};
}

std::vector<PlainChannel> channels_in(const Imf::Header& header) {
  std::vector<std::string> names;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it)
    names.emplace_back(it.name());
  return plain_channels(names);
}

/// Rectangle and channel names of an open file, checked against the limits.
Result<FilmTile> describe(const Imf::Header& header, const std::string& name) {
  const Imath::Box2i& window = header.dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  if (width < 1 || height < 1 || width > limits::kMaxImageSide || height > limits::kMaxImageSide) {
    return Error{ErrorKind::bad_input, fmt::format("{}: {} x {} pixels, expected 1 to {} a side",
                                                   name, width, height, limits::kMaxImageSide)};
  }
  FilmTile image{{window.min.x, window.min.y, window.max.x + 1, window.max.y + 1}, {}, {}};
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
    const Imf::Channel& channel = it.channel();
    if (channel.xSampling != 1 || channel.ySampling != 1) {
      return Error{
          ErrorKind::bad_input,
          fmt::format("{}: channel {} is subsampled, expected one value a pixel", name, it.name())};
    }
  }
  for (PlainChannel& channel : channels_in(header))
    image.channels.push_back(std::move(channel.name));
  if (image.channels.empty() || image.channels.size() > limits::kMaxChannels) {
    return Error{ErrorKind::bad_input, fmt::format("{}: {} channels, expected 1 to {}", name,
                                                   image.channels.size(), limits::kMaxChannels)};
  }
  return image;
}

/// Whether `shown`, the display window, is no larger than an image may be, nor much larger than
/// what the file has of `image`.
Status check_display(const PixelRect& shown, const FilmTile& image, const std::string& name) {
  const auto values = static_cast<std::int64_t>(image.channels.size()) * shown.area();
  const bool fits = shown.width() <= limits::kMaxImageSide &&
                    shown.height() <= limits::kMaxImageSide && values <= limits::kMaxFramedValues;
  if (fits || image.rect.contains(shown)) return {};
  return Error{ErrorKind::bad_input,
               fmt::format("{}: a display window of {} x {} pixels, expected at most {} a side and "
                           "{} numbers where the data does not fill it",
                           name, shown.width(), shown.height(), limits::kMaxImageSide,
                           limits::kMaxFramedValues)};
}

/// Reads `image.channels` into `image.values`. Throws what OpenEXR throws.
void read_planes(Imf::InputFile& file, FilmTile& image) {
  std::vector<StoredChannel> stored;
  const std::vector<PlainChannel> all = channels_in(file.header());
  for (const std::string& name : image.channels)
    stored.push_back(std::ranges::find(all, name, &PlainChannel::name)->stored);
  const auto width = static_cast<std::size_t>(image.rect.width());
  const std::size_t row_bytes = width * sizeof(float);
  std::vector<std::vector<float>> planes(image.channels.size());
  for (std::int32_t y0 = image.rect.y0; y0 < image.rect.y1; y0 += kRowsPerRead) {
    const std::int32_t y1 = std::min(y0 + kRowsPerRead, image.rect.y1);
    Imf::FrameBuffer frame_buffer;
    for (std::size_t c = 0; c < planes.size(); ++c) {
      planes[c].resize(width * static_cast<std::size_t>(y1 - image.rect.y0));
      char* const base =
          at_corner(reinterpret_cast<char*>(planes[c].data()), image.rect, sizeof(float));
      frame_buffer.insert(stored[c].name, Imf::Slice(Imf::FLOAT, base, sizeof(float), row_bytes));
    }
    file.setFrameBuffer(frame_buffer);
    file.readPixels(y0, y1 - 1);
  }
  for (std::size_t c = 0; c < planes.size(); ++c) {
    if (stored[c].is_negated) negate(planes[c]);
    image.values.insert(image.values.end(), planes[c].begin(), planes[c].end());
  }
}

/// Opens an EXR file and calls `use(file)`; turns exceptions of OpenEXR into errors that name the
/// file.
template <class Use>
auto with_exr_file(const std::filesystem::path& path, Use use)
    -> decltype(use(std::declval<Imf::InputFile&>())) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    return Error{ErrorKind::io, fmt::format("{}: no such file", path.string())};
  }
  if (const Status sound = check_exr_attributes(path); !sound) return sound.error();
  try {
    Imf::InputFile file(path.c_str(), kOpenExrThreads);
    return use(file);
  } catch (const std::exception& fault) {
    return Error{ErrorKind::bad_input,
                 fmt::format("{}: not a readable EXR file: {}", path.string(), fault.what())};
  }
}

PixelRect window_of(const Imf::Header& header, const PixelRect& data, ExrWindow window) {
  if (window == ExrWindow::data) return data;
  const PixelRect display = rect_of(header.displayWindow());
  const PixelRect seen = common_part(display, data);
  return window == ExrWindow::display || seen.width() < 1 || seen.height() < 1 ? display : seen;
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

Result<FilmTile> read_exr_channels(const std::filesystem::path& path, const ChannelChoice& choose,
                                   ExrWindow window) {
  return with_exr_file(path, [&](Imf::InputFile& file) -> Result<FilmTile> {
    BATON_ASSIGN(FilmTile image, describe(file.header(), path.string()));
    BATON_ASSIGN(image.channels, choose(image.channels));
    const PixelRect shown = window_of(file.header(), image.rect, window);
    BATON_TRY(check_display(shown, image, path.string()));
    read_planes(file, image);
    return shown == image.rect ? std::move(image) : framed(image, shown);
  });
}

Result<FilmTile> read_exr(const std::filesystem::path& path, ExrWindow window) {
  const auto every = [](const std::vector<std::string>& all) { return Result(all); };
  return read_exr_channels(path, every, window);
}

Result<FilmTile> read_exr_rows(const std::filesystem::path& path, int y0, int y1) {
  return with_exr_file(path, [&](Imf::InputFile& file) -> Result<FilmTile> {
    if (!file.isComplete()) {
      return Error{ErrorKind::corrupt,
                   fmt::format("{}: its table of blocks has gaps", path.string())};
    }
    BATON_ASSIGN(FilmTile image, describe(file.header(), path.string()));
    image.rect.y0 = std::max(image.rect.y0, y0);
    image.rect.y1 = std::min(image.rect.y1, y1);
    if (image.rect.y0 < image.rect.y1) read_planes(file, image);
    return image;
  });
}

Result<PictureColors> read_exr_colors(const std::filesystem::path& path) {
  return with_exr_file(path, [](Imf::InputFile& file) -> Result<PictureColors> {
    const Imf::Header& header = file.header();
    const auto channels = channels_in(header);
    const auto red = std::ranges::find(channels, "R", &PlainChannel::name);
    if (red == channels.end() || !Imf::hasChromaticities(header)) return PictureColors{};
    return PictureColors{.chromaticities = from_openexr(Imf::chromaticities(header))};
  });
}

Result<ImageMetadata> read_exr_metadata(const std::filesystem::path& path) {
  return with_exr_file(path, [](Imf::InputFile& file) -> Result<ImageMetadata> {
    ImageMetadata metadata;
    const Imf::Header& header = file.header();
    for (auto it = header.begin(); it != header.end(); ++it) {
      if (auto text = attribute_text(it.attribute())) metadata.emplace_back(it.name(), *text);
    }
    return metadata;
  });
}

}  // namespace baton
