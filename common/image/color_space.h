#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>

#include "common/base/result.h"
#include "common/math/vec3.h"

namespace baton {

/// CIE xy of the primaries and the white of an RGB space. The default, Rec. 709 with the white of
/// D65, is the space that Baton works in and writes.
struct Chromaticities {
  std::array<float, 2> red{0.64f, 0.33f}, green{0.3f, 0.6f}, blue{0.15f, 0.06f};
  std::array<float, 2> white{0.3127f, 0.3290f};

  bool operator==(const Chromaticities&) const = default;
};

/// From linear RGB of a space to that of Rec. 709, white to white [Bradford, as in ICC.1:2010,
/// annex E]. nullopt: it is Rec. 709, but for the rounding of a header. Error: no such space.
Result<std::optional<Mat3>> to_rec709(const Chromaticities& from);

/// Whether a header that says these means "unknown": all are 0.
bool is_unknown(const Chromaticities& c);

/// What the header of an image says of its numbers.
struct ImageColors {
  Chromaticities chromaticities;
  /// They are CIE X, Y and Z, of the white of Rec. 709, in place of R, G and B.
  bool is_xyz = false;
  /// Factor by which radiance was multiplied before it was stored, > 0.
  Rgb factor{1, 1, 1};

  bool operator==(const ImageColors&) const = default;
};

/// Makes linear RGB of a space, the first three of `channels` numbers of each pixel, that of
/// Rec. 709, undoing the factor. Error: no such space.
Status convert_to_rec709(std::span<float> pixels, std::size_t channels, const ImageColors& from);

/// "to Rec. 709, from red (0.713, 0.293), ...; divided by its exposure, 2"; empty: the numbers are
/// taken as they are.
std::string conversion_text(const ImageColors& colors);

}  // namespace baton
