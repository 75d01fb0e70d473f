#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tests/support/mesh_files.h"

namespace baton::test {

/// An 8-bit image as a Targa file: rows from the top; `channels` 1 (grey), 3 (RGB) or 4 (RGBA)
/// values a pixel.
inline std::string targa(int width, int height, int channels,
                         const std::vector<std::uint8_t>& values) {
  std::string bytes(18, '\0');
  bytes[2] = static_cast<char>(channels == 1 ? 3 : 2);
  for (int i = 0; i < 2; ++i) {
    bytes[static_cast<std::size_t>(12 + i)] = static_cast<char>(width >> 8 * i & 0xFF);
    bytes[static_cast<std::size_t>(14 + i)] = static_cast<char>(height >> 8 * i & 0xFF);
  }
  bytes[16] = static_cast<char>(8 * channels);
  bytes[17] = static_cast<char>(0x20 | (channels == 4 ? 8 : 0));
  for (std::size_t i = 0; i < values.size(); i += static_cast<std::size_t>(channels)) {
    // The file has B, G, R, A.
    for (int c = 0; c < channels; ++c)
      bytes += static_cast<char>(
          values[i + static_cast<std::size_t>(channels > 1 && c < 3 ? 2 - c : c)]);
  }
  return bytes;
}

/// The same as a file of its own; its path.
inline std::string write_targa(const std::string& name, int width, int height, int channels,
                               const std::vector<std::uint8_t>& values) {
  return write_test_file(name, targa(width, height, channels, values));
}

}  // namespace baton::test
