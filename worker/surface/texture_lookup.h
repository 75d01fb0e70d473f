#pragma once

#include <array>
#include <span>

#include "common/scene/texture/texture.h"

namespace baton {

/// The parallelogram that a look-up is the mean over: two edges, in units of the whole image. All
/// 0: a point.
struct Footprint {
  std::array<float, 2> a{}, b{};
};

/// The mean over a footprint around (u, v); (0, 0) is the upper left corner of the image, (1, 1)
/// the lower right. Channels as of TextureUse; those that are not kept are 0. Up to 16 blends of
/// two levels lie along the footprint's longer side.
std::array<float, 4> look_up(const Texture& image, std::array<float, 2> uv,
                             const Footprint& footprint, const TextureSampling& sampling);

/// The means of several images at one place, as look_up has them. Those of one size that follow
/// each other are looked up at little more than the price of one. means: a place for each.
void look_up_together(std::span<const Texture* const> images, std::array<float, 2> uv,
                      const Footprint& footprint, const TextureSampling& sampling,
                      std::span<std::array<float, 4>> means);

}  // namespace baton
