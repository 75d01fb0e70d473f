#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/result.h"
#include "common/image/pixel_limit.h"

namespace baton {

/// Samples of an image as its file has them, row by row from the top, channels interleaved: grey,
/// or red, green and perhaps blue; then alpha.
struct Image {
  std::int32_t width = 0, height = 0, channels = 0;
  /// (height * width * channels). Integers are in [0, 1]: k / 255 or k / 65535.
  std::vector<float> samples;
  bool is_integer = false;     ///< not made of floats: colours are sRGB
  bool has_alpha = false;      ///< the last channel
  bool is_associated = false;  ///< colours are multiplied by alpha
  /// CIE xy of red, green, blue and white, as an EXR file says them.
  std::optional<std::array<float, 8>> chromaticities = {};
  std::vector<std::string> notes{};  ///< as RgbImage has them

  std::int32_t num_colors() const { return channels - (has_alpha ? 1 : 0); }
};

/// Reads an image file of any format but that of video. OpenImageIO is loaded when the first image
/// but EXR is read: it and what it brings take a quarter of a second and 40 MB. Alpha is what the
/// file calls so; of an EXR file the display window of what color_choice.h says; of several
/// pictures in another file the first. Errors name the file: missing, not an image, more than
/// kMaxTextureSide pixels a side, or than `limit` has in all.
Result<Image> read_image(const std::string& path, const PixelLimit& limit = {});
/// The same of a file in memory; `name` goes first in every error.
Result<Image> read_image(ByteView bytes, const std::string& name, const PixelLimit& limit = {});

}  // namespace baton
