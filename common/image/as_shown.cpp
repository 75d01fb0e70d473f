#include "common/image/as_shown.h"

#include <algorithm>
#include <cmath>

namespace baton {

float encode_srgb(float linear) {
  if (!(linear > 0)) return 0;
  const float clamped = std::min(linear, 1.0f);
  return clamped <= 0.0031308f ? 12.92f * clamped
                               : 1.055f * std::pow(clamped, 1.0f / 2.4f) - 0.055f;
}

double exposure_as_shown(std::span<const float> values) {
  constexpr double kMean = 0.4;
  if (std::ranges::none_of(values, [](float value) { return value > 0; })) return 1;
  double low = 1e-9, high = 1e9;
  while (high > low * (1 + 1e-6)) {
    const double middle = std::sqrt(low * high);
    double sum = 0;
    for (const float value : values) sum += encode_srgb(static_cast<float>(middle * value));
    (sum < kMean * static_cast<double>(values.size()) ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

}  // namespace baton
