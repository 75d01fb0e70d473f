#include "common/image/radiance.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

namespace baton {
namespace {

using Rgbe = std::array<std::uint8_t, 4>;

/// Rows of other widths are never stored plane by plane.
constexpr int kMinPlanarWidth = 8;
constexpr int kMaxPlanarWidth = 32767;

Error unreadable(const std::string& name, const std::string& what) {
  return {ErrorKind::bad_input,
          fmt::format("{}: not a readable Radiance HDR file: {}", name, what)};
}

/// Splits the first line, without its end, from the text. False when no line ends.
bool take_line(std::string_view& text, std::string_view& line) {
  const std::size_t end = text.find('\n');
  if (end == std::string_view::npos) return false;
  line = text.substr(0, end);
  text.remove_prefix(end + 1);
  return true;
}

/// "-Y <height> +X <width>": rows from the top down, pixels from left to right.
bool parse_sides(std::string_view line, int& width, int& height) {
  const auto take_number = [&](std::string_view before, int& value) {
    if (!line.starts_with(before)) return false;
    line.remove_prefix(before.size());
    const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), value);
    line.remove_prefix(static_cast<std::size_t>(end - line.data()));
    return error == std::errc();
  };
  return take_number("-Y ", height) && take_number(" +X ", width) && line.empty();
}

/// N numbers, apart by blanks.
template <std::size_t N>
std::optional<std::array<float, N>> parse_numbers(std::string_view text) {
  std::array<float, N> numbers{};
  for (float& number : numbers) {
    text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc() || !std::isfinite(number)) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  }
  return numbers;
}

/// EXPOSURE, COLORCORR and PRIMARIES; other lines are let pass. The first two may come several
/// times: each program that changed the pixels adds its own. False: not the numbers that it needs.
bool take_color_setting(std::string_view line, PictureColors& colors) {
  const auto value_of = [&](std::string_view key) {
    return line.starts_with(key) ? std::optional(line.substr(key.size())) : std::nullopt;
  };
  std::optional<std::array<float, 3>> factor;
  if (const auto value = value_of("EXPOSURE=")) {
    const auto exposure = parse_numbers<1>(*value);
    if (!exposure) return false;
    factor = {(*exposure)[0], (*exposure)[0], (*exposure)[0]};
  } else if (const auto correction = value_of("COLORCORR=")) {
    factor = parse_numbers<3>(*correction);
    if (!factor) return false;
  } else if (const auto primaries = value_of("PRIMARIES=")) {
    const auto xy = parse_numbers<8>(*primaries);
    if (!xy) return false;
    const auto& p = *xy;
    colors.chromaticities = {{p[0], p[1]}, {p[2], p[3]}, {p[4], p[5]}, {p[6], p[7]}};
  }
  if (!factor) return true;
  const Rgb f = colors.factor * Rgb{(*factor)[0], (*factor)[1], (*factor)[2]};
  colors.factor = f;
  const auto is_good = [](float v) { return v > 0 && std::isfinite(v); };
  return is_good(f.x) && is_good(f.y) && is_good(f.z);
}

std::uint8_t byte_at(ByteView bytes, std::size_t i) {
  return std::to_integer<std::uint8_t>(bytes[i]);
}

Rgbe pixel_at(ByteView bytes) {
  return {byte_at(bytes, 0), byte_at(bytes, 1), byte_at(bytes, 2), byte_at(bytes, 3)};
}

/// One channel of a row: counts up to 128 precede as many values, larger ones (less 128) one value
/// that repeats. Takes what it reads off `in`; false when it does not fill the row exactly.
bool read_plane(ByteView& in, std::span<Rgbe> row, std::size_t channel) {
  for (std::size_t x = 0; x < row.size();) {
    if (in.size() < 2) return false;
    const std::size_t head = byte_at(in, 0);
    const bool repeats = head > 128;
    const std::size_t count = repeats ? head - 128 : head;
    const std::size_t stored = repeats ? 1 : count;
    if (count == 0 || count > row.size() - x || in.size() < 1 + stored) return false;
    for (std::size_t i = 0; i < count; ++i) row[x++][channel] = byte_at(in, repeats ? 1 : 1 + i);
    in = in.subspan(1 + stored);
  }
  return true;
}

/// A row pixel by pixel. (1, 1, 1, n) is none, but repeats the one before n times; several in a row
/// are the digits of n, base 256, the lowest first.
bool read_plain(ByteView& in, std::span<Rgbe> row) {
  int shift = 0;
  for (std::size_t x = 0; x < row.size();) {
    if (in.size() < sizeof(Rgbe)) return false;
    const Rgbe pixel = pixel_at(in);
    in = in.subspan(sizeof(Rgbe));
    if (pixel[0] != 1 || pixel[1] != 1 || pixel[2] != 1) {
      row[x++] = pixel;
      shift = 0;
      continue;
    }
    if (x == 0 || shift > 16) return false;
    const std::size_t count = std::size_t{pixel[3]} << shift;
    if (count > row.size() - x) return false;
    std::fill_n(row.begin() + static_cast<std::ptrdiff_t>(x), count, row[x - 1]);
    x += count;
    shift += 8;
  }
  return true;
}

bool read_row(ByteView& in, std::span<Rgbe> row) {
  // A planar row begins with 2, 2 and its width.
  const int width = static_cast<int>(row.size());
  const bool may_be_planar =
      width >= kMinPlanarWidth && width <= kMaxPlanarWidth && in.size() >= sizeof(Rgbe);
  if (!may_be_planar) return read_plain(in, row);
  const Rgbe start = pixel_at(in);
  if (start[0] != 2 || start[1] != 2 || start[2] * 256 + start[3] != width) {
    return read_plain(in, row);
  }

  in = in.subspan(sizeof(Rgbe));
  for (std::size_t channel = 0; channel < sizeof(Rgbe); ++channel) {
    if (!read_plane(in, row, channel)) return false;
  }
  return true;
}

}  // namespace

Result<RadianceHeader> read_radiance_header(ByteView file, const std::string& name) {
  std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  std::string_view line;
  if (!text.starts_with("#?")) return unreadable(name, "it does not begin with #?");

  // Settings up to an empty line.
  RadianceHeader header;
  bool is_rgbe = false;
  do {
    if (!take_line(text, line)) return unreadable(name, "its header does not end");
    is_rgbe = is_rgbe || line == "FORMAT=32-bit_rle_rgbe";
    if (!take_color_setting(line, header.colors))
      return unreadable(name, fmt::format("a line {}", line.substr(0, 60)));
  } while (!line.empty());
  if (!is_rgbe) return unreadable(name, "no line FORMAT=32-bit_rle_rgbe");

  if (!take_line(text, line) || !parse_sides(line, header.width, header.height)) {
    return unreadable(name, "expected -Y HEIGHT +X WIDTH after its header");
  }
  header.size_bytes = file.size() - text.size();
  return header;
}

Result<RgbImage> read_radiance_pixels(ByteView file, const RadianceHeader& header,
                                      const std::string& name) {
  RgbImage image{header.width, header.height, {}};
  std::vector<Rgbe> row(static_cast<std::size_t>(header.width));
  ByteView rest = file.subspan(header.size_bytes);
  for (int y = 0; y < header.height; ++y) {
    if (!read_row(rest, row)) {
      return unreadable(name, fmt::format("row {} of {} is damaged or cut off", y, header.height));
    }
    for (const Rgbe& pixel : row) {
      const float scale = pixel[3] == 0 ? 0.0f : std::ldexp(1.0f, pixel[3] - 136);
      for (std::size_t c = 0; c < 3; ++c) {
        image.rgb.push_back(static_cast<float>(pixel[c]) * scale);
      }
    }
  }
  return image;
}

}  // namespace baton
