#include "common/image/contact_sheet.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "common/image/pixel_text.h"
#include "common/math/vec3.h"

namespace baton {
namespace {

constexpr float kMiddleGrey = 0.18f;
constexpr float kWhite = 8.0f;
constexpr int kGapPixels = 2;
constexpr float kGapGrey = 0.02f;

/// 0 -> 0, kWhite -> 1.
float reinhard(float v) { return v * (1 + v / (kWhite * kWhite)) / (1 + v); }

float finite_positive(float v) { return std::isfinite(v) && v > 0 ? v : 0.0f; }

Rgb tone_map_colour(const Rgb& colour) {
  const float luma = luminance(colour);
  if (luma <= 0) return {};
  const Rgb same_hue = colour * (reinhard(luma) / luma);
  const auto channel = [](float kept, float value) {
    const float faded = std::min(reinhard(value), 1.0f);
    return std::clamp(kept + (faded - kept) * faded, 0.0f, 1.0f);
  };
  return {channel(same_hue.x, colour.x), channel(same_hue.y, colour.y),
          channel(same_hue.z, colour.z)};
}

/// Mean colour over the box [x0, x1) x [y0, y1) of whole pixels.
Rgb box_mean(const RgbImage& image, int x0, int x1, int y0, int y1) {
  Rgb sum;
  for (int y = y0; y < y1; ++y) {
    const float* pixel = image.rgb.data() + (static_cast<std::size_t>(y) * image.width + x0) * 3;
    for (int x = x0; x < x1; ++x, pixel += 3) sum += Rgb{pixel[0], pixel[1], pixel[2]};
  }
  return sum / static_cast<float>((x1 - x0) * (y1 - y0));
}

/// Draws `frame`, resized to thumb_width x thumb_height, with its corner at (left, top) of `sheet`.
void draw_thumb(const RgbImage& frame, int thumb_width, int thumb_height, int left, int top,
                RgbImage& sheet) {
  // The source box of destination pixel i: at least one pixel wide.
  const auto low = [](int i, int from, int to) {
    return static_cast<int>(std::int64_t{i} * from / to);
  };
  for (int y = 0; y < thumb_height; ++y) {
    const int y0 = low(y, frame.height, thumb_height);
    const int y1 = std::max(low(y + 1, frame.height, thumb_height), y0 + 1);
    for (int x = 0; x < thumb_width; ++x) {
      const int x0 = low(x, frame.width, thumb_width);
      const int x1 = std::max(low(x + 1, frame.width, thumb_width), x0 + 1);
      const Rgb colour = box_mean(frame, x0, x1, y0, y1);
      float* out =
          sheet.rgb.data() + (static_cast<std::size_t>(top + y) * sheet.width + left + x) * 3;
      out[0] = colour.x;
      out[1] = colour.y;
      out[2] = colour.z;
    }
  }
}

int height_by_aspect(const RgbImage& image, int width) {
  const std::int64_t height = (std::int64_t{image.height} * width + image.width / 2) / image.width;
  return std::max(1, static_cast<int>(height));
}

}  // namespace

float auto_exposure(const RgbImage& image) {
  double sum_log = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i + 2 < image.rgb.size(); i += 3) {
    const float luma = luminance({image.rgb[i], image.rgb[i + 1], image.rgb[i + 2]});
    if (!std::isfinite(luma) || luma <= 0) continue;
    sum_log += std::log(static_cast<double>(luma));
    ++count;
  }
  if (count == 0) return 1;
  return static_cast<float>(kMiddleGrey / std::exp(sum_log / static_cast<double>(count)));
}

RgbImage tone_map(const RgbImage& image, float exposure) {
  RgbImage mapped = image;
  for (std::size_t i = 0; i + 2 < mapped.rgb.size(); i += 3) {
    float* pixel = mapped.rgb.data() + i;
    const Rgb colour = tone_map_colour(Rgb{finite_positive(pixel[0] * exposure),
                                           finite_positive(pixel[1] * exposure),
                                           finite_positive(pixel[2] * exposure)});
    pixel[0] = colour.x;
    pixel[1] = colour.y;
    pixel[2] = colour.z;
  }
  return mapped;
}

void paste(const RgbImage& from, const std::array<int, 4>& crop, int scale, int left, int top,
           RgbImage& to) {
  for (int y = 0; y < crop[3] * scale; ++y) {
    for (int x = 0; x < crop[2] * scale; ++x) {
      const std::size_t source =
          static_cast<std::size_t>(crop[1] + y / scale) * from.width + crop[0] + x / scale;
      const std::size_t target = static_cast<std::size_t>(top + y) * to.width + left + x;
      std::copy_n(from.rgb.begin() + static_cast<std::ptrdiff_t>(3 * source), 3,
                  to.rgb.begin() + static_cast<std::ptrdiff_t>(3 * target));
    }
  }
}

RgbImage resize(const RgbImage& image, int width) {
  BATON_CHECK(image.width > 0 && image.height > 0 && width > 0);
  RgbImage resized{width, height_by_aspect(image, width), {}};
  resized.rgb.resize(static_cast<std::size_t>(resized.width) * resized.height * 3);
  draw_thumb(image, resized.width, resized.height, 0, 0, resized);
  return resized;
}

RgbImage contact_sheet(std::span<const RgbImage> frames, int columns, int thumb_width,
                       std::span<const int> numbers) {
  BATON_CHECK(!frames.empty() && columns > 0 && thumb_width > 0);
  BATON_CHECK(numbers.empty() || numbers.size() == frames.size());
  const RgbImage& first = frames.front();
  const auto same_size = [&](const RgbImage& f) {
    return f.width == first.width && f.height == first.height;
  };
  BATON_CHECK(std::ranges::all_of(frames, same_size));

  // Lay out the sheet.
  const int num_frames = static_cast<int>(frames.size());
  const int num_columns = std::min(columns, num_frames);
  const int num_rows = (num_frames + num_columns - 1) / num_columns;
  const int thumb_height = height_by_aspect(first, thumb_width);
  RgbImage sheet{kGapPixels + num_columns * (thumb_width + kGapPixels),
                 kGapPixels + num_rows * (thumb_height + kGapPixels),
                 {}};
  sheet.rgb.assign(static_cast<std::size_t>(sheet.width) * sheet.height * 3, kGapGrey);

  // Draw the frames in reading order.
  for (int i = 0; i < num_frames; ++i) {
    const int left = kGapPixels + (i % num_columns) * (thumb_width + kGapPixels);
    const int top = kGapPixels + (i / num_columns) * (thumb_height + kGapPixels);
    draw_thumb(frames[i], thumb_width, thumb_height, left, top, sheet);
    if (!numbers.empty()) draw_text(std::to_string(numbers[i]), left, top + thumb_height, sheet);
  }
  return sheet;
}

}  // namespace baton
