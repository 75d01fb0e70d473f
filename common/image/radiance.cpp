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

/// Without blanks at both ends.
std::string_view trimmed(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  return text.substr(0, text.find_last_not_of(" \t") + 1);
}

/// Splits the first line, without its end, from the text. False when no line ends.
bool take_line(std::string_view& text, std::string_view& line) {
  const std::size_t end = text.find('\n');
  if (end == std::string_view::npos) return false;
  line = text.substr(0, end);
  if (line.ends_with('\r')) line.remove_suffix(1);
  text.remove_prefix(end + 1);
  return true;
}

/// An axis with a sign, and a number.
struct Side {
  char sign = 0, axis = 0;
  int size = 0;
};

/// Takes "-Y 512" off the line.
std::optional<Side> take_side(std::string_view& line) {
  line = trimmed(line);
  if (line.size() < 2) return std::nullopt;
  Side side{line[0], line[1], 0};
  if ((side.sign != '-' && side.sign != '+') || (side.axis != 'X' && side.axis != 'Y'))
    return std::nullopt;
  line = trimmed(line.substr(2));
  const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), side.size);
  line.remove_prefix(static_cast<std::size_t>(end - line.data()));
  return error == std::errc() ? std::optional(side) : std::nullopt;
}

/// "-Y <height> +X <width>": rows from the top down, pixels from left to right; +Y is from below,
/// -X from the right, and the first axis that of what is stored one by one.
bool parse_sides(std::string_view line, RadianceHeader& header) {
  const std::optional<Side> outer = take_side(line), inner = take_side(line);
  if (!outer || !inner || !line.empty() || outer->axis == inner->axis) return false;
  header.is_by_column = outer->axis == 'X';
  const Side &x = header.is_by_column ? *outer : *inner, &y = header.is_by_column ? *inner : *outer;
  header.width = x.size;
  header.height = y.size;
  header.is_right_to_left = x.sign == '-';
  header.is_bottom_up = y.sign == '+';
  return true;
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

/// What stands behind a key and "=", in whichever case; nullopt: another key.
std::optional<std::string_view> value_of(std::string_view line, std::string_view key) {
  const auto is_same = [](char a, char b) {
    return (a >= 'a' && a <= 'z' ? a - 'a' + 'A' : a) == b;
  };
  const bool is_it = line.size() > key.size() && line[key.size()] == '=' &&
                     std::equal(key.begin(), key.end(), line.begin(),
                                [&](char want, char have) { return is_same(have, want); });
  return is_it ? std::optional(line.substr(key.size() + 1)) : std::nullopt;
}

/// EXPOSURE, COLORCORR and PRIMARIES; other lines are let pass. The first two may come several
/// times: each program that changed the pixels adds its own. Zeros stand for what a program did not
/// know. False: not the numbers that it needs.
bool take_color_setting(std::string_view line, RadianceHeader& header) {
  ImageColors& colors = header.colors;
  const auto counts_as_unknown = [&] {
    header.notes.push_back(fmt::format("{} counts as unknown", trimmed(line.substr(0, 60))));
    return true;
  };
  std::optional<std::array<float, 3>> factor;
  if (const auto value = value_of(line, "EXPOSURE")) {
    const auto exposure = parse_numbers<1>(*value);
    if (!exposure) return false;
    factor = {(*exposure)[0], (*exposure)[0], (*exposure)[0]};
  } else if (const auto correction = value_of(line, "COLORCORR")) {
    factor = parse_numbers<3>(*correction);
    if (!factor) return false;
  } else if (const auto primaries = value_of(line, "PRIMARIES")) {
    const auto xy = parse_numbers<8>(*primaries);
    if (!xy) return false;
    const auto& p = *xy;
    const Chromaticities given{{p[0], p[1]}, {p[2], p[3]}, {p[4], p[5]}, {p[6], p[7]}};
    if (is_unknown(given)) return counts_as_unknown();
    colors.chromaticities = given;
  }
  if (!factor) return true;
  if (*factor == std::array{0.0f, 0.0f, 0.0f}) return counts_as_unknown();
  const Rgb f = colors.factor * Rgb{(*factor)[0], (*factor)[1], (*factor)[2]};
  colors.factor = f;
  const auto is_good = [](float v) { return v > 0 && std::isfinite(v); };
  return is_good(f.x) && is_good(f.y) && is_good(f.z);
}

/// False: another format of pixels.
bool take_format(std::string_view line, bool& is_known, RadianceHeader& header) {
  const auto value = value_of(line, "FORMAT");
  if (!value) return true;
  const std::string_view format = trimmed(*value);
  is_known = true;
  header.colors.is_xyz = format == "32-bit_rle_xyze";
  return header.colors.is_xyz || format == "32-bit_rle_rgbe";
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

/// Colours of the pixels as they are stored, from the top down and from left to right.
std::vector<float> turned(const RadianceHeader& header, std::vector<float> stored) {
  if (!header.is_by_column && !header.is_bottom_up && !header.is_right_to_left) return stored;
  const auto width = static_cast<std::size_t>(header.width);
  const auto height = static_cast<std::size_t>(header.height);
  std::vector<float> rgb(stored.size());
  for (std::size_t y = 0; y < height; ++y) {
    for (std::size_t x = 0; x < width; ++x) {
      const std::size_t column = header.is_right_to_left ? width - 1 - x : x;
      const std::size_t row = header.is_bottom_up ? height - 1 - y : y;
      const std::size_t from = header.is_by_column ? column * height + row : row * width + column;
      std::copy_n(stored.begin() + static_cast<std::ptrdiff_t>(3 * from), 3,
                  rgb.begin() + static_cast<std::ptrdiff_t>(3 * (y * width + x)));
    }
  }
  return rgb;
}

}  // namespace

Result<RadianceHeader> read_radiance_header(ByteView file, const std::string& name) {
  std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  std::string_view line;
  if (!text.starts_with("#?")) return unreadable(name, "it does not begin with #?");

  // Settings up to an empty line.
  RadianceHeader header;
  bool is_known = false;
  do {
    if (!take_line(text, line)) return unreadable(name, "its header does not end");
    if (!take_format(line, is_known, header))
      return unreadable(name, "expected FORMAT=32-bit_rle_rgbe or 32-bit_rle_xyze");
    if (!take_color_setting(line, header))
      return unreadable(name, fmt::format("a line {}", line.substr(0, 60)));
  } while (!line.empty());
  if (!is_known) header.notes.push_back("has no line FORMAT=, taken as 32-bit_rle_rgbe");

  if (!take_line(text, line) || !parse_sides(line, header)) {
    return unreadable(name, "expected -Y HEIGHT +X WIDTH after its header");
  }
  header.size_bytes = file.size() - text.size();
  return header;
}

Result<RgbImage> read_radiance_pixels(ByteView file, const RadianceHeader& header,
                                      const std::string& name) {
  const int lines = header.is_by_column ? header.width : header.height;
  std::vector<Rgbe> line(
      static_cast<std::size_t>(header.is_by_column ? header.height : header.width));
  std::vector<float> stored;  // line by line
  ByteView rest = file.subspan(header.size_bytes);
  for (int i = 0; i < lines; ++i) {
    if (!read_row(rest, line)) {
      return unreadable(name, fmt::format("{} {} of {} is damaged or cut off",
                                          header.is_by_column ? "column" : "row", i, lines));
    }
    for (const Rgbe& pixel : line) {
      const float scale = pixel[3] == 0 ? 0.0f : std::ldexp(1.0f, pixel[3] - 136);
      for (std::size_t c = 0; c < 3; ++c) stored.push_back(static_cast<float>(pixel[c]) * scale);
    }
  }
  RgbImage image{header.width, header.height, {}};
  image.rgb = turned(header, std::move(stored));
  return image;
}

}  // namespace baton
