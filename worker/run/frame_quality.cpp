#include "worker/run/frame_quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <span>

#include "common/image/noise.h"

namespace baton {
namespace {

constexpr float kMaxHalf = 65504;

/// Counts and sums of single values.
void judge_values(const FilmColors& colors, FrameQuality& quality) {
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

/// Whether all pixels tell their error.
bool is_scatter(const FilmTile& image) {
  const std::span<const float> errors(image.find(kErrorChannel), image.num_pixels());
  return std::ranges::find(errors, kErrorUnknown) == errors.end();
}

}  // namespace

FrameQuality judge_frame(const FilmTile& image, const Lend& lend) {
  FrameQuality quality{.pixels = image.num_pixels()};
  const FilmColors colors(image);
  if (!colors) return quality;
  FrameNoise noise;
  float cycles = 0, shown = 0;
  const std::array<std::function<void()>, 4> looks{
      [&] { judge_values(colors, quality); }, [&] { cycles = cycles_noise(image); },
      [&] { noise = noise_of_film(image); }, [&] { shown = noise_as_shown(image); }};
  share_parts(lend, "judging a frame", looks.size(), [&](std::size_t i) { looks[i](); });
  quality.cycles_noise = cycles;
  if (noise.is_told()) {
    quality.noise = noise.relative();
    quality.noise_error = noise.error_share();
    quality.noise_shown = shown;
    quality.noise_source = is_scatter(image) ? NoiseSource::scatter : NoiseSource::probes;
  }
  return quality;
}

FrameQuality judge_composite(const FilmTile& image, const FrameQuality& rendered,
                             const Lend& lend) {
  FrameQuality quality = judge_frame(image, lend);
  quality.pixels_below_zero = rendered.pixels_below_zero;
  quality.lowest = rendered.lowest;
  quality.light_below_zero =
      quality.mean > 0 ? rendered.light_below_zero * rendered.mean / quality.mean : 0.0f;
  return quality;
}

void clamp_negative(FilmTile& image) {
  for (const char* name : {"R", "G", "B"}) {
    float* const plane = image.find(name);
    if (plane == nullptr) continue;
    // Not std::max: NaN stays NaN, for who tests for it.
    for (std::size_t i = 0; i < image.num_pixels(); ++i) plane[i] = plane[i] < 0 ? 0 : plane[i];
  }
}

}  // namespace baton
