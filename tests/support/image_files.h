#pragma once

#include <cstdint>
#include <cstdlib>
#include <initializer_list>
#include <iterator>
#include <string>
#include <vector>

#include "tests/support/mesh_files.h"

namespace baton::test {

/// An 8-bit image as a Targa file: rows from the top; `channels` 1 (grey), 2 (with alpha), 3 (RGB)
/// or 4 (RGBA) values a pixel.
inline std::string targa(int width, int height, int channels,
                         const std::vector<std::uint8_t>& values) {
  std::string bytes(18, '\0');
  bytes[2] = static_cast<char>(channels < 3 ? 3 : 2);
  for (int i = 0; i < 2; ++i) {
    bytes[static_cast<std::size_t>(12 + i)] = static_cast<char>(width >> 8 * i & 0xFF);
    bytes[static_cast<std::size_t>(14 + i)] = static_cast<char>(height >> 8 * i & 0xFF);
  }
  bytes[16] = static_cast<char>(8 * channels);
  bytes[17] = static_cast<char>(0x20 | (channels % 2 == 0 ? 8 : 0));
  for (std::size_t i = 0; i < values.size(); i += static_cast<std::size_t>(channels)) {
    // The file has B, G, R, A.
    for (int c = 0; c < channels; ++c)
      bytes += static_cast<char>(
          values[i + static_cast<std::size_t>(channels > 2 && c < 3 ? 2 - c : c)]);
  }
  return bytes;
}

/// Writes targa() to a file of its own; returns its path.
inline std::string write_targa(const std::string& name, int width, int height, int channels,
                               const std::vector<std::uint8_t>& values) {
  return write_test_file(name, targa(width, height, channels, values));
}

/// A baseline JPEG file of 8 x 8 pixels of one colour, a byte for each component: its start, an
/// Adobe mark (JPEG's own colours) or none, and its scan.
inline std::string jpeg(const std::vector<std::uint8_t>& color, bool has_adobe) {
  const auto n = static_cast<int>(color.size());
  std::string bytes = "\xFF\xD8";
  const auto put = [&](std::initializer_list<int> values) {
    for (const int v : values) bytes += static_cast<char>(v);
  };
  if (has_adobe) {
    put({0xFF, 0xEE, 0, 14, 'A', 'd', 'o', 'b', 'e', 0, 100, 0, 0, 0, 0, 0});
  }
  put({0xFF, 0xDB, 0, 67, 0});
  bytes.append(64, '\1');
  put({0xFF, 0xC0, 0, 8 + 3 * n, 8, 0, 8, 0, 8, n});
  for (int i = 0; i < n; ++i) put({i + 1, 0x11, 0});
  // Differences of up to 11 bits have codes of four, the end of a block one of one.
  put({0xFF, 0xC4, 0, 31, 0, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  for (int i = 0; i < 12; ++i) put({i});
  put({0xFF, 0xC4, 0, 20, 0x10, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  put({0xFF, 0xDA, 0, 6 + 2 * n, n});
  for (int i = 0; i < n; ++i) put({i + 1, 0});
  put({0, 63, 0});
  std::string bits;
  const auto append = [&](unsigned value, int width) {
    for (int i = width - 1; i >= 0; --i) bits += (value >> i & 1) != 0 ? '1' : '0';
  };
  for (const std::uint8_t component : color) {
    const int difference = (component - 128) * 8;
    int width = 0;
    while (std::abs(difference) >> width != 0) ++width;
    append(static_cast<unsigned>(width), 4);
    append(static_cast<unsigned>(difference > 0 ? difference : difference + (1 << width) - 1),
           width);
    bits += '0';
  }
  while (bits.size() % 8 != 0) bits += '1';
  for (std::size_t i = 0; i < bits.size(); i += 8) {
    put({static_cast<int>(std::stoul(bits.substr(i, 8), nullptr, 2))});
    if (bytes.back() == '\xFF') put({0});
  }
  return bytes + "\xFF\xD9";
}

/// What a TIFF file says of its last channel.
enum class TiffExtra : std::uint16_t { unspecified = 0, associated = 1, unassociated = 2 };

/// RGB floats and a fourth channel, (height, width, 4), as a TIFF file; its path.
inline std::string write_tiff(const std::string& name, int width, int height, TiffExtra extra,
                              const std::vector<float>& values) {
  std::string bytes = "II*";
  bytes += '\0';
  const auto put = [&](std::uint32_t v, int size) {
    for (int i = 0; i < size; ++i) bytes += static_cast<char>(v >> 8 * i & 0xFF);
  };
  // Behind the header the arrays, the samples, then the list of tags.
  constexpr std::uint32_t kBits = 8, kFormats = 16, kSamples = 24;
  const auto size = static_cast<std::uint32_t>(4 * values.size());
  put(kSamples + size, 4);
  for (int i = 0; i < 4; ++i) put(32, 2);
  for (int i = 0; i < 4; ++i) put(3, 2);  // floats
  bytes.append(reinterpret_cast<const char*>(values.data()), size);
  const struct {
    std::uint32_t tag, type, count, value;
  } tags[] = {{256, 4, 1, static_cast<std::uint32_t>(width)},
              {257, 4, 1, static_cast<std::uint32_t>(height)},
              {258, 3, 4, kBits},
              {259, 3, 1, 1},
              {262, 3, 1, 2},
              {273, 4, 1, kSamples},
              {277, 3, 1, 4},
              {278, 4, 1, static_cast<std::uint32_t>(height)},
              {279, 4, 1, size},
              {284, 3, 1, 1},
              {338, 3, 1, static_cast<std::uint32_t>(extra)},
              {339, 3, 4, kFormats}};
  put(std::size(tags), 2);
  for (const auto& t : tags) {
    put(t.tag, 2);
    put(t.type, 2);
    put(t.count, 4);
    put(t.value, 4);
  }
  put(0, 4);
  return write_test_file(name, bytes);
}

}  // namespace baton::test
