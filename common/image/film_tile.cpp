#include "common/image/film_tile.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "common/base/limits.h"
#include "common/base/section_file.h"

namespace baton {
namespace {

constexpr SectionTag kMagic{'B', 'T', 'F', '1'};
constexpr std::uint16_t kVersion = 2;
constexpr SectionTag kMeta{'M', 'E', 'T', 'A'};
constexpr SectionTag kPixels{'P', 'I', 'X', 'L'};
constexpr std::array kTags{kMeta, kPixels};

/// Fills rectangle, channel names and origin.
Status decode_meta(const SectionFile& file, const std::string& name, StoredFilm& stored) {
  FilmTile& tile = stored.film;
  const auto fail = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, fmt::format("{}: section META {}", name, what)};
  };
  const Section* meta = file.find(kMeta);
  if (meta == nullptr) return fail("is missing");

  // Read the rectangle and the names.
  ByteReader reader(meta->payload);
  for (std::int32_t* side : {&tile.rect.x0, &tile.rect.y0, &tile.rect.x1, &tile.rect.y1}) {
    *side = reader.get<std::int32_t>();
  }
  const auto num_channels = reader.get<std::uint32_t>();
  if (num_channels < 1 || num_channels > limits::kMaxChannels) {
    return fail(
        fmt::format("has {} channels, expected 1 to {}", num_channels, limits::kMaxChannels));
  }
  for (std::uint32_t i = 0; i < num_channels; ++i) {
    std::string channel = reader.get_string();
    if (channel.empty()) return fail(fmt::format("has no name for channel {}", i));
    if (std::ranges::find(tile.channels, channel) != tile.channels.end()) {
      return fail(fmt::format("has channel {} twice", channel));
    }
    tile.channels.push_back(std::move(channel));
  }
  stored.origin.picture.high = reader.get<std::uint64_t>();
  stored.origin.picture.low = reader.get<std::uint64_t>();
  stored.origin.step = Step(reader.get<std::int32_t>());
  const auto pass = reader.get<std::uint8_t>();
  if (!reader.ok() || !reader.at_end())
    return fail("is not a rectangle, a list of names, a job, a frame and a pass");
  if (pass > static_cast<std::uint8_t>(FilmPass::second))
    return fail(fmt::format("has pass {}, expected 0 or 1", pass));
  stored.origin.pass = static_cast<FilmPass>(pass);
  if (stored.origin.step < Step(0) || stored.origin.step >= Step(limits::kMaxFrames)) {
    return fail(fmt::format("has frame index {}, expected 0 to {}", stored.origin.step,
                            limits::kMaxFrames - 1));
  }

  // Check the rectangle.
  const PixelRect& rect = tile.rect;
  if (!rect.fits_within(limits::kMaxImageSide, limits::kMaxOverscan)) {
    return fail(
        fmt::format("has rectangle [{}, {}) x [{}, {}), expected a non-empty one within {}..{}",
                    rect.x0, rect.x1, rect.y0, rect.y1, -limits::kMaxOverscan,
                    limits::kMaxImageSide + limits::kMaxOverscan));
  }
  return {};
}

}  // namespace

const float* FilmTile::find(std::string_view channel) const {
  const auto found = std::find(channels.begin(), channels.end(), channel);
  return found == channels.end() ? nullptr
                                 : plane(static_cast<std::size_t>(found - channels.begin()));
}

float* FilmTile::find(std::string_view channel) {
  return const_cast<float*>(std::as_const(*this).find(channel));
}

FilmTile part_of(const FilmTile& film, const PixelRect& rect) {
  BATON_CHECK(film.rect.contains(rect) && rect.area() > 0);
  return framed(film, rect);
}

FilmTile framed(const FilmTile& film, const PixelRect& rect) {
  FilmTile moved{rect, film.channels, {}};
  moved.values.resize(moved.channels.size() * moved.num_pixels());
  const PixelRect common = common_part(film.rect, rect);
  if (common.width() < 1) return moved;
  for (std::size_t c = 0; c < film.channels.size(); ++c) {
    for (std::int32_t y = common.y0; y < common.y1; ++y) {
      const auto at = [&](const PixelRect& in) {
        return std::ptrdiff_t{y - in.y0} * in.width() + (common.x0 - in.x0);
      };
      std::copy_n(film.plane(c) + at(film.rect), common.width(), moved.plane(c) + at(rect));
    }
  }
  return moved;
}

FilmTile blank_image(const PixelRect& rect, std::vector<std::string> channels) {
  FilmTile image{.rect = rect, .channels = std::move(channels), .values = {}};
  image.values.resize(image.channels.size() * image.num_pixels());
  return image;
}

Status paste_tile(const FilmTile& tile, FilmTile& image) {
  const PixelRect& from = tile.rect;
  const PixelRect& to = image.rect;
  if (from.x0 < to.x0 || from.y0 < to.y0 || from.x1 > to.x1 || from.y1 > to.y1 ||
      from.area() <= 0) {
    return Error{ErrorKind::bad_input, fmt::format("tile [{},{})x[{},{}) does not lie in the image",
                                                   from.x0, from.x1, from.y0, from.y1)};
  }
  if (tile.channels != image.channels) {
    return Error{ErrorKind::bad_input,
                 fmt::format("tile at {},{} has channels {}, expected {}", from.x0, from.y0,
                             fmt::join(tile.channels, " "), fmt::join(image.channels, " "))};
  }
  for (std::size_t channel = 0; channel < tile.channels.size(); ++channel) {
    for (std::int32_t y = from.y0; y < from.y1; ++y) {
      const float* const row = tile.plane(channel) + std::ptrdiff_t{y - from.y0} * from.width();
      std::copy_n(
          row, from.width(),
          image.plane(channel) + std::ptrdiff_t{y - to.y0} * to.width() + (from.x0 - to.x0));
    }
  }
  return {};
}

Bytes encode_film_tile(const FilmTile& tile, const FilmOrigin& origin) {
  BATON_CHECK(!tile.channels.empty() &&
              tile.values.size() == tile.channels.size() * tile.num_pixels());
  ByteWriter meta;
  for (const std::int32_t side : {tile.rect.x0, tile.rect.y0, tile.rect.x1, tile.rect.y1})
    meta.put(side);
  meta.put(static_cast<std::uint32_t>(tile.channels.size()));
  for (const std::string& channel : tile.channels) meta.put_string(channel);
  meta.put(origin.picture.high);
  meta.put(origin.picture.low);
  meta.put(origin.step.value());
  meta.put(static_cast<std::uint8_t>(origin.pass));
  const std::array sections{SectionView{.tag = kMeta, .payload = meta.bytes()},
                            SectionView{.tag = kPixels,
                                        .stride = sizeof(float),
                                        .payload = std::as_bytes(std::span(tile.values))}};
  return encode_sections(kMagic, kVersion, sections);
}

Result<StoredFilm> decode_film_tile(ByteView bytes, const std::string& name) {
  BATON_ASSIGN(const SectionFile file, decode_section_file(bytes, kMagic, kVersion, name));
  BATON_TRY(check_known_sections(file, kTags, name));
  StoredFilm stored;
  BATON_TRY(decode_meta(file, name, stored));
  FilmTile& tile = stored.film;
  const std::uint64_t num_values = tile.channels.size() * tile.num_pixels();
  BATON_ASSIGN(const ByteView payload,
               section_payload(file, kPixels, num_values * sizeof(float), name));
  tile.values.resize(num_values);
  std::memcpy(tile.values.data(), payload.data(), payload.size());
  return stored;
}

}  // namespace baton
