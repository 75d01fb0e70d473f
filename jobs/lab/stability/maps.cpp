#include "jobs/lab/stability/maps.h"

#include <limits>

#include "common/math/vec3.h"

namespace baton::stability {
namespace {

constexpr int kWidth = 64;
constexpr int kHeight = 32;

RgbImage constant(const Rgb& color, int width = kWidth, int height = kHeight) {
  RgbImage image{width, height, {}};
  for (int i = 0; i < width * height; ++i) {
    image.rgb.insert(image.rgb.end(), {color.x, color.y, color.z});
  }
  return image;
}

/// Sets the texels [x, x + width) x [y, y + height).
void fill(RgbImage& image, int x, int y, int width, int height, const Rgb& color) {
  for (int j = y; j < y + height; ++j) {
    for (int i = x; i < x + width; ++i) {
      float* texel = &image.rgb[3 * static_cast<std::size_t>(j * image.width + i)];
      texel[0] = color.x;
      texel[1] = color.y;
      texel[2] = color.z;
    }
  }
}

/// Rows blended from `top` to `bottom`.
RgbImage gradient(const Rgb& top, const Rgb& bottom) {
  RgbImage image = constant({});
  for (int j = 0; j < kHeight; ++j) {
    const float t = (static_cast<float>(j) + 0.5f) / kHeight;
    fill(image, 0, j, kWidth, 1, top * (1 - t) + bottom * t);
  }
  return image;
}

}  // namespace

RgbImage studio_map() {
  RgbImage image = gradient({0.3f, 0.4f, 0.6f}, {0.1f, 0.08f, 0.06f});
  fill(image, 8, 6, 7, 5, {9, 8, 7});
  fill(image, 28, 9, 2, 2, {30, 12, 4});
  fill(image, 45, 5, 1, 1, {300, 280, 250});
  return image;
}

RgbImage overcast_map() { return gradient({1.0f, 1.0f, 1.1f}, {0.5f, 0.45f, 0.4f}); }

RgbImage other_map() {
  RgbImage image = gradient({0.2f, 0.2f, 0.2f}, {0.2f, 0.15f, 0.1f});
  fill(image, 36, 7, 5, 6, {4, 6, 10});
  return image;
}

RgbImage dusk_map(bool lit) {
  RgbImage image = overcast_map();
  for (float& value : image.rgb) value *= 0.01f;
  if (lit) fill(image, 28, 8, 2, 2, {40, 40, 40});
  return image;
}

RgbImage black_map() { return constant({}); }

RgbImage lit_texel_map() {
  RgbImage image = constant({});
  fill(image, 20, 9, 1, 1, {100, 100, 100});
  return image;
}

RgbImage panels_map() {
  RgbImage image = constant({});
  for (const auto& [x, y] : {std::pair(2, 4), {15, 10}, {27, 6}, {40, 11}, {52, 5}}) {
    fill(image, x, y, 4, 3, {8, 8, 8});
  }
  return image;
}

RgbImage two_texel_sun_map() {
  RgbImage image = constant({1, 1, 1}, 2 * kWidth, 2 * kHeight);
  fill(image, 70, 18, 2, 1, {1e5f, 1e5f, 1e5f});
  return image;
}

RgbImage broken_map(bool repaired) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  RgbImage image = studio_map();
  for (const auto& [x, y, bad] :
       {std::tuple(10, 8, kNan), {29, 9, kInfinity}, {12, 7, -kInfinity}, {50, 3, -5.0f}}) {
    const float value = repaired ? 0.0f : bad;
    fill(image, x, y, 1, 1, {value, value, value});
  }
  return image;
}

RgbImage lone_panel_map() {
  RgbImage image = constant({0.05f, 0.05f, 0.05f});
  fill(image, 30, 14, 4, 4, {10, 9, 8});
  return image;
}

}  // namespace baton::stability
