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
  /// PRIMARIES, or XYZ; EXPOSURE times COLORCORR, of all such lines.
  ImageColors colors;
  bool is_by_column = false;  ///< what is stored one by one are columns
  /// Rows are stored from below, columns from the right.
  bool is_bottom_up = false, is_right_to_left = false;
  /// What of the header counts as unknown, a line each, for people.
  std::vector<std::string> notes{};
};

/// `name` goes first in every error. Lines end with or without a carriage return. Exposures and
/// primaries of 0 and a missing FORMAT count as unknown. Errors: no Radiance header, another pixel
/// format than RGBE and XYZE, settings of colours that are no numbers, an exposure below zero. The
/// sides are not checked.
Result<RadianceHeader> read_radiance_header(ByteView file, const std::string& name);

/// The pixels, from the top down and from left to right, a mantissa m with exponent e as
/// m * 2^(e - 136): header.colors is for the caller. Memory grows only with rows that are really
/// there. Errors: rows that are damaged or missing.
Result<RgbImage> read_radiance_pixels(ByteView file, const RadianceHeader& header,
                                      const std::string& name);

}  // namespace baton
