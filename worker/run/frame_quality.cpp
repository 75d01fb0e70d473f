#include "worker/run/frame_quality.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace baton {
namespace {

constexpr std::array kColors{"R", "G", "B"};
constexpr float kMaxHalf = 65504;
/// Pixels in which neighbours are compared, at most about so many.
constexpr std::int64_t kMostCompared = std::int64_t{1} << 19;
/// Variance of a pixel less the median of eight others, all alike normal, over that of a pixel.
constexpr double kMedianOfEight = 1.18;

struct Colors {
  std::array<const float*, 3> plane;

  explicit Colors(const FilmTile& image) {
    std::transform(kColors.begin(), kColors.end(), plane.begin(),
                   [&](const char* name) { return image.find(name); });
  }
  explicit operator bool() const { return plane[0] && plane[1] && plane[2]; }
  float grey(std::size_t i) const { return (plane[0][i] + plane[1][i] + plane[2][i]) / 3; }
};

struct Noise {
  double squares = 0, radiance = 0, pixels = 0;

  void add(double square, double grey) {
    squares += square;
    radiance += grey;
    pixels += 1;
  }
  float relative() const {
    return radiance > 0 ? static_cast<float>(std::sqrt(squares * pixels) / radiance) : 0.0f;
  }
};

Noise noise_of_halves(const Colors& colors, const float* variance, std::size_t num_pixels) {
  Noise noise;
  for (std::size_t i = 0; i < num_pixels; ++i) {
    const float grey = colors.grey(i);
    if (variance[i] > 0 && std::isfinite(variance[i]) && std::isfinite(grey))
      noise.add(variance[i], grey);
  }
  return noise;
}

float median_of_eight(std::array<float, 8>& values) {
  std::nth_element(values.begin(), values.begin() + 4, values.end());
  return (values[4] + *std::max_element(values.begin(), values.begin() + 4)) / 2;
}

Noise noise_of_neighbors(const FilmTile& image, const Colors& colors) {
  const std::ptrdiff_t width = image.rect.width(), height = image.rect.height();
  const std::ptrdiff_t stride = 1 + image.rect.area() / kMostCompared;
  const float* const alpha = image.find("A");
  Noise noise;
  std::array<float, 8> around{};
  for (std::ptrdiff_t y = 1; y + 1 < height; y += stride) {
    for (std::ptrdiff_t x = 1; x + 1 < width; ++x) {
      const std::ptrdiff_t at = y * width + x;
      const auto grey = [&](std::ptrdiff_t i) { return colors.grey(static_cast<std::size_t>(i)); };
      if (alpha != nullptr && alpha[at] == 0) continue;
      const std::array places{at - width - 1, at - width,     at - width + 1, at - 1,
                              at + 1,         at + width - 1, at + width,     at + width + 1};
      std::transform(places.begin(), places.end(), around.begin(), grey);
      const bool finite =
          std::isfinite(grey(at)) &&
          std::all_of(around.begin(), around.end(), [](float g) { return std::isfinite(g); });
      if (!finite) continue;
      const double residual = grey(at) - median_of_eight(around);
      noise.add(residual * residual / kMedianOfEight, grey(at));
    }
  }
  return noise;
}

/// Counts and sums of single values.
void judge_values(const Colors& colors, FrameQuality& quality) {
  double sum = 0, below = 0;
  for (std::size_t i = 0; i < quality.pixels; ++i) {
    float least = 0, largest = 0;
    bool finite = true;
    for (const float* plane : colors.plane) {
      finite = finite && std::isfinite(plane[i]);
      least = std::min(least, plane[i]);
      largest = std::max(largest, std::abs(plane[i]));
    }
    if (!finite) {
      ++quality.pixels_not_finite;
      continue;
    }
    quality.pixels_below_zero += least < 0 ? 1 : 0;
    quality.pixels_beyond_half += largest > kMaxHalf ? 1 : 0;
    quality.lowest = std::min(quality.lowest, least);
    for (const float* plane : colors.plane) {
      sum += plane[i];
      below -= std::min(plane[i], 0.0f);
    }
  }
  const std::uint64_t finite = quality.pixels - quality.pixels_not_finite;
  quality.mean = finite > 0 ? static_cast<float>(sum / static_cast<double>(3 * finite)) : 0.0f;
  quality.light_below_zero = sum > 0 ? static_cast<float>(below / sum) : 0.0f;
}

}  // namespace

FrameQuality judge_frame(const FilmTile& image) {
  FrameQuality quality{.pixels = image.num_pixels()};
  const Colors colors(image);
  if (!colors) return quality;
  judge_values(colors, quality);
  const float* const variance = image.find("variance");
  const Noise noise = variance != nullptr ? noise_of_halves(colors, variance, image.num_pixels())
                                          : noise_of_neighbors(image, colors);
  if (noise.pixels == 0 || noise.radiance <= 0) return quality;
  quality.noise = noise.relative();
  quality.noise_source = variance != nullptr ? NoiseSource::halves : NoiseSource::neighbors;
  return quality;
}

void clamp_negative(FilmTile& image) {
  for (const char* name : kColors) {
    float* const plane = image.find(name);
    if (plane == nullptr) continue;
    // Not std::max: NaN stays NaN, for who looks for it.
    for (std::size_t i = 0; i < image.num_pixels(); ++i) plane[i] = plane[i] < 0 ? 0 : plane[i];
  }
}

}  // namespace baton
