#include "jobs/study/crop_strip.h"

#include <algorithm>
#include <cmath>

#include "common/image/contact_sheet.h"
#include "common/math/vec3.h"
#include "jobs/study/flip.h"

namespace baton {
namespace {

constexpr int kLeastWidth = 160;
constexpr int kGap = 4;

/// Anchors of the "magma" map of matplotlib, sRGB.
constexpr std::array<std::array<float, 3>, 6> kHeat{{{0.001f, 0.000f, 0.014f},
                                                     {0.232f, 0.060f, 0.438f},
                                                     {0.550f, 0.161f, 0.506f},
                                                     {0.868f, 0.288f, 0.409f},
                                                     {0.995f, 0.624f, 0.427f},
                                                     {0.987f, 0.991f, 0.750f}}};

/// Linear colour of an error in [0, 1].
std::array<float, 3> heat(float error) {
  const float at = std::clamp(error, 0.0f, 1.0f) * (kHeat.size() - 1);
  const auto low = std::min(static_cast<std::size_t>(at), kHeat.size() - 2);
  const float share = at - static_cast<float>(low);
  std::array<float, 3> colour{};
  for (std::size_t k = 0; k < 3; ++k)
    colour[k] = std::pow(kHeat[low][k] + share * (kHeat[low + 1][k] - kHeat[low][k]), 2.2f);
  return colour;
}

RgbImage heat_map(const std::vector<float>& errors, int width, int height) {
  RgbImage image{width, height, {}};
  for (const float error : errors) {
    const std::array<float, 3> colour = heat(error);
    image.rgb.insert(image.rgb.end(), colour.begin(), colour.end());
  }
  return image;
}

}  // namespace

RgbImage crop_strip(const Reference& reference, std::span<const MeasuredFrame> tests,
                    const std::array<int, 4>& crop) {
  const int scale = std::max(1, (kLeastWidth + crop[2] - 1) / crop[2]);
  const int width = crop[2] * scale, height = crop[3] * scale;
  const int columns = static_cast<int>(tests.size()) + 1;
  RgbImage strip{columns * (width + kGap) - kGap, 2 * height + kGap, {}};
  strip.rgb.assign(3 * static_cast<std::size_t>(strip.width) * strip.height, 1.0f);

  paste(reference.displayed, crop, scale, 0, 0, strip);
  for (std::size_t i = 0; i < tests.size(); ++i) {
    const int left = static_cast<int>(i + 1) * (width + kGap);
    const RgbImage displayed = tone_map(tests[i].image, reference.exposure);
    const RgbImage errors = heat_map(flip_difference(reference.displayed, displayed),
                                     displayed.width, displayed.height);
    paste(displayed, crop, scale, left, 0, strip);
    paste(errors, crop, scale, left, height + kGap, strip);
  }
  return strip;
}

}  // namespace baton
