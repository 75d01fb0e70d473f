#include <IexErrnoExc.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>
#include <ImfInputPart.h>
#include <ImfMatrixAttribute.h>
#include <ImfMultiPartInputFile.h>
#include <ImfPartType.h>
#include <ImfRational.h>
#include <ImfRationalAttribute.h>
#include <ImfRgbaFile.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfTimeCode.h>
#include <ImfTimeCodeAttribute.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <exception>
#include <limits>
#include <optional>

#include "common/base/file_stamp.h"
#include "common/base/limits.h"
#include "common/image/exr_channels.h"
#include "common/image/exr_header.h"
#include "common/image/exr_planes.h"
#include "common/image/image_io.h"
#include "common/image/openexr_colors.h"

namespace baton {
namespace {

/// Rows read at a time, so that memory grows only with data that is really there.
constexpr int kRowsPerRead = 256;

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

/// What OpenEXR threw: the system's word, or that the file is broken.
Error exr_error(const std::filesystem::path& path, const std::exception& fault) {
  if (dynamic_cast<const Iex::ErrnoExc*>(&fault) != nullptr)
    return {ErrorKind::io, fmt::format("{}: cannot read: {}", path.string(), fault.what())};
  return {ErrorKind::bad_input,
          fmt::format("{}: not a readable EXR file: {}", path.string(), fault.what())};
}

PixelRect rect_of(const Imath::Box2i& box) {
  const auto past = [](int last) {
    return last == std::numeric_limits<int>::max() ? last : last + 1;
  };
  return {box.min.x, box.min.y, past(box.max.x), past(box.max.y)};
}

std::vector<std::string> names_in(const Imf::Header& header) {
  std::vector<std::string> names;
  for (auto it = header.channels().begin(); it != header.channels().end(); ++it)
    names.emplace_back(it.name());
  return names;
}

std::vector<PlainChannel> channels_in(const Imf::Header& header) {
  return plain_channels(names_in(header));
}

/// The rectangle of an open file, checked against the limits.
Result<FilmTile> describe_window(const Imf::Header& header, const std::string& name) {
  const Imath::Box2i& window = header.dataWindow();
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  if (width < 1 || height < 1 || width > limits::kMaxImageSide || height > limits::kMaxImageSide) {
    return Error{ErrorKind::bad_input, fmt::format("{}: {} x {} pixels, expected 1 to {} a side",
                                                   name, width, height, limits::kMaxImageSide)};
  }
  return FilmTile{{window.min.x, window.min.y, window.max.x + 1, window.max.y + 1}, {}, {}};
}

/// The same with its channels, none of which is stored for some of the pixels alone.
Result<FilmTile> describe(const Imf::Header& header, const std::string& name) {
  BATON_ASSIGN(FilmTile image, describe_window(header, name));
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

/// Reads channels of an Imf::InputFile or Imf::InputPart into `image.values`. Throws what OpenEXR
/// throws.
template <class File>
void read_planes(File& file, const std::vector<StoredChannel>& stored, FilmTile& image) {
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

/// Reads `image.channels`, which have plain names.
void read_planes(Imf::InputFile& file, FilmTile& image) {
  std::vector<StoredChannel> stored;
  const std::vector<PlainChannel> all = channels_in(file.header());
  for (const std::string& name : image.channels)
    stored.push_back(std::ranges::find(all, name, &PlainChannel::name)->stored);
  read_planes(file, stored, image);
}

/// Opens an EXR file as File and calls `use(file)`; turns exceptions of OpenEXR into errors that
/// name the file.
template <class File = Imf::InputFile, class Use>
auto with_exr_file(const std::filesystem::path& path, Use use)
    -> decltype(use(std::declval<File&>())) {
  const Result<std::optional<FileStamp>> stamp = stamp_of(path);
  if (!stamp) return stamp.error();
  if (!*stamp) return Error{ErrorKind::io, fmt::format("{}: no such file", path.string())};
  if (const Status sound = check_exr_attributes(path); !sound) return sound.error();
  try {
    File file(path.c_str(), kOpenExrThreads);
    return use(file);
  } catch (const std::exception& fault) {
    return exr_error(path, fault);
  }
}

PixelRect window_of(const Imf::Header& header, const PixelRect& data, ExrWindow window) {
  if (window == ExrWindow::data) return data;
  const PixelRect display = rect_of(header.displayWindow());
  const PixelRect seen = common_part(display, data);
  return window == ExrWindow::display || seen.width() < 1 || seen.height() < 1 ? display : seen;
}

}  // namespace

Result<FilmTile> read_exr(const std::filesystem::path& path, ExrWindow window) {
  return with_exr_file(path, [&](Imf::InputFile& file) -> Result<FilmTile> {
    BATON_ASSIGN(FilmTile image, describe(file.header(), path.string()));
    const PixelRect shown = window_of(file.header(), image.rect, window);
    BATON_TRY(check_display(shown, image, path.string()));
    read_planes(file, image);
    return shown == image.rect ? std::move(image) : framed(image, shown);
  });
}

Result<std::vector<ExrPart>> read_exr_parts(const std::filesystem::path& path) {
  using Parts = std::vector<ExrPart>;
  return with_exr_file<Imf::MultiPartInputFile>(
      path, [&](Imf::MultiPartInputFile& file) -> Result<Parts> {
        Parts parts;
        for (int p = 0; p < file.parts(); ++p) {
          const Imf::Header& header = file.header(p);
          ExrPart& part = parts.emplace_back();
          part.layout.name = header.hasName() ? header.name() : "";
          part.data = rect_of(header.dataWindow());
          part.display = rect_of(header.displayWindow());
          const bool is_flat = !header.hasType() || Imf::isImage(header.type());
          if (is_flat) part.layout.channels = names_in(header);
          if (Imf::hasChromaticities(header))
            part.chromaticities = from_openexr(Imf::chromaticities(header));
        }
        return parts;
      });
}

Result<FilmTile> read_exr_part(const std::filesystem::path& path, std::size_t part,
                               const std::vector<std::string>& channels, ExrWindow window) {
  return with_exr_file<Imf::MultiPartInputFile>(
      path, [&](Imf::MultiPartInputFile& file) -> Result<FilmTile> {
        Imf::InputPart input(file, static_cast<int>(part));
        BATON_ASSIGN(FilmTile image, describe_window(input.header(), path.string()));
        image.channels = channels;
        const PixelRect shown = window_of(input.header(), image.rect, window);
        BATON_TRY(check_display(shown, image, path.string()));
        std::vector<StoredChannel> stored;
        for (const std::string& channel : channels) {
          const Imf::Channel& found = input.header().channels()[channel];
          if (found.xSampling != 1 || found.ySampling != 1)
            return Error{ErrorKind::bad_input,
                         fmt::format("{}: channel {} is subsampled, expected one value a pixel",
                                     path.string(), channel)};
          stored.push_back({channel});
        }
        read_planes(input, stored, image);
        return shown == image.rect ? std::move(image) : framed(image, shown);
      });
}

Result<FilmTile> read_exr_luma_chroma(const std::filesystem::path& path, const std::string& layer,
                                      ExrWindow window) {
  if (const Status sound = check_exr_attributes(path); !sound) return sound.error();
  try {
    Imf::RgbaInputFile file(path.c_str(), layer, kOpenExrThreads);
    BATON_ASSIGN(FilmTile image, describe_window(file.header(), path.string()));
    image.channels = {"R", "G", "B", "A"};
    const PixelRect shown = window_of(file.header(), image.rect, window);
    BATON_TRY(check_display(shown, image, path.string()));
    const std::size_t size = image.num_pixels();
    std::vector<Imf::Rgba> pixels(size);
    file.setFrameBuffer(reinterpret_cast<Imf::Rgba*>(at_corner(
                            reinterpret_cast<char*>(pixels.data()), image.rect, sizeof(Imf::Rgba))),
                        1, static_cast<std::size_t>(image.rect.width()));
    file.readPixels(image.rect.y0, image.rect.y1 - 1);
    image.values.resize(4 * size);
    for (std::size_t i = 0; i < size; ++i) {
      const Imf::Rgba& p = pixels[i];
      const std::array<float, 4> values{p.r, p.g, p.b, p.a};
      for (std::size_t c = 0; c < 4; ++c) image.values[c * size + i] = values[c];
    }
    return shown == image.rect ? std::move(image) : framed(image, shown);
  } catch (const std::exception& fault) {
    return exr_error(path, fault);
  }
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
