#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "common/math/philox.h"
#include "common/scene/camera.h"

namespace baton::kernels {

/// A pixel's sites: cells of a grid, with a place in each.
struct SiteCells {
  std::span<const float> x, y;  ///< (S) columns and rows
  float width = 1;              ///< side of a cell, in pixels
};

/// Positions of all sites in their pixel, [0, 1)^2: the bits of step 0 of `rng`, index i of which
/// are those of sites 2 i and 2 i + 1, with those of `shift` flipped. x, y: (S) and room for a
/// vector of 16 more.
void place_sites(const SiteCells& cells, const Rng& rng, const std::array<std::uint32_t, 2>& shift,
                 std::span<float> x, std::span<float> y);

/// Camera::ray through pixel + (x, y), bit by bit. rays: (count); x, y: (count) and room for a
/// vector more.
void camera_rays(const ImagePlane& plane, const std::array<float, 2>& pixel,
                 std::span<const float> x, std::span<const float> y, std::span<Ray> rays);

}  // namespace baton::kernels
