#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/result.h"

namespace baton {

/// Samples of an image as its file has them, row by row from the top, channels interleaved.
struct Image {
  std::int32_t width = 0, height = 0, channels = 0;
  /// (height * width * channels). Integers are in [0, 1]: k / 255 or k / 65535.
  std::vector<float> samples;
  bool is_integer = false;  ///< not made of floats: colours are sRGB
};

/// Reads an image file of any format but that of video. OpenImageIO is loaded when the first image
/// is read: it and what it brings take a quarter of a second and 40 MB. Alpha stays unassociated,
/// of several pictures in a file the first is read. Errors name the file: missing, not an image,
/// more than kMaxTextureSide pixels a side, not 1 to 4 channels.
Result<Image> read_image(const std::string& path);
/// The same of a file in memory; `name` goes first in every error.
Result<Image> read_image(ByteView bytes, const std::string& name);

}  // namespace baton
