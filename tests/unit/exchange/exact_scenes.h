#pragma once

#include "tests/unit/exchange/exact_exchange.h"

/// The scenes on which the second pass is tested: a few pixels and ten directions each.
namespace baton::exact {

/// Two-sided limit of |z| at level 1e-3 over at most 60 values: 1.7e-5 each [Sidak].
inline constexpr double kLimit = 4.3;

inline constexpr std::size_t kDirections = 10;

/// A shadow edge that moves on by one direction a pixel; the same product everywhere.
inline Scene penumbra() {
  Scene scene(4, 1, kDirections);
  for (std::size_t pixel = 0; pixel < 4; ++pixel) {
    for (std::size_t d = 0; d < kDirections; ++d) {
      scene.reflected[scene.at(pixel, d)] = Rgb{1, 0.8f, 0.5f} * (1 + 0.3f * static_cast<float>(d));
      scene.visible[scene.at(pixel, d)] = d >= 3 + pixel ? 1 : 0;
    }
  }
  return scene;
}

/// The same with Lns 1 : 3 : .5 : 2.
inline Scene scaled_penumbra() {
  Scene scene = penumbra();
  constexpr float kScale[] = {1, 3, 0.5f, 2};
  for (std::size_t i = 0; i < scene.reflected.size(); ++i)
    scene.reflected[i] = scene.reflected[i] * kScale[i / kDirections];
  return scene;
}

/// Diffuse and glossy pixels side by side, of different colours.
inline Scene mixed_materials() {
  Scene scene = penumbra();
  for (std::size_t pixel : {1u, 3u}) {
    for (std::size_t d = 0; d < kDirections; ++d) {
      const float lobe = std::exp(-std::fabs(static_cast<float>(d) - 6.0f));
      scene.reflected[scene.at(pixel, d)] = Rgb{0.1f, 0.2f, 0.3f} * 0.2f + Rgb{4, 2, 1} * lobe;
    }
  }
  return scene;
}

/// Nearly all blocked, nearly free, and two in between.
inline Scene extremes() {
  Scene scene = mixed_materials();
  for (std::size_t d = 0; d < kDirections; ++d) {
    scene.visible[scene.at(0, d)] = d == 7 ? 1 : 0;
    scene.visible[scene.at(1, d)] = d != 0 ? 1 : 0;
  }
  return scene;
}

/// Two sites in each pixel, of different materials; one site of pixel 2 sees nothing.
inline Scene two_sites() {
  Scene scene(3, 1, kDirections, 2);
  for (std::size_t pixel = 0; pixel < 3; ++pixel) {
    for (std::size_t d = 0; d < kDirections; ++d) {
      const float lobe = std::exp(-std::fabs(static_cast<float>(d) - 5.0f));
      scene.reflected[scene.at(pixel, d, 0)] = Rgb{1, 0.8f, 0.5f};
      scene.reflected[scene.at(pixel, d, 1)] = pixel == 2 ? Rgb{} : Rgb{4, 2, 1} * lobe;
      scene.visible[scene.at(pixel, d, 0)] = d >= 2 + 2 * pixel ? 1 : 0;
      scene.visible[scene.at(pixel, d, 1)] = d >= 4 ? 1 : 0;
    }
  }
  return scene;
}

/// (pixels, 3)
inline std::vector<double> truth(const Scene& scene) {
  std::vector<double> values;
  for (std::size_t pixel = 0; pixel < scene.num_pixels(); ++pixel) {
    const Rgb t = scene.truth(pixel);
    values.insert(values.end(), {t.x, t.y, t.z});
  }
  return values;
}

}  // namespace baton::exact
