#pragma once

#include <ImfChromaticities.h>

#include "common/image/color_space.h"

namespace baton {

/// As OpenEXR has them; and back.
inline Imf::Chromaticities to_openexr(const Chromaticities& c) {
  const auto xy = [](const std::array<float, 2>& v) { return Imath::V2f(v[0], v[1]); };
  return {xy(c.red), xy(c.green), xy(c.blue), xy(c.white)};
}
inline Chromaticities from_openexr(const Imf::Chromaticities& c) {
  return {{c.red.x, c.red.y}, {c.green.x, c.green.y}, {c.blue.x, c.blue.y}, {c.white.x, c.white.y}};
}

}  // namespace baton
