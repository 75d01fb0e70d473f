#pragma once

#include <string>

#include "common/base/bytes.h"
#include "common/base/result.h"
#include "common/image/image_io.h"

namespace baton {

/// Radiance HDR images [Ward 1991, "Real pixels"]: a text header, then pixels of three 8-bit
/// mantissas and one exponent, with or without run-length encoding.

struct RadianceHeader {
  int width = 0, height = 0;
  std::size_t size_bytes = 0;  ///< the pixels start here
  /// PRIMARIES; EXPOSURE times COLORCORR, of all such lines.
  PictureColors colors;
};

/// `name` goes first in every error. Errors: no Radiance header, another pixel format than RGBE,
/// rows that do not go from the top down and from left to right, settings of colours that are no
/// numbers, an exposure that is not above zero. The sides are not checked.
Result<RadianceHeader> read_radiance_header(ByteView file, const std::string& name);

/// The pixels, a mantissa m with exponent e as m * 2^(e - 136), as they are stored: header.colors
/// is for the caller. Memory grows only with rows that are really there. Errors: rows that are
/// damaged or missing.
Result<RgbImage> read_radiance_pixels(ByteView file, const RadianceHeader& header,
                                      const std::string& name);

}  // namespace baton
