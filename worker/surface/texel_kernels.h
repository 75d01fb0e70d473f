#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "worker/surface/texel_blend.h"

/// Look-ups of images in SIMD with run-time dispatch.
namespace baton::kernels {

/// The means of images that have the levels of the line, along it. sums: of each image, its
/// channels, then 0.
void blend_texels(const ProbeLine& line, const TextureSampling& sampling,
                  std::span<const TexelArray> images, std::span<std::array<float, 4>> sums);

}  // namespace baton::kernels
